"""Signed distances to meshes: closed forms, a float64 oracle, and the sign where a plane would give the wrong one."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from oracle import mesh_distance, point_triangle_distance
from test_voxelize import MESHES, box, centres, sphere, together

import intaglio as ig
from intaglio.errors import InputError
from intaglio.solid.point_triangle import frames_of, nearest_place, squared_distance


def extent(mesh):
    return np.ptp(mesh.vertices, axis=0).max()


@given(st.integers(0, 2**32 - 1), st.sampled_from(["any", "needle", "flat", "segment", "point", "right"]))
@settings(max_examples=60, deadline=None)
def test_point_to_triangle(seed, kind):
    rng = np.random.default_rng(seed)
    a, b, c = rng.normal(size=(3, 3))
    if kind == "needle":
        c = a + rng.uniform() * (b - a) + 1e-7 * rng.normal(size=3)
    elif kind == "flat":
        a[2] = b[2] = c[2] = 0
    elif kind == "segment":
        c = a + rng.uniform(-1, 2) * (b - a)
    elif kind == "point":
        a = b = c
    elif kind == "right":
        a, b, c = np.zeros(3), np.eye(3)[0], np.eye(3)[1]
    corners = np.array([a, b, c])
    points = np.concatenate([rng.normal(size=(20, 3)) * 2, corners, (corners + np.roll(corners, 1, axis=0)) / 2])
    exact = point_triangle_distance(points, corners)
    frame = frames_of(corners[None])[0]
    for point, distance in zip(points, exact, strict=True):
        r, s, t = (np.float32(v) for v in frame[:9].reshape(3, 3) @ point + frame[9:12])
        square = squared_distance(r, s, t, *(np.float32(v) for v in frame[12:]), np.float32(2e-6))
        assert np.sqrt(square) == pytest.approx(distance, abs=5e-6)
        place = np.array(nearest_place(frame, *point))
        assert np.linalg.norm(place - point) == pytest.approx(distance, abs=1e-7)
        assert point_triangle_distance(place[None], corners)[0] < 1e-7


@given(st.integers(0, 2**32 - 1), st.sampled_from(["full", 0.1, "1.5mm"]))
@settings(max_examples=25, deadline=None)
def test_against_all_triangles(seed, band):
    """Random triangles, needles and points among them, on turned and sheared grids."""
    rng = np.random.default_rng(seed)
    count = int(rng.integers(1, 60))
    corners = rng.uniform(0, 10, (count, 1, 3)) + rng.normal(size=(count, 3, 3)) * rng.choice([0.1, 1, 8])
    corners[::7, 2] = corners[::7, 1]
    mesh = ig.TriangleMesh(corners.reshape(-1, 3), np.arange(3 * count).reshape(-1, 3))
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] + rng.uniform(-0.2, 0.2, (3, 3))
    matrix[:3, 3] = rng.uniform(0, 10, 3) - matrix[:3, :3] @ np.full(3, 6.0)
    grid = ig.Volume(np.zeros((11, 13, 14), dtype=bool), matrix)
    field, nearest = ig.distance_field(mesh, like=grid, band=band, return_closest=True)
    points = centres(field)
    exact = mesh_distance(points, mesh.vertices, mesh.triangles)
    width = {"full": np.inf, 0.1: 0.1 * extent(mesh), "1.5mm": 1.5}[band]
    error = np.abs(np.abs(field.array.ravel()) - np.minimum(exact, width))
    assert error.max() < 1e-6 * max(extent(mesh), 10)
    assert ((field.array < 0) == ig.voxelize(mesh, like=grid).array).all()
    found = nearest.array.ravel()
    clear = np.abs(exact - width) > 1e-5
    assert ((found >= 0) == (exact < width))[clear].all()
    for point, triangle, distance in zip(points[::97], found[::97], exact[::97], strict=True):
        if triangle >= 0:
            assert point_triangle_distance(point[None], mesh.vertices[mesh.triangles[triangle]])[0] < distance + 2e-5


def test_sphere_box_and_torus(shared):
    field = ig.distance_field(sphere(rings=100), resolution=64, band="full")
    exact = np.linalg.norm(centres(field), axis=1) - 10
    assert np.abs(field.array.ravel() - exact).max() < 10 * (1 - np.cos(np.pi / 100)) + 1e-5
    field = ig.distance_field(box((-3, -4, -5), (3, 4, 5)), resolution=50, band="full")
    q = np.abs(centres(field)) - (3, 4, 5)
    exact = np.linalg.norm(np.maximum(q, 0), axis=1) + np.minimum(q.max(axis=1), 0)
    assert np.abs(field.array.ravel() - exact).max() < 1e-5
    # Of the torus's vertices, which lie on it.
    torus = ig.read_mesh(shared("meshes/torus.obj"))
    low, high = torus.vertices.min(axis=0), torus.vertices.max(axis=0)
    axis = int(np.argmin(high - low))
    a, b = (k for k in range(3) if k != axis)
    small = (high - low)[axis] / 2
    field = ig.distance_field(torus, resolution=64, band="full")
    p = centres(field) - (low + high) / 2
    stretch = (high - low)[[a, b]] / (high - low)[a]
    if np.allclose(stretch, 1, atol=0.01):
        large = (high - low)[a] / 2 - small
        exact = np.hypot(np.hypot(p[:, a], p[:, b]) - large, p[:, axis]) - small
        assert np.abs(field.array.ravel() - exact).max() < 0.05 * small


def test_nested_and_overlapping_spheres():
    inner = sphere(5, rings=80)
    hollow = together(sphere(10, rings=80), ig.TriangleMesh(inner.vertices, inner.triangles[:, ::-1]))
    field = ig.distance_field(hollow, resolution=48, band="full")
    radius = np.linalg.norm(centres(field), axis=1)
    assert np.abs(field.array.ravel() - np.maximum(radius - 10, 5 - radius)).max() < 0.01
    two = together(sphere(6, (-3, 0, 0), 80), sphere(6, (3, 0, 0), 80))
    field = ig.distance_field(two, resolution=48, band="full")
    p = centres(field)
    union = np.minimum(*(np.linalg.norm(p - (x, 0, 0), axis=1) - 6 for x in (-3, 3)))
    assert ((field.array.ravel() < 0) == (union < 0))[np.abs(union) > 0.01].all()
    outside = union > 0.01
    assert np.abs(field.array.ravel() - union)[outside].max() < 0.01


def spike():
    """A thin pyramid: beside its tip, the plane of either side may be the wrong one to ask (Kaehler 2010, fig. 3.4)."""
    vertices = np.array([(0, 0, 20), (1, 1, 0), (-1, 1, 0), (-1, -1, 0), (1, -1, 0)], dtype=float)
    return ig.TriangleMesh(vertices, np.array([(0, 1, 2), (0, 2, 3), (0, 3, 4), (0, 4, 1), (1, 3, 2), (1, 4, 3)]))


def test_the_sign_is_right_at_spikes():
    mesh = spike()
    grid = ig.Volume.from_array(np.zeros((60, 40, 40), dtype=bool), 0.25, (-5.1, -5.2, 11.9))
    field, nearest = ig.distance_field(mesh, like=grid, band="full", return_closest=True)
    p = centres(field)
    inside = (p[:, 2] > 0) & (np.abs(p[:, :2]).max(axis=1) < 1 - p[:, 2] / 20)
    assert ((field.array.ravel() < 0) == inside).all()
    # The test can fail: asking the plane of the nearest triangle calls points beside the tip inside.
    a, b, c = np.moveaxis(mesh.vertices[mesh.triangles[nearest.array.ravel()]], 1, 0)
    by_plane = np.einsum("ij,ij->i", p - a, np.cross(b - a, c - a)) < 0
    assert (by_plane & ~inside).sum() > 100


@pytest.mark.parametrize("name", MESHES)
def test_every_mesh(shared, name):
    mesh = ig.read_mesh(shared(f"meshes/{name}"))
    field, nearest = ig.distance_field(mesh, resolution=40, band="full", return_closest=True)
    assert field.array.dtype == np.float32
    pick = np.random.default_rng(0).choice(field.array.size, 12, replace=False)
    points = centres(field)[pick]
    corners = mesh.vertices[mesh.triangles]
    near = np.linalg.norm(corners.mean(axis=1)[None] - points[:, None], axis=2)
    size = np.linalg.norm(corners - corners.mean(axis=1, keepdims=True), axis=2).max(axis=1)
    for k, point in enumerate(points):
        bound = (near[k] + size).min()
        exact = mesh_distance(point[None], mesh.vertices, mesh.triangles[near[k] - size <= bound][:4000])[0]
        assert abs(field.array.ravel()[pick[k]]) <= exact + 1e-6 * extent(mesh)
        own = point_triangle_distance(point[None], corners[nearest.array.ravel()[pick[k]]])[0]
        assert abs(field.array.ravel()[pick[k]]) == pytest.approx(own, abs=1e-6 * extent(mesh))
    # Between neighbours a distance changes by no more than theirs, through the surface too; and mostly with slope 1.
    if not field.notes:
        for axis in range(3):
            assert np.abs(np.diff(field.array, axis=axis)).max() < field.spacing[0] * (1 + 1e-4)
    gz, gy, gx = np.gradient(field.array.astype(float), *field.spacing[::-1])
    assert np.median(np.sqrt(gx * gx + gy * gy + gz * gz)) == pytest.approx(1, abs=0.02)


@pytest.mark.parametrize("name", ["skull_6k_open.stl", "chair_model.obj", "many_small_holes.ply", "soup.stl"])
def test_bad_meshes_come_with_a_caveat(shared, name):
    field = ig.distance_field(ig.read_mesh(shared(f"meshes/bad/{name}")), resolution=32)
    assert field.notes
    assert np.isfinite(field.array).all()


def test_a_band_agrees_with_the_full_field(shared):
    mesh = ig.read_mesh(shared("meshes/skull_15k.stl"))
    full = ig.distance_field(mesh, resolution=70, band="full")
    # Triangle by triangle where the band is narrow, by halving where it is wide.
    for band, width in ((0.02, 0.02 * extent(mesh)), (0.3, 0.3 * extent(mesh)), (f"{0.2}mm", 0.2)):
        field = ig.distance_field(mesh, resolution=70, band=band)
        assert np.allclose(field.array, np.clip(full.array, -width, width), atol=2e-7 * extent(mesh))


def test_what_lies_far_outside_the_grid_does_not_matter():
    mesh = together(sphere(10), sphere(2, (1e12, 0, 0)))
    grid = ig.Volume.from_array(np.zeros((40, 40, 40), dtype=bool), 0.6, (-11.7,) * 3)
    alone = ig.distance_field(sphere(10), like=grid, band="1mm")
    assert np.allclose(ig.distance_field(mesh, like=grid, band="1mm").array, alone.array, atol=1e-5)


def test_threads_do_not_matter(shared, monkeypatch):
    mesh = ig.read_mesh(shared("meshes/skull_15k.stl"))
    monkeypatch.setenv("INTAGLIO_THREADS", "1")
    one = ig.distance_field(mesh, resolution=70, return_closest=True)
    monkeypatch.setenv("INTAGLIO_THREADS", "5")
    five = ig.distance_field(mesh, resolution=70, return_closest=True)
    assert one[0].array.tobytes() == five[0].array.tobytes()
    assert one[1].array.tobytes() == five[1].array.tobytes()


def test_cancelling_drops_the_rest():
    seen = []

    def stop(done, total):
        seen.append(done)
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ig.distance_field(sphere(), resolution=128, progress=stop)
    assert seen[-1] == 2


@pytest.mark.parametrize("band", [0, -0.1, "wide", "-3mm", "mm", float("nan"), float("inf"), None])
def test_no_band(band):
    with pytest.raises(InputError, match="band must be"):
        ig.distance_field(sphere(), resolution=16, band=band)


def test_a_field_is_a_tool_that_cuts():
    field = ig.distance_field(sphere(10), resolution=40)
    tool = ig.Selection.of(field)
    scan = ig.Volume.from_array(np.full((31, 31, 31), 100, dtype=np.uint8), 1.0, (0.0, -15.0, -15.0))
    scan.array[-1] = 0
    camera = ig.Camera.looking("left", at=scan, size=(60, 60))
    whole = ig.isosurface(scan, 50, camera)
    cut = ig.isosurface(scan, 50, camera, selections=[tool])
    # The ball's half that reaches into the scan is gone, and a hollow of its depth stays.
    assert cut.depth[30, 30] - whole.depth[30, 30] == pytest.approx(10, abs=0.2)
    assert cut.depth[30, 10] == pytest.approx(whole.depth[30, 10], abs=0.01)
