"""Outlines: what they cover is what the strokes cover, and nothing else."""

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from numpy.typing import NDArray

from intaglio import InputError
from intaglio.drawing import Layer, Stroke, Strokes
from intaglio.io.outline import STEP, UNIT, layer_paths
from intaglio.io.simplify import simplified, stroke_nodes

Points = NDArray[np.float64]


def layer_of(points, width=0.4, opacity=1.0) -> Layer:
    points = np.asarray(points, dtype=np.float32)
    along = [np.broadcast_to(np.asarray(v, dtype=np.float32), len(points)) for v in (width, opacity)]
    return Layer("pen", Strokes.of([Stroke(points, *along)]))


def polygons(layer: Layer) -> list[Points]:
    paths = layer_paths(layer, lines=False)
    return [paths.points[i:j] * UNIT for i, j in pairwise(paths.offsets)]


def winding(polygon: Points, at: Points) -> NDArray[np.int64]:
    """How often a polygon turns around each point."""
    a, b = polygon[None], np.roll(polygon, -1, axis=0)[None]
    x, y = at[:, None, 0], at[:, None, 1]
    left = (b[..., 0] - a[..., 0]) * (y - a[..., 1]) - (x - a[..., 0]) * (b[..., 1] - a[..., 1])
    up = (a[..., 1] <= y) & (b[..., 1] > y) & (left > 0)
    down = (a[..., 1] > y) & (b[..., 1] <= y) & (left < 0)
    return up.sum(axis=1) - down.sum(axis=1)


def covered(layer: Layer, at: Points) -> NDArray[np.bool_]:
    return np.any([winding(p, at) != 0 for p in polygons(layer)], axis=0)


def area(polygon: Points) -> float:
    x, y = polygon.T
    return abs(float(x @ np.roll(y, -1) - y @ np.roll(x, -1))) / 2


def distance(points: Points, at: Points) -> NDArray[np.float64]:
    """From each place to the polyline."""
    a, d = points[None, :-1], np.diff(points, axis=0)[None]
    t = ((at[:, None] - a) * d).sum(axis=2) / np.maximum((d**2).sum(axis=2), 1e-30)
    return np.linalg.norm(at[:, None] - a - np.clip(t, 0, 1)[..., None] * d, axis=2).min(axis=1)


@st.composite
def strokes(draw: st.DrawFn) -> Layer:
    """Anything from a straight line to a knot with repeated points."""
    n = draw(st.integers(2, 12))
    seed = draw(st.integers(0, 2**32 - 1))
    rng = np.random.default_rng(seed)
    step = draw(st.sampled_from([0.0, 0.05, 0.5, 5.0]))
    angle = np.cumsum(rng.normal(0, draw(st.sampled_from([0.1, 1.0, 3.0])), n))
    points = np.cumsum(step * rng.uniform(0, 1, (n, 1)) * np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0) + 20
    points[rng.uniform(size=n) < draw(st.sampled_from([0.0, 0.3]))] = points[0]
    width = rng.uniform(0.2, draw(st.sampled_from([0.2, 1.0, 4.0])), n)
    opacity = draw(st.sampled_from([1.0, 0.5])) * np.where(rng.uniform(size=n) < 0.5, 1.0, rng.uniform(0.1, 1, n))
    return layer_of(points, width, opacity)


@given(strokes())
@settings(deadline=None)
def test_every_point_of_the_axis_is_covered(layer):
    points = layer.strokes.points.astype(np.float64)
    t = np.linspace(0, 1, 7)[:, None]
    axis = np.concatenate([a + t * (b - a) for a, b in pairwise(points)])
    assert covered(layer, axis).all()


@given(strokes(), st.integers(0, 2**32 - 1))
@settings(deadline=None)
def test_nothing_beyond_the_stroke_is_covered(layer, seed):
    points = layer.strokes.points.astype(np.float64)
    reach = layer.strokes.width.max() / 2
    at = np.random.default_rng(seed).uniform(points.min(axis=0) - 3 * reach, points.max(axis=0) + 3 * reach, (200, 2))
    # A bend below 60 degrees may be mitred: 1 / cos(30 degrees) = 1.155.
    outside = distance(points, at) > 1.155 * reach + 0.03
    assert not covered(layer, at)[outside].any()


@given(strokes())
@settings(deadline=None)
def test_nothing_inside_a_thick_stroke_cancels(layer):
    """The nonzero rule leaves no holes where a bend is tighter than the stroke is wide."""
    points = layer.strokes.points.astype(np.float64)
    layer = layer_of(points, 2.0, 1.0)
    at = np.random.default_rng(0).uniform(points.min(axis=0) - 1, points.max(axis=0) + 1, (200, 2))
    assert covered(layer, at)[distance(points, at) < 0.97].all()


def test_straight_stroke_has_the_area_of_a_stadium():
    (polygon,) = polygons(layer_of([[1, 1], [11, 1]], 0.8))
    assert area(polygon) == pytest.approx(10 * 0.8 + np.pi * 0.4**2, rel=0.01)


def test_taper_ends_in_a_point():
    (polygon,) = polygons(layer_of([[0, 0], [5, 0], [10, 0]], [0, 0.5, 0]))
    assert polygon[:, 0].min() == 0
    assert polygon[:, 0].max() == 10
    assert len(polygon) == 4
    assert area(polygon) == pytest.approx(2.5, rel=0.01)


def test_dab_of_the_pen_is_a_disc():
    (polygon,) = polygons(layer_of([[5, 5], [5, 5], [5, 5]], [0.2, 1.0, 0.2]))
    assert area(polygon) == pytest.approx(np.pi * 0.25, rel=0.04)


def test_pieces_share_the_stroke_and_follow_its_opacity():
    layer = layer_of([[0, 0], [4, 0], [10, 0]], 0.5, [0.2, 0.2, 0.8])
    paths = layer_paths(layer)
    assert 9 <= len(paths) <= 11
    total = sum(area(p) * o for p, o in zip(polygons(layer), paths.opacity, strict=True))
    assert total == pytest.approx(0.5 * (4 * 0.2 + 6 * 0.5) + np.pi * 0.25**2 / 2 * (0.2 + 0.8), rel=0.02)


def test_even_opacity_is_one_piece():
    wobble = 0.5 + 0.49 * STEP * np.sin(np.arange(50))
    assert len(layer_paths(layer_of(np.stack([np.arange(50), np.zeros(50)], axis=1), 0.4, wobble))) == 1


def test_even_width_is_a_line():
    layer = layer_of([[0, 0], [4, 1], [10, 0]], [0.5, 0.505, 0.5])
    paths = layer_paths(layer)
    np.testing.assert_allclose(paths.width, [0.502], atol=0.002)
    np.testing.assert_array_equal(paths.points * UNIT, [[0, 0], [4, 1], [10, 0]])
    assert layer_paths(layer, lines=False).width[0] == 0


def test_invisible_strokes_are_left_out():
    assert len(layer_paths(layer_of([[0, 0], [4, 1]], 0.5, 0.0))) == 0
    assert len(layer_paths(layer_of([[0, 0], [4, 1]], 0.0))) == 0
    assert len(layer_paths(Layer("none"))) == 0


@given(st.integers(0, 2**32 - 1), st.sampled_from([0.01, 0.1]))
@settings(deadline=None)
def test_simplified_stroke_stays_within_tolerance(seed, tolerance):
    rng = np.random.default_rng(seed)
    n = 80
    points = np.cumsum(np.cumsum(rng.normal(0, 0.02, (n, 2)), axis=0), axis=0)
    layer = layer_of(points, 0.5 + 0.4 * np.sin(np.arange(n) / 9))
    nodes = stroke_nodes(layer)
    fewer, offsets = simplified(nodes, layer.strokes.offsets, tolerance)
    assert offsets.tolist() == [0, len(fewer)]
    assert len(fewer) < n
    np.testing.assert_array_equal(fewer[[0, -1]], nodes[[0, -1]])
    assert distance(fewer[:, :2], nodes[:, :2]).max() <= tolerance * 1.001


def test_long_strokes_simplify():
    """A spiral of a hundred thousand points: the recursion must not be as deep."""
    t = np.linspace(0, 300, 100_000)
    layer = layer_of(np.stack([t * np.cos(t), t * np.sin(t)], axis=1) * 0.1 + 40)
    assert 1000 < len(simplified(stroke_nodes(layer), layer.strokes.offsets, 0.01)[0]) < 20_000


@pytest.mark.parametrize("what", ["points", "width", "opacity"])
@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf, -2e5])
def test_what_cannot_be_drawn_is_named(what, value):
    layer = layer_of([[0, 0], [1, 1]])
    values = {name: getattr(layer.strokes, name).copy() for name in ("points", "width", "opacity")}
    values[what][0] = value
    with pytest.raises(InputError, match="strokes of layer 'pen' must have"):
        layer_paths(Layer("pen", Strokes(**values, offsets=layer.strokes.offsets)))
