"""The isosurface ray caster against closed forms, brute force and float64 twins."""

from __future__ import annotations

import gc
import weakref
from dataclasses import dataclass
from functools import cache

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage

from intaglio import Camera, GBuffer, InputError, Light, Material, Volume, isosurface
from intaglio.compute import frozen
from intaglio.ink.contours import places
from intaglio.rendering.first_hit import STEP, first_hit
from intaglio.rendering.skipping import BLOCK, min_max_blocks, surface_blocks, surface_corners

SHAPE = (48, 52, 56)
NO_TOOLS = (np.zeros((0, 20)), np.zeros(1, dtype=np.float32))
TURN = np.linalg.qr(np.array([[2.0, 1.0, 0.5], [-1.0, 2.0, 1.0], [0.3, -1.0, 2.0]]))[0]
SPACING = (1.0, 0.75, 1.3)
# A right-handed and a left-handed grid, turned and uneven, beside the plain one.
GRIDS = {
    "even": oracle.centred(SHAPE),
    "oblique": oracle.centred(SHAPE, TURN * SPACING),
    "mirrored": oracle.centred(SHAPE, np.diag([-1.0, 1.0, 1.0]) @ TURN * SPACING),
}
COARSEST = {"even": 1.0, "oblique": 1.3, "mirrored": 1.3}
BODIES = {
    "sphere": oracle.Sphere(16.3, (0.3, 0.2, -0.4)),
    "cylinder": oracle.Cylinder(12.0, (1.0, 1.0, 3.0)),
    "torus": oracle.Torus(11.0, 6.0),
    "saddle": oracle.Saddle(30.0),
    "cavity": oracle.Hollow(oracle.Cylinder(12.0, (1.0, 1.0, 3.0))),
}
VIEWS = {"saddle": (1.0, 2.0, 5.0), "cavity": (1.0, 0.6, 3.0)}
BUFFERS = ("depth", "normal", "curvature", "direction", "view_curvature", "light", "edge")

each_body = pytest.mark.parametrize("body", BODIES)
each_grid = pytest.mark.parametrize("grid", GRIDS)
each_projection = pytest.mark.parametrize("projection", ["orthographic", "perspective"])


@dataclass
class Seen:
    """What is rendered at n pixels, and what is there in truth: the body, cut off where the grid ends."""

    gb: GBuffer
    hit: tuple[np.ndarray, np.ndarray]  # rows and columns of the pixels
    missed: float  # share of rays that hit where nothing is or the other way round
    at: np.ndarray  # where the ray was stopped, mm
    view: np.ndarray  # to the viewer
    true_at: np.ndarray
    true: oracle.Bend
    facing: np.ndarray
    on_face: np.ndarray  # of the grid
    inner: np.ndarray  # on the body, more than two voxels inside the grid: as far as the spline reaches
    clear: np.ndarray  # inner, and not grazed by the ray

    def __getitem__(self, name: str) -> np.ndarray:
        return getattr(self.gb, name)[self.hit].astype(np.float64)


@cache
def seen(body: str, grid: str = "even", projection: str = "orthographic", dtype: str = "float32") -> Seen:
    shape, matrix = BODIES[body], GRIDS[grid]
    volume = oracle.sampled(shape.field, SHAPE, matrix, dtype)
    camera = Camera.looking(VIEWS.get(body, (1, 2, 3)), volume, 112, projection=projection)
    gb = isosurface(volume, 128.0 if dtype == "uint8" else 0.0, camera)
    room = oracle.inside_grid(SHAPE, matrix)

    y, x = np.indices(gb.depth.shape).reshape(2, -1)
    origin, direction = oracle.rays(camera, x + 0.5, y + 0.5)
    depth = camera.project(volume.corners)[:, 2]
    t = oracle.march(lambda p: np.minimum(shape.field(p), room(p)), origin, direction, depth.min(), depth.max(), 0.25)
    rendered, there = gb.mask.ravel(), np.isfinite(t)
    both = rendered & there
    y, x, origin, direction, t = y[both], x[both], origin[both], direction[both], t[both]
    true_at = origin + t[:, None] * direction
    true = shape.bend(true_at)
    view = -direction / np.linalg.norm(direction, axis=1, keepdims=True)
    facing = (true.normal * view).sum(axis=1)
    on_face = np.abs(shape.field(true_at)) > 1e-6
    inner = ~on_face & (room(true_at) > 2.0)
    return Seen(
        gb=gb,
        hit=(y, x),
        missed=float((rendered != there).mean()),
        at=origin + gb.depth[y, x].astype(np.float64)[:, None] * direction,
        view=view,
        true_at=true_at,
        true=true,
        facing=facing,
        on_face=on_face,
        inner=inner,
        clear=inner & (facing > 0.1),
    )


def degrees(a, b):
    """Angles between unit vectors (n, 3)."""
    return np.degrees(2 * np.arcsin(np.clip(np.linalg.norm(a - b, axis=-1) / 2, 0, 1)))


@each_projection
@each_grid
@each_body
def test_hits_lie_on_the_surface(body, grid, projection):
    s = seen(body, grid, projection)
    voxel = COARSEST[grid]
    assert s.inner.sum() > 150
    # Rays that graze: what they hit is a matter of less than a hundredth of a voxel.
    assert s.missed < 0.005
    off = np.linalg.norm(s.at - s.true_at, axis=1) * s.facing
    # The fourth order of a tube of radius 6 is up to 0.0007 voxel; a field with less bend is nearer.
    assert off[s.clear].max() < 1e-3 * voxel
    # A grazing ray finds the trilinear surface, which lies up to 1/50 voxel inside, and may stay there.
    assert np.abs(BODIES[body].field(s.at[s.inner])).max() < 0.02 * voxel


@each_projection
@each_grid
@each_body
def test_depth_and_pixel_are_those_of_project(body, grid, projection):
    s = seen(body, grid, projection)
    x, y, depth = s.gb.camera.project(s.true_at[s.clear]).T
    row, column = (i[s.clear] for i in s.hit)
    np.testing.assert_allclose(x, column + 0.5, atol=1e-6)
    np.testing.assert_allclose(y, row + 0.5, atol=1e-6)
    # As near as the hit, seen at an angle.
    assert (np.abs(s["depth"][s.clear] - depth) * s.facing[s.clear]).max() < 1e-3 * COARSEST[grid]


@each_projection
@each_grid
@each_body
def test_normals_are_those_of_the_surface(body, grid, projection):
    s = seen(body, grid, projection)
    # The spline smooths derivatives: an error of h² / 6 times how the bend changes, most on the torus.
    assert degrees(s["normal"], s.true.normal)[s.clear].max() < 0.5 * COARSEST[grid] ** 2
    np.testing.assert_allclose(np.linalg.norm(s["normal"], axis=1), 1, atol=1e-6)


@each_projection
@each_grid
@each_body
def test_curvatures_are_those_of_the_surface(body, grid, projection):
    s = seen(body, grid, projection)
    sharpest = np.abs(s.true.curvature[s.clear]).max()
    # As for normals; 1 % on the even grid for a radius of six voxels.
    error = np.abs(s["curvature"] - s.true.curvature)[s.clear].max() / sharpest
    assert error < 0.015 * COARSEST[grid] ** 2
    assert (s["curvature"][:, 0] >= s["curvature"][:, 1]).all()


def test_curvature_is_positive_on_convex_negative_in_hollow_and_mixed_on_saddles():
    k1, k2 = {}, {}
    for body in BODIES:
        s = seen(body)
        k1[body], k2[body] = s["curvature"][s.clear].T
    assert k2["sphere"].min() > 0
    assert k1["cylinder"].min() > 0.9 * np.abs(k2["cylinder"]).max()
    assert k1["saddle"].min() > 0 > k2["saddle"].max()
    assert k2["cavity"].max() < -0.08
    assert np.abs(k1["cavity"]).max() < 0.001
    assert k1["torus"].min() > 0
    assert k2["torus"].min() < -0.05 < 0.05 < k2["torus"].max()


@each_projection
@each_grid
@each_body
def test_directions_are_those_of_the_larger_curvature_and_tangent(body, grid, projection):
    s = seen(body, grid, projection)
    direction = s["direction"]
    # float32 roundings of unit vectors.
    np.testing.assert_allclose(np.linalg.norm(direction, axis=1), 1, atol=1e-6)
    assert np.abs((direction * s["normal"]).sum(axis=1)).max() < 1e-6
    if body == "sphere":
        return  # any direction is right
    k1, k2 = s.true.curvature[s.clear].T
    plain = np.zeros(len(s.clear), dtype=bool)
    plain[s.clear] = k1 - k2 > 0.2 / 12
    assert plain.sum() > 80
    ahead = np.sign((direction * s.true.direction).sum(axis=1))
    # The error of the shape operator, 1.5 % of the largest curvature, turns its axes by error / (k1 - k2).
    assert degrees(direction * ahead[:, None], s.true.direction)[plain].max() < 1.5 * COARSEST[grid] ** 2


def test_k1_of_a_cylinder_runs_around_and_of_a_torus_round_its_tube():
    s = seen("cylinder")
    axis = np.array([1, 1, 3]) / np.sqrt(11)
    # A tenth of a degree.
    assert np.abs(s["direction"][s.clear] @ axis).max() < 0.0018
    s = seen("torus")
    out = s.true_at * (1, 1, 0)
    along = np.cross((0, 0, 1), out / np.linalg.norm(out, axis=1, keepdims=True))
    assert np.abs((s["direction"] * along).sum(axis=1)[s.clear]).max() < 0.01


@each_projection
@each_body
def test_view_curvature_is_eulers(body, projection):
    s = seen(body, "oblique", projection)
    expected = oracle.euler(s["curvature"], s["direction"], s["normal"], s.view)
    # float32 buffers; face on the direction is lost in rounding, but does not matter to what is drawn.
    askew = s.facing < 0.999
    np.testing.assert_allclose(s["view_curvature"][askew], expected[askew], atol=1e-5)
    k1, k2 = s["curvature"].T
    assert (s["view_curvature"] < k1 + 1e-6).all()
    assert (s["view_curvature"] > k2 - 1e-6).all()


def test_grids_of_any_direction_and_spacing_show_the_same_surface():
    def bumpy(p):
        x, y, z = np.moveaxis(p, -1, 0)
        return 13.0 - np.sqrt(x * x + 1.4 * y * y + z * z) + np.sin(x / 5 + y / 7) + np.cos(z / 6 - y / 5)

    camera = Camera.looking((3, 1, 2), GRIDS["even"][:3, :3] * 30 - 15, 90)
    even, *others = (isosurface(oracle.sampled(bumpy, SHAPE, matrix), 0.0, camera) for matrix in GRIDS.values())
    for other in others:
        both = even.mask & other.mask & (even.facing > 0.1)
        assert both.sum() > 1500
        assert (even.mask ^ other.mask).mean() < 0.003
        # Bends of 1 / 8 mm seen through voxels up to 1.3 mm: the same orders as against closed forms.
        assert degrees(even.normal, other.normal)[both].max() < 1.0
        assert np.abs(even.curvature - other.curvature)[both].max() < 0.05 * np.abs(even.curvature[both]).max()
        assert np.abs((even.depth[both] - other.depth[both]) * even.facing[both]).max() < 5e-3


@pytest.mark.parametrize(("dtype", "half_step"), [("uint8", 0.05), ("int16", 0.005)])
@each_projection
@pytest.mark.parametrize("body", ["sphere", "torus", "saddle"])
def test_integer_ramps_are_as_good_as_their_steps(body, dtype, half_step, projection):
    """Every voxel is off by up to half a step, in mm; what is made of them is off by that times the sum of the weights."""
    s = seen(body, "even", projection, dtype)
    assert np.abs(BODIES[body].field(s.at[s.clear])).max() < 1.5 * half_step + 1e-3
    # Weights of the slope sum to 1 along each of three axes.
    assert degrees(s["normal"], s.true.normal)[s.clear].max() < np.degrees(np.arctan(np.sqrt(3) * half_step)) + 0.5
    # Weights of second derivatives sum to 4, of mixed ones to 1: a matrix of a norm up to 6; in the mean, far less.
    error = np.abs(s["curvature"] - s.true.curvature)[s.clear]
    assert error.max() < 6 * half_step + 0.002
    assert error.mean() < half_step


def test_below_is_the_mirror_of_above():
    volume = oracle.sampled(BODIES["torus"].field, SHAPE, GRIDS["oblique"])
    mirror = Volume(-volume.array, volume.world_from_index)
    camera = Camera.looking((1, 2, 3), volume, 80)
    above, below = isosurface(volume, 0.5, camera), isosurface(mirror, -0.5, camera, inside="below")
    for name in BUFFERS:
        np.testing.assert_array_equal(getattr(above, name), getattr(below, name), err_msg=name)


@settings(deadline=None, max_examples=15)
@given(st.sampled_from([1e-6, 0.01, 37.0, 1e6]), st.floats(-1, 1))
def test_scale_of_values_does_not_matter(scale, offset):
    volume = oracle.sampled(BODIES["torus"].field, (32, 32, 40))
    camera = Camera.looking((1, 2, 3), volume, 40)
    plain = isosurface(volume, 0.0, camera)
    scaled = isosurface(Volume((volume.array + np.float32(offset)) * scale, volume.world_from_index), offset * scale, camera)
    both = plain.mask & scaled.mask
    assert (plain.mask != scaled.mask).mean() < 0.002
    # Adding the offset rounds voxels to 1e-6.
    assert np.abs((plain.depth[both] - scaled.depth[both]) * plain.facing[both]).max() < 1e-4
    assert degrees(plain.normal, scaled.normal)[both].max() < 0.01


@each_projection
@each_grid
def test_where_the_scan_ends_in_the_body_its_face_is_the_surface(grid, projection):
    index_from_world, last = np.linalg.inv(GRIDS[grid]), np.array(SHAPE[::-1]) - 1.0
    for body in ("cylinder", "saddle", "cavity"):
        s = seen(body, grid, projection)
        index = s.at @ index_from_world[:3, :3].T + index_from_world[:3, 3]
        room = np.stack([index, last - index], axis=2).reshape(-1, 6)
        # Off the rim, where face and body meet, and off the grid's own edges.
        face = s.on_face & (BODIES[body].field(s.true_at) > 0.1) & (np.sort(room, axis=1)[:, 1] > 1e-3)
        # float32 depths of about 100 mm.
        np.testing.assert_allclose(room[face].min(axis=1), 0, atol=1e-4)
        axis, side = np.divmod(room[face].argmin(axis=1), 2)
        outwards = GRIDS[grid][:3, :3].T[axis] * np.where(side == 1, 1, -1)[:, None]
        outwards /= np.linalg.norm(outwards, axis=1, keepdims=True)
        np.testing.assert_allclose(s["normal"][face], outwards, atol=1e-6)
        assert (s["curvature"][face] == 0).all()
        assert face.sum() > 100 or body == "saddle"


@pytest.mark.parametrize("view", ["superior", "inferior", (1, 2, 3), (3, -1, 0.4)])
@pytest.mark.parametrize("iso", [0.1, 0.5, 1 - STEP / 2])
def test_thin_slab_is_not_missed(view, iso):
    """One layer of voxels is above iso for 2 (1 - iso) voxels, at the least a step of the ray."""
    array = np.zeros((30, 40, 40), dtype=np.float32)
    array[13] = 1
    volume = Volume.from_array(array)
    camera = Camera.looking(view, volume, 150)
    gb = isosurface(volume, iso, camera)
    y, x = np.indices(gb.depth.shape).reshape(2, -1)
    origin, direction = oracle.rays(camera, x + 0.5, y + 0.5)
    plane = origin + ((13 - origin[:, 2]) / direction[:, 2])[:, None] * direction
    through = ((plane > 1) & (plane < 38))[:, :2].all(axis=1)
    assert through.sum() > 500
    assert gb.mask.ravel()[through].all()


def random_rays(count: int, shape: tuple[int, int, int], seed: int) -> np.ndarray:
    """Origin and direction (n, 6) in index space, from outside through the grid; some along axes and block faces."""
    rng = np.random.default_rng(seed)
    last = np.array(shape[::-1]) - 1
    through, direction = rng.uniform(0, last, (count, 3)), rng.normal(size=(count, 3))
    straight = rng.random((count, 3)) < 0.3
    direction[straight & (straight.sum(axis=1) < 3)[:, None]] = 0.0
    snapped = rng.random((count, 3)) < 0.2
    through[snapped] = (np.round(through / BLOCK) * BLOCK)[snapped]
    through = np.minimum(through, last)
    direction *= rng.uniform(0.1, 3, (count, 1)) / np.linalg.norm(direction, axis=1, keepdims=True)
    return np.hstack([through - 200 * direction / np.linalg.norm(direction, axis=1, keepdims=True), direction])


def bubbles(shape: tuple[int, int, int] = (35, 29, 41)) -> np.ndarray:
    """A volume in which most blocks are empty and some hold little bodies."""
    rng = np.random.default_rng(5)
    z, y, x = np.indices(shape)
    array = np.full(shape, -5.0)
    for _ in range(9):
        c, r = rng.uniform(0, np.array(shape) - 1), rng.uniform(0.8, 5)
        array = np.maximum(array, r - np.sqrt((z - c[0]) ** 2 + (y - c[1]) ** 2 + (x - c[2]) ** 2))
    return array.astype(np.float32)


def test_skipping_empty_blocks_changes_nothing():
    volume = Volume.from_array(bubbles())
    blocks = surface_blocks(volume, 0.0)
    assert 0.1 < blocks.mean() < 0.6
    every, voxels = frozen(np.ones_like(blocks)), frozen(volume.array)
    hits = 0
    for ray in random_rays(3000, volume.shape, 6):
        skipped = first_hit(voxels, frozen(blocks), 0.0, 1.0, *NO_TOOLS, ray, 0.0)
        assert skipped == first_hit(voxels, every, 0.0, 1.0, *NO_TOOLS, ray, 0.0)
        hits += np.isfinite(skipped[0])
    assert hits > 300


def test_first_hit_is_that_of_fine_marching():
    array = bubbles()
    volume = Volume.from_array(array)
    voxels, blocks = frozen(array), frozen(surface_blocks(volume, 0.0))
    rays = random_rays(800, array.shape, 7)
    room = oracle.inside_grid(volume.shape, np.eye(4))

    def field(p):
        # The ends of a ray that runs in a face of the grid are rounded to one side of it or the other.
        return np.where(room(p) >= -1e-9, oracle.trilinear(array, p), -1.0)

    speed = np.linalg.norm(rays[:, 3:], axis=1)
    unit = rays[:, 3:] / speed[:, None]
    expected = oracle.march(field, rays[:, :3], unit, 100.0, 300.0, 0.05)
    got = np.array([first_hit(voxels, blocks, 0.0, 1.0, *NO_TOOLS, ray, 0.0) for ray in rays])
    found = got[:, 0] * speed
    there = np.isfinite(expected)
    deep = there & (field(rays[:, :3] + (np.where(there, expected, 0) + STEP)[:, None] * unit) > 0)
    assert deep.sum() > 80
    # Bodies that a ray is in for less than a step may be missed, no others.
    np.testing.assert_allclose(found[deep], expected[deep], atol=1e-4)
    assert (found >= expected - 1e-4).all()
    begun_inside = got[:, 1].astype(bool)
    assert (np.abs(room(rays[begun_inside, :3] + found[begun_inside, None] * unit[begun_inside])) < 1e-6).all()


def test_whole_pictures_do_not_depend_on_skipping(monkeypatch):
    volume = Volume.from_array(bubbles())
    camera = Camera.looking((2, 1, 1), volume, 90, projection="perspective")
    skipped = isosurface(volume, 0.0, camera)
    monkeypatch.setattr(
        "intaglio.rendering.isosurface.surface_blocks", lambda *args, **options: np.ones_like(surface_blocks(volume, 0.0))
    )
    for name in BUFFERS:
        np.testing.assert_array_equal(getattr(skipped, name), getattr(isosurface(volume, 0.0, camera), name), err_msg=name)


@pytest.mark.parametrize("shape", [(2, 2, 2), (9, 8, 10), (17, 16, 18), (3, 40, 2)])
@pytest.mark.parametrize("dtype", ["uint8", "float32"])
def test_blocks_hold_the_extremes_of_their_cells(shape, dtype):
    array = np.random.default_rng(0).uniform(0, 250, shape).astype(dtype)
    low, high = min_max_blocks(Volume.from_array(array))
    cells = [-(-(n - 1) // BLOCK) for n in shape]
    assert low.shape == high.shape == tuple(cells)
    for block in np.ndindex(*cells):
        part = array[tuple(slice(b * BLOCK, b * BLOCK + BLOCK + 1) for b in block)]
        assert low[block] == part.min()
        assert high[block] == part.max()


def test_blocks_are_kept_as_long_as_their_volume():
    volume = Volume.from_array(np.random.default_rng(0).random((9, 9, 9)))
    low = min_max_blocks(volume)[0]
    assert min_max_blocks(volume)[0] is low
    gone = weakref.ref(volume)
    del volume
    gc.collect()
    assert gone() is None


def test_corners_of_blocks_enclose_the_surface():
    volume = oracle.sampled(oracle.Sphere(9.0, (8.0, -4.0, 2.0)).field, SHAPE, GRIDS["oblique"])
    corners = surface_corners(volume, surface_blocks(volume, 0.0))
    index = corners @ volume.index_from_world[:3, :3].T + volume.index_from_world[:3, 3]
    np.testing.assert_allclose(index, np.round(index), atol=1e-9)
    around = np.array([8.0, -4.0, 2.0]) + 9.0 * TURN.T
    wanted = np.concatenate([around, 2 * np.array([8.0, -4.0, 2.0]) - around])
    wanted = wanted @ volume.index_from_world[:3, :3].T + volume.index_from_world[:3, 3]
    assert (index.min(axis=0) <= wanted.min(axis=0) + 0.5).all()
    assert (index.max(axis=0) >= wanted.max(axis=0) - 0.5).all()
    # No more than a block beyond it.
    assert (index.min(axis=0) > wanted.min(axis=0) - BLOCK - 1).all()


def test_small_islands_are_left_out_and_the_rest_stays_as_it_is():
    large, small = oracle.Sphere(9.0, (-6.0, 0.0, 0.0)), oracle.Sphere(2.0, (20.0, 18.0, 15.0))
    volume = oracle.sampled(lambda p: np.maximum(large.field(p), small.field(p)), SHAPE)
    alone = oracle.sampled(large.field, SHAPE)
    camera = Camera.looking((1, 2, 3), volume, 90)
    everything, cleaned = (isosurface(volume, 0.0, camera, islands=i) for i in (0.0, 0.05))
    expected = isosurface(alone, 0.0, camera)
    assert everything.mask.sum() > expected.mask.sum() + 10
    for name in BUFFERS:
        np.testing.assert_array_equal(getattr(cleaned, name), getattr(expected, name), err_msg=name)
    # (2 / 9)³ is 0.011.
    np.testing.assert_array_equal(isosurface(volume, 0.0, camera, islands=0.005).mask, everything.mask)


def crossings(gb: GBuffer) -> np.ndarray:
    return places(np.flatnonzero(gb.edge.reshape(-1) >= 0), gb.edge)


def expected_edges(label: np.ndarray) -> np.ndarray:
    """(h, w, 2) where neighbouring pixels show different things."""
    edge = np.zeros((*label.shape, 2), dtype=bool)
    edge[:, :-1, 0] = label[:, 1:] != label[:, :-1]
    edge[:-1, :, 1] = label[1:] != label[:-1]
    return edge


@each_projection
def test_silhouette_of_a_sphere_is_found_within_a_fraction_of_a_pixel(projection):
    ball = oracle.Sphere(20.3, (0.3, 0.2, -0.4))
    volume = oracle.sampled(ball.field, (56, 56, 56))
    camera = Camera.looking((1, 2, 1), volume, 160, projection=projection)
    gb = isosurface(volume, 0.0, camera)

    def outside(x, y):
        """Angle beyond the silhouette, or distance from it, in pixels."""
        origin, direction = oracle.rays(camera, x, y)
        to = np.asarray(ball.centre) - origin
        depth = camera.project([ball.centre])[0, 2]
        across = np.linalg.norm(np.cross(to, direction), axis=1) / np.linalg.norm(direction, axis=1)
        scale = camera.pixel * (depth if projection == "perspective" else 1.0)
        return (across - ball.radius) / scale

    x, y = crossings(gb).T
    # Trilinear samples of a sphere lie up to h² / 4r inside it, 0.012 mm; half of 1/64 pixel from halving; a pixel is 0.4 mm.
    off = outside(x, y)
    assert np.abs(off).max() < 0.06
    assert np.abs(off.mean()) < 0.04
    row, column = np.indices(gb.depth.shape)
    beyond = outside(column.ravel() + 0.5, row.ravel() + 0.5).reshape(gb.depth.shape)
    sure = np.abs(beyond) > 0.06
    np.testing.assert_array_equal(gb.mask[sure], (beyond < 0)[sure])
    np.testing.assert_array_equal(gb.edge >= 0, expected_edges(gb.mask))
    assert ((gb.edge >= 0) == np.isfinite(gb.edge)).all()
    assert np.nanmax(gb.edge) <= 1


def test_the_outline_of_a_sphere_before_another_is_found_too():
    front, back = oracle.Sphere(11.2, (-5.0, 9.0, 3.0)), oracle.Sphere(12.1, (4.0, -10.0, -3.0))
    volume = oracle.sampled(lambda p: np.maximum(front.field(p), back.field(p)), (56, 56, 56))
    camera = Camera.looking("anterior", volume, 130)
    gb = isosurface(volume, 0.0, camera)

    def beyond(ball, at):
        centre = camera.project([ball.centre])[0, :2]
        return np.linalg.norm(at - centre, axis=-1) - ball.radius / camera.pixel

    row, column = np.indices(gb.depth.shape)
    pixels = np.stack([column, row], axis=-1) + 0.5
    label = np.where(beyond(front, pixels) < 0, 1, np.where(beyond(back, pixels) < 0, 2, 0))
    unsure = np.minimum(np.abs(beyond(front, pixels)), np.abs(beyond(back, pixels))) < 0.06
    beside_unsure = np.repeat(ndimage.binary_dilation(unsure)[..., None], 2, axis=2)
    np.testing.assert_array_equal((gb.edge >= 0)[~beside_unsure], expected_edges(label)[~beside_unsure])

    at = crossings(gb)
    off_front, off_back = beyond(front, at), beyond(back, at)
    # As for one sphere.
    assert np.minimum(np.abs(off_front), np.abs(off_back)).max() < 0.06
    inner = (np.abs(off_front) < 0.5) & (off_back < -1)
    assert inner.sum() > 20
    hidden = (np.abs(off_back) < 0.5) & (off_front < -1)
    assert not hidden.any()


def test_there_are_no_edges_on_a_slope():
    """A plane seen nearly edge on falls by several voxels from pixel to pixel, yet it is one surface."""
    volume = oracle.sampled(lambda p: -p[..., 2] - 0.2 * p[..., 0], (40, 60, 60))
    camera = Camera.looking((0.1, 1.0, 0.15), volume, 24)
    gb = isosurface(volume, 0.0, camera)
    both = gb.mask[1:] & gb.mask[:-1] & (gb.normal[1:, :, 2] > 0.9) & (gb.normal[:-1, :, 2] > 0.9)
    fall = np.abs(np.diff(np.where(gb.mask, gb.depth, 0), axis=0))[both]
    assert np.median(fall) > 5
    assert np.isnan(gb.edge[:-1, :, 1][both]).all()


LAMPS = [
    Light(direction=(-0.5, 0.6, 0.7), intensity=0.6),
    Light(kind="point", position=(40, 20, -10), intensity=0.5),
    Light(kind="spot", frame="world", position=(10, 60, 30), direction=(0.1, 0.9, 0.4), cone=16, intensity=0.8),
    Light(frame="world", direction=(0, 0, -1), intensity=0.3),
]


@pytest.mark.parametrize("two_sided", [False, True])
@pytest.mark.parametrize("lamps", [LAMPS[:1], LAMPS[1:2], LAMPS[2:3], LAMPS, []], ids=["sun", "point", "spot", "all", "none"])
@each_projection
def test_light_is_blinn_phong(lamps, two_sided, projection):
    volume = oracle.sampled(BODIES["torus"].field, (32, 44, 44))
    camera = Camera.looking((1, 3, 1), volume, 40, projection=projection)
    material = Material(ambient=0.1, diffuse=0.7, specular=0.4, shininess=17, two_sided=two_sided)
    gb = isosurface(volume, 0.0, camera, lights=lamps, material=material)
    y, x = np.nonzero(gb.mask)
    origin, direction = oracle.rays(camera, x + 0.5, y + 0.5)
    at = origin + gb.depth[y, x, None] * direction
    expected = [
        oracle.blinn_phong(p, n.astype(float) / np.linalg.norm(n), camera, lamps, material)
        for p, n in zip(at, gb.normal[y, x], strict=True)
    ]
    # float32 normals and lamps; the exponent and the spot's soft edge enlarge their rounding some 100 times.
    np.testing.assert_allclose(gb.light[y, x], expected, atol=5e-5)
    if lamps:
        assert gb.light[..., 1].max() > 0.1
    assert (gb.light[~gb.mask] == 0).all()


def test_a_light_from_behind_shows_only_on_two_sided_material():
    volume = oracle.sampled(BODIES["sphere"].field, SHAPE)
    camera = Camera.looking("left", volume, 40)
    behind = [Light(direction=(0, 0, -1))]
    assert isosurface(volume, 0.0, camera, lights=behind).light[..., 1:].max() == 0
    gb = isosurface(volume, 0.0, camera, lights=behind, material=Material(diffuse=0.85, two_sided=True))
    np.testing.assert_allclose(gb.light[..., 1][gb.mask], 0.85 * gb.facing[gb.mask], atol=1e-5)


def test_outside_the_surface_buffers_are_empty():
    gb = seen("torus").gb
    away = ~gb.mask
    assert away.any()
    assert (gb.depth[away] == np.inf).all()
    for name in ("normal", "curvature", "direction", "view_curvature", "light"):
        assert (getattr(gb, name)[away] == 0).all()
        assert np.isfinite(getattr(gb, name)).all()
        assert getattr(gb, name).dtype == np.float32


def test_number_of_threads_changes_nothing(monkeypatch):
    volume = Volume.from_array(bubbles())
    camera = Camera.looking((2, 1, 1), volume, (100, 70))
    pictures = []
    for threads in "12":
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        pictures.append(isosurface(volume, 0.0, camera))
    for name in BUFFERS:
        np.testing.assert_array_equal(*(getattr(gb, name) for gb in pictures))


@pytest.mark.parametrize("dtype", ["uint8", "int16", "uint16", "float32"])
def test_voxels_of_any_number_type_show_the_same(dtype):
    array = np.clip(np.round(20 * BODIES["sphere"].field(np.stack(np.indices((40, 40, 40)), axis=-1) - 19.5) + 30), 0, 127)
    camera = Camera.looking("right", Volume.from_array(array), 30)
    expected, got = (isosurface(Volume.from_array(array.astype(t)), 30.0, camera) for t in ("float64", dtype))
    for name in BUFFERS:
        np.testing.assert_allclose(getattr(got, name), getattr(expected, name), atol=1e-5)


@pytest.mark.parametrize("size", [(1, 1), (1, 30), (30, 1), (2, 2)])
def test_smallest_images_and_volumes(size):
    volume = Volume.from_array(np.arange(8, dtype=np.float32).reshape(2, 2, 2))
    gb = isosurface(volume, 3.5, Camera.looking((1, 1, -1), volume, size))
    assert gb.depth.shape == size[::-1]
    assert gb.edge.shape == (*size[::-1], 2)


def test_a_camera_that_looks_away_sees_nothing():
    volume = oracle.sampled(BODIES["sphere"].field, SHAPE)
    camera = Camera(np.array([0, 200.0, 0]), np.array([0, 1.0, 0]), np.array([0, 0, 1.0]), (20, 20), 2.0)
    assert not isosurface(volume, 0.0, camera).mask.any()


CUBE = np.arange(27, dtype=np.float32).reshape(3, 3, 3)


@pytest.mark.parametrize(
    ("array", "iso", "options", "message"),
    [
        (np.full((4, 4, 4), 5, np.uint8), 5.0, {}, "scan: every voxel is 5, so it has no surface"),
        (CUBE, 26.5, {}, r"scan: iso must be within the volume's values, above 0 up to 26, not 26\.5"),
        (CUBE, 0.0, {}, "above 0 up to 26, not 0"),
        (CUBE, -3.0, {}, "above 0 up to 26, not -3"),
        (CUBE, np.nan, {}, "above 0 up to 26, not nan"),
        (CUBE, np.inf, {}, "above 0 up to 26, not inf"),
        (np.where(CUBE == 4, np.nan, CUBE), 5.0, {}, "scan: voxels are NaN or infinite"),
        (np.where(CUBE == 4, np.inf, CUBE), 5.0, {}, "scan: voxels are NaN or infinite"),
        (CUBE, 5.0, {"inside": "outside"}, "inside must be above or below, not 'outside'"),
    ],
)
def test_what_has_no_surface_is_refused(array, iso, options, message):
    volume = Volume.from_array(array, name="scan")
    with pytest.raises(InputError, match=message):
        isosurface(volume, iso, Camera.looking("left", volume, 8), **options)


@each_projection
def test_a_camera_inside_the_volume_is_refused(projection):
    volume = oracle.sampled(BODIES["sphere"].field, SHAPE, GRIDS["oblique"])
    camera = Camera(np.array([20.0, 0, 0]), np.array([1.0, 0, 0]), np.array([0, 0, 1.0]), (8, 8), 0.1, projection)
    with pytest.raises(InputError, match="the camera is inside the volume; move it out"):
        isosurface(volume, 0.0, camera)
