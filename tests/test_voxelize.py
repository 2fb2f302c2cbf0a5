"""Which voxels lie inside a mesh: closed forms, exactness in ties, and what happens to meshes that are not closed."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from oracle import mesh_distance, winding_number

import intaglio as ig
from intaglio.compute import frozen
from intaglio.errors import InputError
from intaglio.solid.lids import BLOCK, angles_in_layers, lids_of, solid_angle
from intaglio.solid.point_triangle import frames_of
from intaglio.solid.scan_conversion import CLOSE

MESHES = [
    "armadillo.obj", "bunny.obj", "bunny_watertight.obj", "fandisk.obj", "femur.off", "hand.off", "liver.obj", "pelvis.obj",
    "skull.obj", "skull_15k.stl", "teapot.obj", "torus.obj",
]  # fmt: skip

BAD = ["skull_6k_open.stl", "bunny_broken.ply", "chair_model.obj", "many_small_holes.ply", "soup.stl", "hippo_tristrips.ply"]


def sphere(radius=10.0, centre=(0.0, 0.0, 0.0), rings=40):
    """Latitudes and longitudes, closed, outwards."""
    a = np.linspace(0, np.pi, rings + 1)[1:-1]
    b = np.arange(2 * rings) * np.pi / rings
    ring = [(np.sin(t) * np.cos(p), np.sin(t) * np.sin(p), np.cos(t)) for t in a for p in b]
    vertices = np.array([(0, 0, 1), *ring, (0, 0, -1)]) * radius + centre
    n, last = 2 * rings, len(vertices) - 1
    at = lambda r, k: 1 + r * n + k % n  # noqa: E731
    triangles = [(0, at(0, k), at(0, k + 1)) for k in range(n)]
    for r in range(rings - 2):
        for k in range(n):
            triangles += [(at(r, k), at(r + 1, k), at(r + 1, k + 1)), (at(r, k), at(r + 1, k + 1), at(r, k + 1))]
    triangles += [(at(rings - 2, k), last, at(rings - 2, k + 1)) for k in range(n)]
    return ig.TriangleMesh(vertices, np.array(triangles))


def box(low, high):
    vertices = np.array(list(itertools.product(*zip(low, high, strict=True))), dtype=float)
    quads = [(0, 1, 3, 2), (4, 6, 7, 5), (0, 4, 5, 1), (2, 3, 7, 6), (0, 2, 6, 4), (1, 5, 7, 3)]
    return ig.TriangleMesh(vertices, np.array([t for a, b, c, d in quads for t in ((a, b, c), (a, c, d))]))


def together(*meshes):
    starts = np.cumsum([0, *(len(m.vertices) for m in meshes)])
    return ig.TriangleMesh(
        np.concatenate([m.vertices for m in meshes]),
        np.concatenate([m.triangles + s for m, s in zip(meshes, starts, strict=False)]),
    )


def inwards(mesh):
    return ig.TriangleMesh(mesh.vertices, mesh.triangles[:, ::-1])


def centres(volume):
    z, y, x = np.indices(volume.shape).reshape(3, -1)
    return np.stack([x, y, z, np.ones_like(x)], axis=1) @ volume.world_from_index.T[:, :3]


def litres(volume):
    return volume.array.sum() * abs(np.linalg.det(volume.world_from_index[:3, :3]))


def test_a_sphere_holds_what_it_should():
    voxels = ig.voxelize(sphere(rings=120), resolution=128)
    assert voxels.array.dtype == bool
    assert voxels.notes == ()
    assert litres(voxels) == pytest.approx(4 / 3 * np.pi * 1000, rel=2e-3)
    radius = np.linalg.norm(centres(voxels), axis=1)
    # A stray voxel would lie outside, a hole inside.
    assert not voxels.array.ravel()[radius > 10].any()
    assert voxels.array.ravel()[radius < 10 * np.cos(np.pi / 120)].all()


def test_voxel_centres_on_the_surface_belong_to_one_side():
    # Faces, edges and vertices all pass through voxel centres; two boxes share a face.
    grid = ig.Volume.from_array(np.zeros((9, 9, 9), dtype=bool))
    left, right = box((2, 2, 2), (4, 6, 6)), box((4, 2, 2), (6, 6, 6))
    a, b = (ig.voxelize(part, like=grid).array for part in (left, right))
    whole = ig.voxelize(box((2, 2, 2), (6, 6, 6)), like=grid).array
    assert whole.sum() == 4 * 4 * 4
    assert not (a & b).any()
    assert ((a | b) == whole).all()


def test_shells_add_up():
    grid = ig.Volume.from_array(np.zeros((50, 50, 50), dtype=bool), 0.5, (-12.25,) * 3)
    outer, inner = sphere(10), sphere(5)
    alone = ig.voxelize(outer, like=grid).array
    assert (ig.voxelize(together(outer, inner), like=grid).array == alone).all()
    cavity = ig.voxelize(together(outer, inwards(inner)), like=grid).array
    assert (cavity == (alone & ~ig.voxelize(inner, like=grid).array)).all()
    assert (ig.voxelize(inwards(outer), like=grid).array == alone).all()
    two = sphere(6, (-3, 0, 0)), sphere(6, (3, 0, 0))
    one, other = (ig.voxelize(part, like=grid).array for part in two)
    assert (ig.voxelize(together(*two), like=grid).array == (one | other)).all()


@given(st.integers(0, 2**32 - 1), st.booleans())
@settings(max_examples=25, deadline=None)
def test_against_winding_numbers(seed, snapped):
    """Closed meshes that cut through themselves, half of them with vertices on voxel centres: off the surface, exact."""
    rng = np.random.default_rng(seed)
    mesh = sphere(rings=4)
    vertices = rng.uniform(1, 10, (len(mesh.vertices), 3))
    mesh = ig.TriangleMesh(np.rint(vertices) if snapped else vertices, mesh.triangles)
    turn = np.linalg.qr(rng.normal(size=(3, 3)))[0] * rng.uniform(0.7, 1.3, 3)
    matrix = np.eye(4) if snapped else np.block([[turn, np.full((3, 1), 5.5) - turn @ np.full((3, 1), 5.5)], [0, 0, 0, 1]])
    voxels = ig.voxelize(mesh, like=ig.Volume(np.zeros((12, 12, 12), dtype=bool), matrix))
    points = centres(voxels)
    clear = mesh_distance(points, mesh.vertices, mesh.triangles) > 1e-4
    winding = np.rint(winding_number(points, mesh.vertices, mesh.triangles))
    assert (voxels.array.ravel() == (winding != 0))[clear].all()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_open_meshes_have_the_generalized_winding_number(seed):
    rng = np.random.default_rng(seed)
    mesh = sphere(rings=6)
    keep = rng.random(len(mesh.triangles)) < rng.uniform(0.5, 1.0)
    keep[0] = False
    mesh = ig.TriangleMesh(mesh.vertices, mesh.triangles[keep])
    voxels = ig.voxelize(mesh, resolution=20)
    points = centres(voxels)
    winding = np.abs(winding_number(points, mesh.vertices, mesh.triangles))
    clear = (np.abs(winding - 0.5) > 1e-6) & (mesh_distance(points, mesh.vertices, mesh.triangles) > 1e-4)
    assert (voxels.array.ravel() == (winding > 0.5))[clear].all()
    doubt = int(voxels.notes[0].split("leaves ")[1].split()[0])
    assert abs(doubt - ((winding > 0.25) & (winding < 0.75)).sum()) <= 0.02 * voxels.array.size
    assert "open" in voxels.notes[0]


@pytest.mark.parametrize("name", ["torus.obj", "bad/bunny_broken.ply", "bad/hippo_tristrips.ply", "bad/skull_6k_open.stl"])
def test_rows_of_all_three_directions_agree(shared, name):
    """What is inside does not depend on the axis along which one counts."""
    mesh = ig.read_mesh(shared(f"meshes/{name}"))
    grid = ig.voxelize(mesh, resolution=40)
    for axes in ([1, 2, 0], [2, 0, 1]):
        z, y, x = np.array(grid.shape[::-1])[axes][::-1]
        turned = grid.world_from_index[:, [*axes, 3]]
        other = ig.voxelize(mesh, like=ig.Volume(np.zeros((z, y, x), dtype=bool), turned)).array
        # Back to (x, y, z), then to the axes of the first.
        same = np.transpose(np.transpose(other, (2, 1, 0)), np.argsort(axes)).transpose(2, 1, 0)
        assert (same == grid.array).all()


def test_triangles_that_face_different_ways_are_counted_by_parity():
    mesh = box((0, 0, 0), (10, 10, 10))
    triangles = mesh.triangles.copy()
    triangles[::3] = triangles[::3, ::-1]
    voxels = ig.voxelize(ig.TriangleMesh(mesh.vertices, triangles), resolution=32)
    assert (voxels.array == ig.voxelize(mesh, resolution=32).array).all()
    assert "face different ways" in voxels.notes[0]


def test_seams_are_not_holes():
    mesh = sphere()
    split = ig.TriangleMesh(mesh.vertices[mesh.triangles].reshape(-1, 3), np.arange(3 * len(mesh.triangles)).reshape(-1, 3))
    voxels = ig.voxelize(split, resolution=32)
    assert voxels.notes == ()
    assert (voxels.array == ig.voxelize(mesh, resolution=32).array).all()


@pytest.mark.parametrize("name", MESHES)
def test_every_mesh_has_its_volume(shared, name):
    mesh = ig.read_mesh(shared(f"meshes/{name}"))
    voxels = ig.voxelize(mesh, resolution=96)
    a, b, c = (mesh.vertices[corner] - mesh.vertices.mean(axis=0) for corner in mesh.triangles.T)
    exact = np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6
    open_ = name in ("bunny.obj", "teapot.obj")
    assert bool(voxels.notes) == open_
    # Of open meshes the sum over triangles is only nearly the volume.
    assert litres(voxels) == pytest.approx(exact, rel=0.2 if open_ else 0.01)


@pytest.mark.parametrize("name", ["many_small_holes.ply", "soup.stl"])
def test_lids_far_away_are_summed_up(shared, name):
    """Polynomials differ from the sum over all lids by less than what scan conversion asks it again for."""
    mesh = ig.read_mesh(shared(f"meshes/bad/{name}"))
    grid = ig.voxelize(mesh, resolution=90)
    nz, ny, nx = grid.shape
    lids, _ = lids_of(mesh)
    angle = np.empty((BLOCK, ny, nx), dtype=np.float32)
    worst = 0.0
    for z0 in range(0, nz - BLOCK, 3 * BLOCK):
        angles_in_layers(z0, lids, frames_of(lids), frozen(grid.world_from_index), angle)
        for k, j, i in np.random.default_rng(z0).integers(0, (BLOCK, ny, nx), (3000, 3)):
            point = grid.world_from_index[:3] @ (i, j, z0 + k, 1)
            exact = solid_angle(lids, np.arange(len(lids), dtype=np.int32), len(lids), *point)
            worst = max(worst, abs(exact - angle[k, j, i]))
    assert worst < CLOSE / 2


@pytest.mark.parametrize("name", BAD)
def test_no_bad_mesh_is_wrong_in_silence(shared, name):
    voxels = ig.voxelize(ig.read_mesh(shared(f"meshes/bad/{name}")), resolution=40)
    assert any("open, " in note or "no voxel" in note for note in voxels.notes)


def test_threads_do_not_matter(shared, monkeypatch):
    mesh = ig.read_mesh(shared("meshes/bad/bunny_broken.ply"))
    monkeypatch.setenv("INTAGLIO_THREADS", "1")
    one = ig.voxelize(mesh, resolution=50)
    monkeypatch.setenv("INTAGLIO_THREADS", "5")
    five = ig.voxelize(mesh, resolution=50)
    assert (one.array == five.array).all()
    assert one.notes == five.notes


def test_grids():
    mesh = box((0, 0, 0), (20, 10, 5))
    by_number = ig.voxelize(mesh, resolution=64)
    assert by_number.shape[2] == 64
    assert by_number.corners.min(axis=0)[0] == pytest.approx(-1)
    by_step = ig.voxelize(mesh, spacing=by_number.spacing[0])
    assert by_step.shape == by_number.shape
    assert np.allclose(by_step.world_from_index, by_number.world_from_index)
    far = ig.Volume.from_array(np.zeros((4, 4, 4)), origin=(100, 0, 0))
    assert "no voxel" in ig.voxelize(mesh, like=far).notes[0]


@pytest.mark.parametrize(
    "grid",
    [{}, {"resolution": 3}, {"resolution": 2.5}, {"spacing": 0}, {"spacing": 1e-9}, {"resolution": 8, "spacing": 1}, {"like": 3}],
)
def test_no_grid(grid):
    with pytest.raises(InputError):
        ig.voxelize(box((0, 0, 0), (1, 1, 1)), **grid)


def test_nothing_has_no_inside():
    with pytest.raises(InputError, match="one place"):
        ig.voxelize(ig.TriangleMesh(np.ones((3, 3)), np.array([[0, 1, 2]])), resolution=8)


def test_cancelling_drops_the_rest():
    seen = []

    def stop(done, total):
        seen.append(done)
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ig.voxelize(sphere(), resolution=128, progress=stop)
    assert seen[-1] == 2
