"""Hidden lines and halos: strokes end where a surface in front begins, and a gap beside lines that pass in front."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import GBuffer
from intaglio.drawing import Dots, Layer, Stroke, Strokes
from intaglio.ink.contours import occluding_contours
from intaglio.ink.visibility import clearance, hide, surround, unhidden, visible

MM = 0.25


def half(depth: float, until: float, size: tuple[int, int] = (40, 60)) -> GBuffer:
    """A sheet left of x = until, in pixels; nothing right of it."""
    gb = oracle.sheet(size, depth=depth)
    first = int(np.floor(until - 0.5))
    gb.depth[:, first + 1 :] = np.inf
    gb.edge[:, first, 0] = until - 0.5 - first
    return gb


def line(*points: tuple[float, float], width: float = 0.2) -> Strokes:
    """A stroke through points in pixels, a point about every half pixel."""
    corners = np.array(points, dtype=np.float64)
    steps = [np.linspace(a, b, 2 * int(np.abs(b - a).max()) + 2) for a, b in pairwise(corners)]
    place = np.concatenate(steps).astype(np.float32) * np.float32(MM)
    ones = np.ones(len(place), dtype=np.float32)
    return Strokes.of([Stroke(place, width * ones, 0.7 * ones)])


def seen(strokes: Strokes, free: np.ndarray, **options: float) -> Strokes:
    return visible(Layer("line", strokes), free, MM, **options).strokes


@settings(deadline=None, max_examples=40)
@given(st.floats(5.0, 50.0), st.floats(3.0, 37.0))
def test_a_stroke_ends_where_an_opaque_sheet_begins(until, y):
    back = oracle.sheet((40, 60), depth=100.0)
    free = clearance(back)
    hide(free, back, half(50.0, until))
    (stroke,) = seen(line((2, y), (58, y)), free)
    left, right = stroke.points[:, 0].min() / MM, stroke.points[:, 0].max() / MM
    assert left == pytest.approx(until, abs=0.02)
    assert right == pytest.approx(58)
    assert (stroke.width == np.float32(0.2)).all()


def test_what_is_in_front_or_level_is_not_hidden():
    for depth in (100.0, 100.4, 150.0):
        back = oracle.sheet((40, 60), depth=100.0)
        free = clearance(back)
        hide(free, back, half(depth, 30.0))
        strokes = line((2, 20), (58, 20))
        assert seen(strokes, free).points.tolist() == strokes.points.tolist()


def test_sheets_that_pass_through_each_other_hide_up_to_the_crossing():
    back, front = oracle.sheet((40, 60), depth=100.0), oracle.sheet((40, 60), depth=100.0)
    front.depth[:] = 100.0 + 1.7 * (np.arange(60) + 0.5 - 33.3)
    free = clearance(back)
    hide(free, back, front)
    (stroke,) = seen(line((2, 20), (58, 20)), free)
    # A pixel's side in depth counts as level.
    assert stroke.points[:, 0].min() / MM == pytest.approx(33.3 - 0.5 / 1.7, abs=0.05)


def test_a_body_keeps_its_own_contour_before_another():
    """A contour lies half off its surface; what is behind there must not hide it."""
    front, back = half(50.0, 30.2), oracle.sheet((40, 60), depth=100.0)
    free = clearance(front)
    hide(free, front, back)
    contour = line((30.2, 2), (30.2, 38))
    assert seen(contour, free).points.tolist() == contour.points.tolist()


@pytest.mark.parametrize("gap", [0.3, 0.5, 1.0])
@pytest.mark.parametrize("slant", [0.0, 7.0])
def test_halos_are_as_wide_as_asked(gap, slant):
    back, front = oracle.sheet((40, 60), depth=100.0), oracle.sheet((40, 60), depth=50.0)
    over = line((30 - slant, 1), (30 + slant, 39))
    free = clearance(back)
    surround(free, back, front, over, MM, gap)
    strokes = seen(line((2, 20.3), (58, 20.3)), free)
    assert len(strokes) == 2
    distance = oracle.distance_to_line(strokes.points, over.points)
    assert distance.min() == pytest.approx(0.1 + gap, abs=0.2 * MM)
    # In front of the line nothing is left out.
    free = clearance(front)
    surround(free, front, back, over, MM, gap)
    assert np.isinf(free).all()


def test_halos_agree_with_the_distance_to_the_line():
    rng = np.random.default_rng(3)
    back, front = oracle.sheet((40, 60), depth=100.0), oracle.sheet((40, 60), depth=50.0)
    over = line(*rng.uniform((0, 0), (60, 40), (6, 2)).tolist())
    free = clearance(back)
    surround(free, back, front, over, MM, 0.5)
    y, x = np.indices((40, 60))
    places = np.stack([x.ravel() + 0.5, y.ravel() + 0.5], axis=1)
    expected = oracle.distance_to_line(places, over.points / MM).reshape(40, 60) - (0.1 + 0.5) / MM
    near = expected < 1.5
    assert free[near] == pytest.approx(expected[near], abs=1e-3)


def test_scraps_go_and_dots_are_hidden_whole():
    back = oracle.sheet((40, 60), depth=100.0)
    free = clearance(back)
    hide(free, back, half(50.0, 30.0))
    assert len(seen(line((2, 20), (32, 20)), free, shortest=0.6)) == 0
    assert len(seen(line((2, 20), (32, 20)), free, shortest=0.4)) == 1
    x = np.array([20.0, 29.8, 30.2, 50.0])
    points = (np.stack([x, np.full(4, 20.0)], axis=1) * MM).astype(np.float32)
    dots = Dots(points, np.full(4, 2.5, np.float32), np.ones(4, np.float32))
    assert visible(Layer("dots", dots=dots), free, MM).dots.points[:, 0] == pytest.approx([30.2 * MM, 50 * MM])


def test_nothing_to_hide_is_nothing_changed():
    back = oracle.sheet((40, 60))
    layer = Layer("line", line((2, 20), (58, 20)))
    assert visible(layer, clearance(back), MM) is layer
    none = Layer("none")
    free = clearance(back)
    hide(free, back, half(10.0, 30.0))
    surround(free, back, half(10.0, 30.0), Strokes.none(), MM, 0.5)
    assert len(visible(none, free, MM).strokes) == 0
    empty = GBuffer.empty(back.camera)
    free = clearance(empty)
    hide(free, empty, back)
    hide(free, back, empty)


def test_contours_are_those_in_sight():
    """Before a wall, a post is outlined whole, and the edge of what stands behind the wall does not join it."""
    post, wall = oracle.sheet((40, 60), depth=40.0), oracle.sheet((40, 60), depth=60.0)
    post.depth[:, 30:] = 100.0  # the same body goes on farther away, behind the wall,
    post.depth[:20, 30:] = np.inf  # and ends there
    label = np.zeros((40, 60), dtype=int)
    label[:, 30:] = 1
    label[:20, 30:] = 2
    oracle.mark_edges(post, label)
    assert unhidden(post, []) is post
    seen_ = unhidden(post, [wall])
    assert (seen_.edge[:, 29, 0] == 0.5).all()
    assert np.isnan(seen_.edge[:, 30:]).all()
    assert np.isnan(unhidden(wall, [post]).edge).all()
    assert len(occluding_contours(post)) == 2
    assert len(occluding_contours(seen_)) == 1
