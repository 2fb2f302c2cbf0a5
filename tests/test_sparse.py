"""Distance fields in bricks about the surface: the dense field where voxels are kept, a stated bound where they are not."""

from __future__ import annotations

import itertools

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from oracle import mesh_distance
from scipy.ndimage import map_coordinates
from test_distance_field import extent
from test_voxelize import box, centres, sphere

import intaglio as ig
from intaglio.errors import InputError
from intaglio.solid.bricks import RADIUS
from intaglio.solid.sparse import CELLS


def kept(field):
    """Which voxels of the fine grid take their values from bricks: of each all but the last, where the next one begins."""
    voxel = [np.minimum(np.arange(n) // CELLS, m - 1) for n, m in zip(field.shape, field.brick.shape, strict=True)]
    return (field.brick >= 0)[np.ix_(*voxel)]


def agrees_with_the_dense_field(field, dense, size, width):
    values = field.volume()
    near = kept(field)
    assert values.shape == dense.shape
    assert np.array_equal(values.world_from_index, dense.world_from_index)
    error = np.abs(values.array.astype(float) - dense.array)
    assert error[near].max() < 1e-6 * size
    assert error.max() <= RADIUS * field.spacing
    assert near[np.abs(dense.array) <= width].all()
    assert (values.array < 0)[near].tobytes() == (dense.array < 0)[near].tobytes()


@given(st.integers(0, 2**32 - 1), st.sampled_from([None, 0.04, "1.5mm"]), st.integers(4, 40))
@settings(max_examples=15, deadline=None)
def test_random_triangles(seed, band, resolution):
    """Soups with needles and points among them: the field of all, and a signed one of what they enclose together."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 40))
    corners = rng.uniform(0, 10, (count, 1, 3)) + rng.normal(size=(count, 3, 3)) * rng.choice([0.1, 1, 8])
    corners[::7, 2] = corners[::7, 1]
    if count == 1:
        corners[0, 2] = corners[0, 1] + (1, 0, 0)
    mesh = ig.TriangleMesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    field = ig.sparse_field(mesh, resolution=resolution, band=band)
    dense = ig.distance_field(mesh, resolution=resolution, band="full")
    near = kept(field)
    values = field.volume().array
    assert np.abs(values - dense.array)[near].max() < 1e-6 * max(extent(mesh), 10)
    width = {None: 0.5 * field.spacing, 0.04: 0.04 * extent(mesh), "1.5mm": 1.5}[band]
    assert near[np.abs(dense.array) <= width].all()
    # Away from them it lies between exact ones, whatever their sign.
    assert np.abs(values).max() <= np.abs(field.coarse).max() + np.abs(field.samples).max()


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=20, deadline=None)
def test_points_anywhere(seed):
    rng = np.random.default_rng(seed)
    low, size = rng.uniform(-50, 50, 3), rng.uniform(1, 20, 3)
    mesh = box(low, low + size)
    field = ig.sparse_field(mesh, resolution=int(rng.integers(8, 90)))
    scale = rng.choice([0.6, 2.0, 40.0])
    points = low + size / 2 + rng.uniform(-scale, scale, (300, 3)) * size.max()
    q = np.abs(points - low - size / 2) - size / 2
    exact = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    found = field.at(points)
    index = (points - field.world_from_index[:3, 3]) / field.spacing
    last = CELLS * np.array(field.brick.shape[::-1])
    away = np.linalg.norm(index - np.clip(index, 0, last), axis=1) * field.spacing
    bound = RADIUS * field.spacing + 2e-6 * (np.abs(exact) + 20)
    assert (np.abs(found - exact)[away == 0] <= bound[away == 0]).all()
    # Outside of the grid: a lower bound, but for what the grid's own values lack, and never less than the way to the grid.
    assert (found <= exact + bound).all()
    assert (found >= away * (1 - 1e-6))[away > 0].all()
    assert np.isfinite(field.gradient(points)).all()


def test_a_sphere():
    field = ig.sparse_field(sphere(rings=200), resolution=256, band="1mm")
    rng = np.random.default_rng(1)
    points = rng.normal(size=(20000, 3))
    points *= (rng.uniform(9.05, 10.95, 20000) / np.linalg.norm(points, axis=1))[:, None]
    radius = np.linalg.norm(points, axis=1)
    # The polyhedron lies below the sphere by as much as its sides do, and the cells' values by an eighth of h^2 / r.
    chord = 10 * (1 - np.cos(np.pi / 200))
    assert np.abs(field.at(points) - (radius - 10)).max() < chord + 3 / 8 * field.spacing**2 / 9
    # Slopes are those of chords no longer than two cells, and so off by half a cell's bend.
    gradient = field.gradient(points)
    assert np.linalg.norm(gradient - points / radius[:, None], axis=1).max() < 0.02
    assert np.abs(np.einsum("ij,ij->i", gradient, points / radius[:, None]) - 1).max() < field.spacing / 2 / 9
    # Far from it, and at its middle, where the distance has a kink.
    assert field.at([(0, 0, 0)])[0] == pytest.approx(-10, abs=RADIUS * field.spacing)
    assert field.at([(0, 0, 30)])[0] == pytest.approx(20, rel=0.25)


@pytest.mark.parametrize("name", ["bunny_watertight.obj", "armadillo.obj", "skull.obj", "fandisk.obj", "femur.off"])
def test_real_meshes(shared, name):
    mesh = ig.read_mesh(shared(f"meshes/{name}"))
    field = ig.sparse_field(mesh, resolution=90)
    dense = ig.distance_field(mesh, resolution=90, band="full")
    agrees_with_the_dense_field(field, dense, extent(mesh), field.spacing / 2)
    assert field.notes == dense.notes
    assert ((field.volume().array < 0) == (dense.array < 0)).all()


@pytest.mark.parametrize("name", ["skull_6k_open.stl", "chair_model.obj", "many_small_holes.ply", "soup.stl"])
def test_bad_meshes_come_with_the_same_caveats(shared, name):
    mesh = ig.read_mesh(shared(f"meshes/bad/{name}"))
    field, voxels = ig.sparse_field(mesh, spacing=extent(mesh) / 47), ig.voxelize(mesh, spacing=extent(mesh) / 47)
    assert field.notes
    # That voxels are in doubt or none is inside is counted on a grid of whole bricks.
    assert field.notes[0].split(";")[0] == voxels.notes[0].split(";")[0]
    near = kept(field)
    assert ((field.volume().array < 0) == voxels.array)[near].all()


def test_far_from_the_origin_and_small():
    for scale, shift in ((1e-4, 0.0), (1.0, 1e6)):
        mesh = sphere(10 * scale, (shift, 0, -shift), rings=30)
        field = ig.sparse_field(mesh, resolution=64)
        dense = ig.distance_field(mesh, resolution=64, band="full")
        agrees_with_the_dense_field(field, dense, extent(mesh), field.spacing / 2)


def test_values_between_voxels(shared):
    mesh = ig.read_mesh(shared("meshes/skull_15k.stl"))
    field = ig.sparse_field(mesh, resolution=120)
    voxels = ig.distance_field(mesh, resolution=120, band="full").array
    rng = np.random.default_rng(0)
    x, y, z = (rng.uniform(0, n - 1.001, 200000) for n in voxels.shape[::-1])
    n = field.brick[(z // CELLS).astype(int), (y // CELLS).astype(int), (x // CELLS).astype(int)]
    points = np.stack([x, y, z], axis=1) @ field.world_from_index[:3, :3].T + field.world_from_index[:3, 3]
    found = field.at(points)
    fine = map_coordinates(voxels.astype(float), [z, y, x], order=1)
    assert (n >= 0).sum() > 10000
    assert np.abs(found - fine)[n >= 0].max() < 1e-5 * extent(mesh)
    between = map_coordinates(field.coarse.astype(float), [z / CELLS, y / CELLS, x / CELLS], order=1)
    assert np.abs(found - between)[n < 0].max() < 1e-5 * extent(mesh)


def test_bricks_agree_on_their_common_faces(shared):
    field = ig.sparse_field(ig.read_mesh(shared("meshes/skull_15k.stl")), resolution=150)
    pairs = 0
    for axis in range(3):
        numbers = np.moveaxis(field.brick, axis, 0)
        a, b = numbers[:-1].ravel(), numbers[1:].ravel()
        both = (a >= 0) & (b >= 0)
        last = np.take(field.samples[a[both]], CELLS, axis=axis + 1)
        first = np.take(field.samples[b[both]], 0, axis=axis + 1)
        assert np.abs(last - first).max() < 1e-6 * 200
        assert ((last < 0) == (first < 0)).all()
        assert (first != 0).all()
        pairs += both.sum()
    assert pairs > 1000


def test_memory_grows_with_the_surface():
    fields = [ig.sparse_field(sphere(rings=60), resolution=n) for n in (64, 128, 256)]
    counts = [len(f.samples) for f in fields]
    for less, more in itertools.pairwise(counts):
        assert 3.4 < more / less < 4.6
    assert fields[2].nbytes < 0.25 * 4 * 256**3
    assert fields[2].nbytes == sum(a.nbytes for a in (fields[2].samples, fields[2].brick, fields[2].coarse))


def test_parts_of_the_grid(shared):
    field = ig.sparse_field(ig.read_mesh(shared("meshes/femur.off")), resolution=100)
    whole = field.volume()
    low, high = whole.corners[0], whole.corners[-1]
    part = field.volume(low + 0.4 * (high - low), low + 0.6 * (high - low))
    first = np.rint((part.corners[0] - low) / field.spacing).astype(int)
    z, y, x = part.shape
    i, j, k = first
    assert part.array.tobytes() == whole.array[k : k + z, j : j + y, i : i + x].tobytes()
    assert field.volume(low - 5, high + 5).array.tobytes() == whole.array.tobytes()
    turned = np.eye(4)
    turned[:3, :3] = np.linalg.qr(np.random.default_rng(0).normal(size=(3, 3)))[0] * 1.3
    turned[:3, 3] = (low + high) / 2
    grid = ig.Volume(np.zeros((11, 13, 14), dtype=bool), turned)
    assert np.allclose(field.volume(like=grid).array.ravel(), field.at(centres(grid)), atol=1e-4)
    # It does what volumes do.
    assert ig.Selection.of(whole).tool is whole
    assert ig.difference(whole, part).array.min() < 0


@pytest.mark.parametrize("name", ["skull.obj", "fandisk.obj"])
def test_the_surface_is_that_of_the_dense_field(shared, name):
    mesh = ig.read_mesh(shared(f"meshes/{name}"))
    found = ig.sparse_field(mesh, resolution=110).surface()
    dense = ig.surface(ig.distance_field(mesh, resolution=110, band="full"))
    assert found.report.closed
    assert found.report.oriented
    assert found.report.manifold
    assert found.triangles.shape == dense.triangles.shape
    a, b = (np.sort(m.vertices @ (1.0, np.sqrt(2), np.sqrt(3))) for m in (found, dense))
    assert np.abs(a - b).max() < 1e-4 * extent(mesh)
    corners = found.vertices[found.triangles]
    normal = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    along = np.einsum("ij,ij->i", normal, found.normals[found.triangles].mean(axis=1))
    assert (along > 0).mean() > 0.98


def test_corners_on_the_surface_have_a_side():
    # All faces pass through voxels: the distance is zero at the body's borders, and still each is on one side.
    field = ig.sparse_field(box((0, 0, 0), (20, 20, 20)), spacing=1.0)
    mesh = field.surface()
    assert mesh.report.closed
    assert mesh.report.manifold
    assert np.abs(mesh_distance(mesh.vertices, *box_arrays((0, 0, 0), (20, 20, 20)))).max() < 1.01


def box_arrays(low, high):
    mesh = box(low, high)
    return mesh.vertices, mesh.triangles


def test_threads_do_not_matter(shared, monkeypatch):
    mesh = ig.read_mesh(shared("meshes/skull_15k.stl"))
    points = np.random.default_rng(0).uniform(-100, 300, (70000, 3))
    results = []
    for threads in ("1", "5"):
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        field = ig.sparse_field(mesh, resolution=100)
        surface = field.surface()
        parts = (field.brick, field.samples, field.coarse, field.at(points), field.gradient(points), surface.vertices)
        results.append([part.tobytes() for part in (*parts, surface.triangles)])
    assert results[0] == results[1]


@pytest.mark.parametrize("stage", [0.1, 0.3, 0.6, 0.9])
def test_cancelling_drops_the_rest(stage):
    seen = []

    def stop(done, total):
        seen.append(done / total)
        if done >= stage * total:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ig.sparse_field(sphere(), resolution=128, progress=stop)
    assert seen[-1] < stage + 0.26
    assert seen == sorted(seen)


@pytest.mark.parametrize(
    ("arguments", "words"),
    [
        ({}, "exactly one of resolution"),
        ({"resolution": 3}, "resolution must be"),
        ({"spacing": 0.0}, "spacing must be"),
        ({"spacing": 1e-9}, "take a larger one"),
        ({"resolution": 16, "band": "full"}, "band must be finite"),
        ({"resolution": 16, "band": -1}, "band must be"),
        ({"resolution": 16, "band": "wide"}, "band must be"),
    ],
)
def test_no_field(arguments, words):
    with pytest.raises(InputError, match=words):
        ig.sparse_field(sphere(), **arguments)


def test_degenerate_meshes():
    with pytest.raises(InputError, match="needs an extent"):
        ig.sparse_field(ig.TriangleMesh(np.zeros((3, 3)), np.array([(0, 1, 2)])), resolution=16)
    flat = ig.TriangleMesh(np.array([(0, 0, 0), (9, 0, 0), (0, 9, 0)], float), np.array([(0, 1, 2)]))
    field = ig.sparse_field(flat, resolution=30)
    assert field.at([(2, 2, 3.0)])[0] == pytest.approx(3, abs=RADIUS * field.spacing)
    line = ig.TriangleMesh(np.array([(0, 0, 0), (9, 0, 0), (4, 0, 0)], float), np.array([(0, 1, 2)]))
    with pytest.raises(InputError, match="no voxel lies inside"):
        ig.sparse_field(line, resolution=30).surface()


@pytest.mark.parametrize("points", [(0, 0, 0), np.zeros((4, 2)), [(0, 0, np.nan)], [(0, np.inf, 0)]])
def test_no_points(points):
    field = ig.sparse_field(sphere(), resolution=16)
    for ask in (field.at, field.gradient):
        with pytest.raises(InputError, match="points must be"):
            ask(points)


def test_no_box():
    field = ig.sparse_field(sphere(), resolution=16)
    for low, high in (((0, 0, 0), (0, 5, 5)), ((5, 5, 5), (0, 0, 0)), ((50, 50, 50), (60, 60, 60))):
        with pytest.raises(InputError, match="must hold two voxels"):
            field.volume(low, high)
    with pytest.raises(InputError, match="low must be a point"):
        field.volume((0, 0))
    with pytest.raises(InputError, match="like must be a Volume"):
        field.volume(like=3)
    assert field.at(np.empty((0, 3))).shape == (0,)
