"""Occluding contours as lines, and the contour image."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import Camera, GBuffer, isosurface
from intaglio.ink.contours import Contours, chains, contour_image, occluding_contours, places


def disks(size: tuple[int, int], *parts: tuple[float, float, float, float]) -> GBuffer:
    """Flat disks (x, y, radius, depth) in pixels and mm, as a picture (height, width) with exact edges."""

    def depth(x, y):
        d = np.full(np.shape(x), np.inf)
        for cx, cy, r, z in parts:
            d = np.where((np.hypot(x - cx, y - cy) < r) & (z < d), z, d)
        return d

    gb = oracle.sheet(size)
    y, x = np.indices(size) + 0.5
    gb.depth[:] = depth(x, y)
    for side in (0, 1):
        dx, dy = 1 - side, side
        x0, y0 = x[: size[0] - dy, : size[1] - dx], y[: size[0] - dy, : size[1] - dx]
        here, there = depth(x0, y0), depth(x0 + dx, y0 + dy)
        low, high = np.zeros_like(x0), np.ones_like(x0)
        for _ in range(25):
            m = (low + high) / 2
            same = depth(x0 + m * dx, y0 + m * dy) == here
            low, high = np.where(same, m, low), np.where(same, high, m)
        gb.edge[: size[0] - dy, : size[1] - dx, side] = np.where(here != there, low, np.nan)
    return gb


def split(contours: Contours) -> list[np.ndarray]:
    return [contours.points[a:b].astype(float) for a, b in zip(contours.offsets[:-1], contours.offsets[1:], strict=True)]


def length(line) -> float:
    return float(np.linalg.norm(np.diff(line, axis=0), axis=1).sum())


def is_closed(line) -> bool:
    return len(line) > 2 and (line[0] == line[-1]).all()


@settings(deadline=None, max_examples=40)
@given(st.floats(5, 40), st.floats(-0.5, 0.5), st.floats(-0.5, 0.5))
def test_a_disk_has_one_closed_contour_of_the_right_length(radius, dx, dy):
    gb = disks((100, 110), (55 + dx, 50 + dy, radius, 80.0))
    (line,) = split(occluding_contours(gb))
    assert is_closed(line)
    # A polygon with a corner every pixel row and column is at most (1 / r)² / 24 shorter.
    assert length(line) == pytest.approx(2 * np.pi * radius, rel=0.005)
    np.testing.assert_allclose(np.hypot(*(line - (55 + dx, 50 + dy)).T), radius, atol=1e-4)


def test_every_crossing_is_in_one_line_once():
    gb = disks((90, 120), (40, 45, 25, 100.0), (62, 40, 20, 60.0), (95, 70, 12, 80.0), (5, 5, 20, 90.0))
    order, offsets = chains(gb.edge, gb.depth)
    parts = np.split(order, offsets[1:-1])
    once = np.concatenate([p[:-1] if len(p) > 2 and p[0] == p[-1] else p for p in parts])
    np.testing.assert_array_equal(np.sort(once), np.flatnonzero(gb.edge.reshape(-1) >= 0))


def test_neighbours_on_a_line_are_within_a_pixel_square():
    gb = disks((90, 120), (40, 45, 25, 100.0), (62, 40, 20, 60.0), (95, 70, 12, 80.0))
    for line in split(occluding_contours(gb)):
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).max() <= np.sqrt(2) + 1e-5


def test_the_outline_of_two_disks_is_whole_and_the_front_ends_on_it():
    back, front = np.array((45.0, 50.0)), np.array((75.0, 47.0))
    r, s = 30.0, 22.0
    gb = disks((100, 120), (*back, r, 130.0), (*front, s, 70.0))
    contours = occluding_contours(gb)
    outline, inner = sorted(split(contours), key=is_closed, reverse=True)
    assert is_closed(outline)
    assert not is_closed(inner)

    # Half angles of the chord in which the circles meet.
    d = np.linalg.norm(front - back)
    a, b = np.arccos((d * d + r * r - s * s) / (2 * d * r)), np.arccos((d * d + s * s - r * r) / (2 * d * s))
    assert length(outline) == pytest.approx(2 * (np.pi - a) * r + 2 * (np.pi - b) * s, rel=0.005)
    # The ends lie in the squares beside those of the outline.
    assert length(inner) == pytest.approx(2 * b * s, abs=3.0)
    np.testing.assert_allclose(np.hypot(*(inner - front).T), s, atol=1e-4)
    along = np.arctan2(*(front - back)[::-1])
    meet = back + r * np.array([(np.cos(along + t), np.sin(along + t)) for t in (a, -a)])
    for end in (inner[0], inner[-1]):
        assert np.linalg.norm(meet - end, axis=1).min() < 2.0


def test_a_contour_that_ends_behind_another_does_not_turn_into_it():
    """No background: the farther disk's contour meets the nearer one's, which goes on."""
    gb = disks((100, 120), (60, 50, 200, 300.0), (45, 50, 28, 200.0), (70, 50, 20, 70.0))
    front, behind = sorted(split(occluding_contours(gb)), key=is_closed, reverse=True)
    assert is_closed(front)
    np.testing.assert_allclose(np.hypot(*(front - (70, 50)).T), 20, atol=1e-4)
    np.testing.assert_allclose(np.hypot(*(behind - (45, 50)).T), 28, atol=1e-4)


@pytest.mark.parametrize("gap", [2.0, 3.0])
@pytest.mark.parametrize("degrees", [0, 20, 45, 70])
def test_objects_some_pixels_apart_are_not_connected(gap, degrees):
    step = np.array([np.cos(np.radians(degrees)), np.sin(np.radians(degrees))]) * (30.0 + gap)
    for other_depth in (80.0, 81.0, 200.0):
        centres = [(35.0, 35.0), (35 + step[0], 35 + step[1]), (35 + 2 * step[0], 35 + 2 * step[1])]
        gb = disks((120, 120), *((*c, 15.0, z) for c, z in zip(centres, (80.0, other_depth, 80.0), strict=True)))
        lines = split(occluding_contours(gb))
        assert len(lines) == 3
        for line in lines:
            assert is_closed(line)
            off = [np.abs(np.hypot(*(line - c).T) - 15).max() for c in centres]
            assert min(off) < 1e-4


def test_a_contour_ends_where_the_picture_ends():
    gb = disks((60, 80), (0.0, 30.0, 20.0, 80.0))
    (line,) = split(occluding_contours(gb))
    assert not is_closed(line)
    assert length(line) == pytest.approx(np.pi * 20, abs=1.5)
    assert line[[0, -1], 0].max() < 1.0


def test_jump_and_light_are_those_of_the_near_surface():
    gb = disks((80, 100), (40, 40, 25, 130.0), (60, 40, 20, 70.0))
    y, x = np.indices(gb.depth.shape)
    gb.light[..., 1] = np.where(gb.depth == 70.0, 0.2, 0.9)
    contours = occluding_contours(gb)
    on_front = np.abs(np.hypot(*(contours.points - (60, 40)).T) - 20) < 1e-3
    inner = on_front & (np.hypot(*(contours.points - (40, 40)).T) < 24)
    np.testing.assert_allclose(contours.jump[inner], 60.0)
    assert (contours.jump[~on_front] == np.inf).all()
    np.testing.assert_allclose(contours.light[on_front], 0.2, atol=1e-6)
    np.testing.assert_allclose(contours.light[~on_front], 0.9, atol=1e-6)


def test_places_are_on_the_way_between_pixel_centres():
    edge = np.full((4, 5, 2), np.nan, dtype=np.float32)
    edge[2, 3] = 0.25, 0.75
    order = np.flatnonzero(edge.reshape(-1) >= 0)
    np.testing.assert_allclose(places(order, edge), [(3.75, 2.5), (3.5, 3.25)])


def test_no_surface_no_contour():
    for gb in (GBuffer.empty(oracle.sheet((7, 5)).camera), oracle.sheet((7, 5)), oracle.sheet((1, 1))):
        contours = occluding_contours(gb)
        assert len(contours) == 0
        assert contours.points.shape == (0, 2)
        assert not contour_image(gb).any()


def test_one_pixel_alone_has_a_closed_contour():
    gb = oracle.sheet((5, 5))
    gb.depth[:] = np.inf
    gb.depth[2, 2] = 50.0
    oracle.mark_edges(gb, np.isfinite(gb.depth))
    (line,) = split(occluding_contours(gb))
    assert is_closed(line)
    assert len(line) == 5


@settings(deadline=None, max_examples=60)
@given(st.integers(1, 12), st.integers(1, 12), st.integers(1, 4), st.integers(0, 10**6))
def test_any_picture_has_contours(h, w, count, seed):
    rng = np.random.default_rng(seed)
    gb = oracle.sheet((h, w))
    gb.depth[:] = np.array([np.inf, 40.0, 60.0, 90.0])[rng.integers(0, count, (h, w))]
    oracle.mark_edges(gb, gb.depth)
    order, offsets = chains(gb.edge, gb.depth)
    assert len(np.unique(order)) == (gb.edge >= 0).sum()
    assert offsets[-1] == len(order)
    contours = occluding_contours(gb)
    assert np.isfinite(contours.points).all()
    assert (contours.jump > 0).all()
    for line in split(contours):
        assert np.linalg.norm(np.diff(line, axis=0), axis=1).max(initial=0) <= np.sqrt(2)


@pytest.mark.parametrize("thickness", [1.5, 4.0])
@pytest.mark.parametrize("radius", [6.0, 12.0, 20.0])
def test_contour_image_of_a_sphere_is_as_wide_as_asked(radius, thickness):
    volume = oracle.sampled(oracle.Sphere(radius).field, (48, 48, 48))
    gb = isosurface(volume, 0.0, Camera.looking((1, 2, 3), volume, 240))
    image = contour_image(gb, thickness)
    assert image.dtype == np.float32
    assert set(np.unique(image)) == {0.0, 1.0}
    # In parallel projection the bound is exact for a sphere: the ring from r - thickness to r.
    h, w = image.shape
    y, x = np.indices(image.shape)
    inwards = radius / gb.camera.pixel - np.hypot(x + 0.5 - w / 2, y + 0.5 - h / 2)
    # A pixel is a third of a voxel; the silhouette lies up to h² / 4r, an eighth of a pixel, inside.
    slack = 0.15
    assert image[(inwards > slack) & (inwards < thickness - slack)].all()
    assert not image[(inwards < 0) | (inwards > thickness + slack)].any()


def test_contour_image_is_as_wide_in_perspective_on_near_and_far_spheres():
    near, far = oracle.Sphere(9.0, (-12.0, 15.0, 0.0)), oracle.Sphere(9.0, (12.0, -15.0, 0.0))
    volume = oracle.sampled(lambda p: np.maximum(near.field(p), far.field(p)), (30, 60, 56))
    camera = Camera.looking("anterior", volume, 220, projection="perspective", fov=50)
    image = contour_image(isosurface(volume, 0.0, camera), 3.0)
    for ball in (near, far):
        cx, cy, depth = camera.project([ball.centre])[0]
        y, x = np.nonzero(image)
        here = np.hypot(x + 0.5 - cx, y + 0.5 - cy) < 1.5 * ball.radius / (camera.pixel * depth)
        outline = 2 * np.pi * ball.radius / (camera.pixel * depth)
        # A sphere beside the middle of the picture is drawn out, and T is taken at the pixel's own depth.
        assert here.sum() / outline == pytest.approx(3.0, rel=0.2)


def test_contour_image_does_not_blacken_what_is_flat():
    gb = oracle.sheet((20, 20))
    tilt = np.radians(89)
    gb.normal[:] = (np.sin(tilt), np.cos(tilt), 0)
    assert not contour_image(gb, 3.0).any()
    gb = oracle.sheet((20, 20))
    gb.normal[:] = (np.sin(tilt), np.cos(tilt), 0)
    gb.view_curvature[:] = 0.3
    assert contour_image(gb, 3.0).all()
