"""Surfaces from volumes: closed, manifold, outwards, where the field says."""

from __future__ import annotations

import math

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

import intaglio as ig
from intaglio.solid.cubes import EDGES, cube_triangles


def enclosed(mesh: ig.TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def sound(mesh: ig.TriangleMesh) -> bool:
    """Closed, manifold at edges and vertices, oriented, without empty triangles."""
    report = mesh.report
    # Round every vertex its triangles make one fan: as many corners as edges, all in one piece.
    t = mesh.triangles
    links = np.concatenate([t[:, [0, 1, 2]], t[:, [1, 2, 0]], t[:, [2, 0, 1]]])
    order = np.argsort(links[:, 0], kind="stable")
    links = links[order]
    ends = np.flatnonzero(np.diff(links[:, 0], append=-1)) + 1
    begin = 0
    for end in ends:
        follow = dict(links[begin:end, 1:].tolist())
        start = place = next(iter(follow))
        steps = 0
        while steps == 0 or place != start:
            place = follow[place]
            steps += 1
        if steps != end - begin:
            return False
        begin = end
    return report.closed and report.manifold and report.oriented and report.degenerate_triangles == 0


def field(n: int, distance, spacing=(1.0, 1.0, 1.0)) -> ig.Volume:
    grid = ig.Volume.from_array(np.zeros((n, n, n), dtype=np.float32), spacing, (-5.0, 3.0, 7.0))
    return ig.Volume(distance(oracle.positions(grid)).astype(np.float32), grid.world_from_index)


def test_every_cube_parts_inside_from_outside():
    number, corners = cube_triangles()
    assert number[0] == number[255] == 0
    for case in range(256):
        used = set(corners[case, : 3 * number[case]].tolist())
        assert used == {e for e, (a, b) in enumerate(EDGES) if (case >> a ^ case >> b) & 1}


@settings(deadline=None, max_examples=25)
@given(hnp.arrays(np.float32, st.tuples(*[st.integers(2, 6)] * 3), elements=st.integers(-3, 3).map(float)))
def test_any_field_gives_a_closed_manifold(values):
    volume = ig.Volume.from_array(values, (0.5, 1.0, 2.0))
    if not (values <= 0).any() or values.min() == values.max():
        return
    mesh = ig.surface(volume)
    assert sound(mesh)
    assert enclosed(mesh) > 0


def test_noise_is_closed_and_manifold():
    noise = np.random.default_rng(0).normal(size=(24, 25, 26)).astype(np.float32)
    assert sound(ig.surface(ig.Volume.from_array(noise)))
    assert sound(ig.surface(ig.Volume.from_array(noise > 0.2)))
    opened = ig.surface(ig.Volume.from_array(noise), cap=False).report
    assert opened.manifold
    assert opened.oriented
    assert opened.boundary_edges > 0


@pytest.mark.parametrize("mirror", [1.0, -1.0])
def test_a_ball_lies_where_it_is_and_faces_outwards(mirror):
    centre = np.array([8.3, 17.1, 20.9])
    ball = field(48, lambda p: oracle.ball(p, centre, 11.0), (0.6, 0.6, 0.6))
    turn = np.diag([mirror, 1.0, 1.0, 1.0])
    mesh = ig.surface(ig.Volume(ball.array, turn @ ball.world_from_index))
    away = mesh.vertices - centre * (mirror, 1, 1)
    radius = np.linalg.norm(away, axis=1)
    # Along an edge of length h the sphere leaves the chord by h² / 8r.
    assert np.abs(radius - 11.0).max() < 0.6**2 / (8 * 11.0) + 1e-3
    assert enclosed(mesh) == pytest.approx(4 / 3 * math.pi * 11.0**3, rel=2e-3)
    assert sound(mesh)
    assert mesh.normals is not None
    assert np.abs((mesh.normals * away).sum(axis=1) / radius - 1).max() < 1e-3


def test_a_body_cut_off_by_its_grid_is_capped():
    ball = field(30, lambda p: oracle.ball(p, (-5.0, 18.0, 22.0), 9.0))
    mesh = ig.surface(ball)
    assert sound(mesh)
    assert enclosed(mesh) == pytest.approx(2 / 3 * math.pi * 9.0**3, rel=3 / (8 * 9.0**2) + 5e-3)
    cap = mesh.vertices[:, 0] < -5.0
    assert cap.sum() > 100
    assert np.allclose(mesh.normals[cap], (-1, 0, 0))
    assert not ig.surface(ball, cap=False).report.closed


def test_scans_are_inside_above_the_isovalue():
    scan = field(40, lambda p: 300 - 20 * oracle.ball(p, (14.0, 22.0, 26.0), 8.0))
    as_scan = ig.surface(scan, 300)
    # Chords of a cell lie up to 3 / 8r within a sphere.
    assert enclosed(as_scan) == pytest.approx(4 / 3 * math.pi * 8.0**3, rel=3 * 3 / (8 * 8.0**2))
    flipped = ig.Volume(-scan.array, scan.world_from_index)
    assert enclosed(ig.surface(flipped, -300, inside="below")) == pytest.approx(enclosed(as_scan))


def test_any_thread_count_gives_the_same_mesh(monkeypatch):
    noise = ig.Volume.from_array(np.random.default_rng(0).normal(size=(70, 21, 22)).astype(np.float32))
    many = ig.surface(noise)
    monkeypatch.setenv("INTAGLIO_THREADS", "1")
    one = ig.surface(noise)
    assert np.array_equal(many.vertices, one.vertices)
    assert np.array_equal(many.triangles, one.triangles)


def test_what_has_no_surface_is_refused():
    volume = ig.Volume.from_array(np.linspace(1, 2, 64, dtype=np.float32).reshape(4, 4, 4))
    with pytest.raises(ig.InputError, match="iso must be within the volume's values, 1 to 2, not 0"):
        ig.surface(volume)
    with pytest.raises(ig.InputError, match="inside must be above or below"):
        ig.surface(volume, 1.5, inside="left")
    with pytest.raises(ig.InputError, match="iso must be given for voxels of uint8"):
        ig.surface(ig.Volume.from_array(np.arange(64, dtype=np.uint8).reshape(4, 4, 4)))
    with pytest.raises(ig.InputError, match="fills the grid, and so has no surface; close it with cap=True"):
        ig.surface(volume, 1.0, cap=False)


@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "glb"])
def test_meshes_are_saved_and_read_again(kind, tmp_path):
    mesh = ig.surface(field(30, lambda p: oracle.box(p, (9.0, 18.0, 21.0), (6.0, 5.0, 4.0))))
    path = tmp_path / f"box.{kind}"
    mesh.save(path)
    back = ig.read_mesh(path)
    assert len(back.triangles) == len(mesh.triangles)
    assert back.report.caveats == ()
    assert enclosed(back) == pytest.approx(enclosed(mesh), rel=1e-5)
    assert np.allclose(back.corners, mesh.corners, atol=1e-4)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


def test_normals_are_saved(tmp_path):
    import trimesh

    mesh = ig.surface(field(30, lambda p: oracle.ball(p, (9.0, 18.0, 21.0), 6.0)))
    mesh.save(tmp_path / "ball.ply")
    assert np.allclose(trimesh.load(tmp_path / "ball.ply", process=False).vertex_normals, mesh.normals, atol=1e-5)


def test_other_kinds_of_file_are_refused(tmp_path):
    mesh = ig.surface(field(20, lambda p: oracle.ball(p, (4.0, 12.0, 16.0), 6.0)))
    with pytest.raises(ig.InputError, match=r"output must end in \.stl, \.ply, \.obj or \.glb, not 'ball\.vtk'"):
        mesh.save(tmp_path / "ball.vtk")


def test_bone_of_a_real_scan(shared):
    volume = ig.read_volume(shared("volumes/ct_head.nii.gz"))
    mesh = ig.surface(volume, 0.5)
    report = mesh.report
    assert report.closed
    assert report.manifold
    assert report.oriented
    voxels = float((volume.array >= 0.5).sum()) * float(np.prod(volume.spacing))
    assert enclosed(mesh) == pytest.approx(voxels, rel=0.05)
    low, high = volume.corners.min(axis=0), volume.corners.max(axis=0)
    assert (mesh.vertices > low - 0.01).all()
    assert (mesh.vertices < high + 0.01).all()
