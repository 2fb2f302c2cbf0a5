"""Unions, intersections, differences, offsets, shells and morphs against closed forms."""

from __future__ import annotations

import math

import numpy as np
import oracle
import pytest

import intaglio as ig

A, B = np.array([31.0, 30.0, 29.0]), np.array([44.0, 33.0, 31.0])
RA, RB = 18.0, 12.0


def grid(n: int, spacing: float = 1.0, origin=(0.0, 0.0, 0.0), turn: float = 0.0) -> ig.Volume:
    c, s = math.cos(turn), math.sin(turn)
    pose = np.eye(4)
    pose[:3, :3] = [[c, -s, 0], [s, c, 0], [0, 0, 1]]
    pose[:3, 3] = origin
    return ig.Volume(np.zeros((n, n, n), dtype=np.float32), pose @ np.diag([spacing, spacing, spacing, 1.0]))


def on(volume: ig.Volume, distance) -> ig.Volume:
    return ig.Volume(distance(oracle.positions(volume)).astype(np.float32), volume.world_from_index)


def ball_a(p):
    return oracle.ball(p, A, RA)


def ball_b(p):
    return oracle.ball(p, B, RB)


@pytest.fixture(scope="module")
def a():
    return on(grid(64), ball_a)


@pytest.fixture(scope="module")
def b():
    """Another spacing, turned, and its grid reaches beyond a's."""
    c, s = math.cos(0.5), math.sin(0.5)
    volume = on(grid(72, 0.7, B - 24.9 * np.array([c - s, s + c, 1.0]), 0.5), ball_b)
    assert min(volume.array[[0, -1]].min(), volume.array[:, [0, -1]].min(), volume.array[:, :, [0, -1]].min()) > 12
    return volume


FORMS = {
    "union": lambda p: np.minimum(ball_a(p), ball_b(p)),
    "intersection": lambda p: np.maximum(ball_a(p), ball_b(p)),
    "difference": lambda p: np.maximum(ball_a(p), -ball_b(p)),
}


@pytest.mark.parametrize("name", FORMS)
def test_balls_on_grids_of_different_pose(name, a, b):
    result = getattr(ig, name)(a, b)
    true = FORMS[name](oracle.positions(result))
    near = np.abs(true) < 3
    assert near.sum() > 5000
    # Linear interpolation of a ball's distance: an eighth of the squared spacing over the radius, in three directions.
    assert np.abs(result.array - true)[near].max() < 2 * 0.7**2 / (8 * (RB - 3.7))
    # Outside of its own grid a ball is never said to be farther away than it is.
    assert (ig.union(a, b).array < FORMS["union"](oracle.positions(ig.union(a, b))) + 0.02)[ig.union(a, b).array > 0].all()


def test_unions_cover_what_they_unite():
    small = on(grid(40, 1.0, (20.0, 20.0, 20.0)), lambda p: oracle.ball(p, (40, 40, 40), 12))
    far = on(grid(40, 0.5, (60.0, 40.0, 40.0)), lambda p: oracle.ball(p, (70, 50, 50), 7))
    both = ig.union(small, far)
    assert np.allclose((both.index_from_world @ small.world_from_index)[:3, :3], np.eye(3))
    mesh = ig.surface(both)
    assert mesh.report.components == 2
    assert mesh.corners.max(axis=0) == pytest.approx([77, 57, 57], abs=0.1)
    assert ig.difference(small, far).shape == small.shape
    assert ig.union(small, far, like=far).shape == far.shape


def test_one_grid_is_left_as_it_is(a):
    other = on(a, ball_b)
    assert np.array_equal(ig.union(a, other).array, np.minimum(a.array, other.array))
    assert np.array_equal(ig.intersection(a, other).array, np.maximum(a.array, other.array))
    assert np.array_equal(ig.difference(a, other).array, np.maximum(a.array, -other.array))
    assert np.array_equal(a.array, on(a, ball_a).array)


def test_of_many_the_order_does_not_matter(a, b):
    third = on(a, lambda p: oracle.box(p, (20, 20, 20), (9, 8, 7)))
    assert np.array_equal(ig.union(a, third, b).array, ig.union(a, b, third).array)
    assert np.array_equal(ig.difference(a, third, b).array, ig.difference(a, ig.union(third, b, like=a)).array)
    assert np.array_equal(ig.union(a).array, a.array)


def test_smooth_seams_round_edges_and_leave_the_rest(a):
    wall = on(a, lambda p: oracle.box(p, (31, 30, 0), (25, 25, 20)))
    post = on(a, lambda p: np.hypot(p[..., 0] - 31, p[..., 1] - 30) - 8)
    sharp, smooth = ig.union(wall, post).array, ig.union(wall, post, smooth=6.0).array
    assert np.array_equal(smooth, ig.union(post, wall, smooth=6.0).array)
    far = np.abs(wall.array - post.array) >= 6
    assert np.array_equal(smooth[far], sharp[far])
    assert (smooth <= sharp).all()
    assert (sharp - smooth).max() == pytest.approx(6 / 4, abs=0.05)
    assert (ig.difference(wall, post, smooth=4.0).array >= ig.difference(wall, post).array).all()
    assert (ig.intersection(wall, post, smooth=4.0).array >= ig.intersection(wall, post).array).all()


def test_a_body_ends_where_its_grid_ends():
    cut = on(grid(20), lambda p: oracle.ball(p, (19.0, 10.0, 10.0), 6.0))
    wide = on(grid(40, 1.0, (-5.0, -5.0, -5.0)), lambda p: oracle.ball(p, (0.0, 0.0, 0.0), 4.0))
    mesh = ig.surface(ig.union(wide, cut))
    half = mesh.vertices[np.linalg.norm(mesh.vertices - (19, 10, 10), axis=1) < 8]
    assert half[:, 0].max() == pytest.approx(19.0, abs=0.01)
    assert half[:, 0].min() == pytest.approx(13.0, abs=0.1)


def test_offsets_and_shells(a):
    grown = ig.offset(a, 3.0)
    assert np.allclose(grown.array, oracle.ball(oracle.positions(a), A, RA + 3), atol=1e-5)
    wall = ig.shell(a, 2.0)
    radius = np.linalg.norm(oracle.positions(a) - A, axis=-1)
    assert np.array_equal(wall.array < 0, np.abs(radius - RA) < 1 - 1e-6)
    assert ig.surface(wall).report.components == 2


def test_morphs_go_from_one_to_the_other(a, b):
    assert np.allclose(ig.morph(a, b, 0.0).array[:64, :64, :64].min(), a.array.min())
    for t in (0.0, 0.3, 1.0):
        mixed = ig.morph(a, b, t)
        mesh = ig.surface(mixed)
        # Where the fields are |p - a| - ra, the mix is an ellipsoid of these foci at t = 1/2; on the axis:
        middle = mesh.corners.mean(axis=0)
        assert (np.abs(middle - ((1 - t) * A + t * B)) < 4).all()
    ends = ig.surface(ig.morph(a, b, 1.0)).corners
    assert ends.max(axis=0) == pytest.approx(B + RB, abs=0.05)


def test_bad_input_is_refused(a):
    scan = ig.Volume.from_array(np.zeros((5, 5, 5), dtype=np.int16))
    for call in (lambda: ig.union(a, scan), lambda: ig.offset(scan, 1), lambda: ig.shell(scan, 1), lambda: ig.morph(scan, a, 0)):
        with pytest.raises(ig.InputError, match="must hold signed distances in floats, not int16; make one with signed_distance"):
            call()
    for smooth in (-1.0, math.nan, math.inf):
        with pytest.raises(ig.InputError, match="smooth must be a length in mm"):
            ig.union(a, a, smooth=smooth)
    with pytest.raises(ig.InputError, match="t must be 0 to 1, not "):
        ig.morph(a, a, 1.5)
    with pytest.raises(ig.InputError, match="mm must be a finite length"):
        ig.offset(a, math.nan)
    with pytest.raises(ig.InputError, match="thickness must be"):
        ig.shell(a, 0)
    broken = a.array.copy()
    broken[3, 3, 3] = np.nan
    with pytest.raises(ig.InputError, match="must be finite"):
        ig.union(ig.Volume(broken, a.world_from_index))
