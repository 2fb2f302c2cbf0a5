"""Pre-integrated tables: closed forms, composition, and a slow integral with many steps."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import example, given, settings, strategies as st

from intaglio import InputError, TransferFunction
from intaglio.rendering.preintegration import preintegrated_table

RED, BLUE = (1.0, 0.0, 0.0), (0.0, 0.0, 1.0)
anything = settings(deadline=None, max_examples=40)

unit = st.floats(0, 1)
colours = st.tuples(unit, unit, unit)
# Opacity 1 is a pole of extinction: it has tests of its own.
opacities = st.one_of(st.just(0.0), st.floats(0, 0.9))
functions = st.builds(
    lambda points, kind, length: TransferFunction.from_points(
        sorted((i / 16, c, a) for i, (c, a) in points.items()), interpolation=kind, reference_length=length
    ),
    st.dictionaries(st.integers(-8, 24), st.tuples(colours, opacities), min_size=1, max_size=8),
    st.sampled_from(["linear", "constant"]),
    st.sampled_from([1.0, 3.0]),
)
steps = st.sampled_from([0.1, 1.0, 3.0])


def integrated(tf: TransferFunction, front: float, back: float, step: float, parts: int = 10_000) -> np.ndarray:
    """Emission and absorption along a piece, in float64, by the middle of many parts; values away from steps."""
    s = front + (back - front) * (np.arange(parts) + 0.5) / parts
    x, rgba = tf.knots
    r, g, b, a = (np.interp(s, x, rgba[:, c]) for c in range(4))
    depth = -np.log1p(-a) * step / parts / tf.reference_length
    through = np.exp(-np.concatenate([[0.0], np.cumsum(depth)]))
    weight = through[:-1] - through[1:]
    return np.array([weight @ r, weight @ g, weight @ b, 1 - through[-1]])


def test_a_constant_function_is_a_homogeneous_medium():
    tf = TransferFunction.from_points([(0, (0.2, 0.6, 1.0), 0.3)], reference_length=2.0)
    alpha = 1 - 0.7 ** (5.0 / 2.0)
    expected = np.array([0.2 * alpha, 0.6 * alpha, alpha, alpha])
    np.testing.assert_allclose(preintegrated_table(tf, -1, 1, 16, step=5.0), np.broadcast_to(expected, (16, 16, 4)), rtol=2e-7)


def test_the_nearer_side_of_a_step_hides_the_other():
    tf = TransferFunction.from_points([(0, RED, 0.5), (0.25, BLUE, 0.5)], interpolation="constant")
    table = preintegrated_table(tf, 0, 1, 5, step=4.0)
    red, blue = 1 - 0.5**1.0, 1 - 0.5**3.0
    np.testing.assert_allclose(table[0, 4], [red, 0, 0.5**1.0 * blue, 1 - 0.5**4], rtol=1e-6)
    np.testing.assert_allclose(table[4, 0], [0.5**3.0 * red, 0, blue, 1 - 0.5**4], rtol=1e-6)


@pytest.mark.parametrize("box", [(0.25, 0.75), (0.3, 0.31), (0.501, 0.5011)])
def test_a_box_counts_by_the_part_of_the_way_inside_however_narrow(box):
    low, high = box
    points = [(low, RED, 0.0), (low, RED, 0.9), (high, RED, 0.9), (high, RED, 0.0)]
    table = preintegrated_table(TransferFunction.from_points(points), 0, 1, 33, step=3.0).astype(np.float64)
    s = np.linspace(0, 1, 33)
    front, back = np.meshgrid(s, s, indexing="ij")
    inside = np.clip(np.maximum(front, back), low, high) - np.clip(np.minimum(front, back), low, high)
    apart = front != back
    part = inside[apart] / np.abs(front - back)[apart]
    np.testing.assert_allclose(table[apart][:, 3], 1 - 0.1 ** (3.0 * part), atol=1e-6)
    np.testing.assert_allclose(table[apart][:, 0], table[apart][:, 3], atol=1e-6)


@pytest.mark.parametrize("top", [1e-9, 0.3, 0.999, 1.0])
def test_a_ramp_of_opacity_has_its_mean_extinction(top):
    tf = TransferFunction.from_points([(0, RED, 0.0), (1, RED, top)])
    # Integral of -ln(1 - top t) over t from 0 to 1.
    mean = 1 + (1 - top) / top * math.log1p(-top) if top < 1 else 1.0
    mean = top / 2 if top < 1e-6 else mean
    for size in (2, 3, 50):
        got = preintegrated_table(tf, 0, 1, size, step=0.7)[0, -1, 3]
        np.testing.assert_allclose(got, -math.expm1(-0.7 * mean), rtol=1e-6, atol=1e-14)


@pytest.mark.parametrize("step", [0.01, 1.0, 100.0])
def test_what_is_opaque_stays_so_at_any_step(step):
    tf = TransferFunction.from_points([(0, RED, 0.0), (0.5, RED, 0.0), (0.5, BLUE, 1.0), (1, BLUE, 1.0)])
    table = preintegrated_table(tf, 0, 1, 9, step=step)
    np.testing.assert_array_equal(table[:4, 5:], np.broadcast_to(np.float32([0, 0, 1, 1]), (4, 4, 4)))
    np.testing.assert_array_equal(table[:4, :4], 0.0)


@anything
@given(functions, st.sampled_from([2, 9, 33]), steps, st.data())
def test_agrees_with_ten_thousand_small_steps(tf, size, step, data):
    table = preintegrated_table(tf, 0, 1, size, step=step)
    values = np.linspace(0, 1, size)
    for _ in range(4):
        i, j = data.draw(st.permutations(range(size)))[:2]
        # The slow one misplaces each jump of opacity by half of one of its parts: 3.5e-4 of optical depth.
        np.testing.assert_allclose(table[i, j], integrated(tf, values[i], values[j], step), atol=1e-3)


@anything
@given(functions, st.integers(2, 24), steps)
def test_is_a_premultiplied_colour_and_equally_opaque_both_ways(tf, size, step):
    table = preintegrated_table(tf, 0, 1, size, step=step)
    assert table.shape == (size, size, 4)
    assert table.dtype == np.float32
    assert (table >= 0).all()
    assert (table[..., :3] <= table[..., 3:] + 1e-6).all()
    assert (table[..., 3] <= 1).all()
    np.testing.assert_array_equal(table[..., 3], table[..., 3].T)


@anything
@given(functions, colours, steps)
def test_one_colour_is_the_same_both_ways(tf, colour, step):
    plain = TransferFunction.from_points([(p.value, colour, p.opacity) for p in tf.points], interpolation=tf.interpolation)
    table = preintegrated_table(plain, 0, 1, 17, step=step)
    np.testing.assert_allclose(table[..., :3], table[..., 3:] * np.float32(colour), atol=2e-7)


@anything
@given(functions, st.integers(2, 24), steps)
def test_equal_ends_are_post_classification(tf, size, step):
    table = preintegrated_table(tf, 0, 1, size, step=step)
    plain = tf.table(0, 1, size, step=step)
    np.testing.assert_array_equal(table[range(size), range(size), 3], plain[:, 3])
    np.testing.assert_array_equal(table[range(size), range(size), :3], plain[:, :3] * plain[:, 3:])


@anything
@given(functions)
def test_a_longer_piece_is_no_clearer(tf):
    short, middle, long = (preintegrated_table(tf, 0, 1, 17, step=step)[..., 3] for step in (0.5, 0.6, 4.0))
    assert (short <= middle + 1e-7).all()
    assert (middle <= long + 1e-7).all()


@anything
@given(functions, steps)
@example(TransferFunction.from_points([(0, RED, 0), (0.5, BLUE, 0.9), (1, RED, 0)]), 1.0)
def test_two_halves_one_over_the_other_are_the_whole(tf, step):
    whole = preintegrated_table(tf, 0, 1, 17, step=2 * step).astype(np.float64)
    half = preintegrated_table(tf, 0, 1, 17, step=step).astype(np.float64)
    for i, k in [(0, 16), (16, 0), (3, 9), (12, 2)]:
        j = (i + k) // 2
        over = half[i, j] + (1 - half[i, j, 3]) * half[j, k]
        np.testing.assert_allclose(over, whole[i, k], atol=1e-6)


def test_a_peak_between_two_samples_is_seen():
    spike = TransferFunction.from_points([(0.5001, RED, 0.0), (0.5002, RED, 0.99), (0.5003, RED, 0.0)])
    assert spike.table(0, 1, 256)[:, 3].max() == 0.0
    table = preintegrated_table(spike, 0, 1, 256, step=1.0)
    assert table[127, 128, 3] > 0.02
    assert table[10, 100, 3] == 0.0


def test_threads_do_not_change_it(monkeypatch):
    tf = TransferFunction.preset("ct-tissues")
    tables = []
    for threads in ("1", "3"):
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        tables.append(preintegrated_table(tf, -1000, 2000, 64, step=0.5))
    np.testing.assert_array_equal(*tables)


@pytest.mark.parametrize(
    ("low", "high", "size", "step"),
    [(1e15, 1e15 + 0.5, 64, 1.0), (-1e300, 1e300, 5, 1.0), (0, 5e-324, 4, 1.0), (0, 1, 8, 1e300), (0, 1, 8, 1e-300)],
)
def test_extremes_stay_numbers(low, high, size, step):
    tf = TransferFunction.from_points([(0, RED, 0.0), (0.5, BLUE, 0.7), (2, RED, 1.0)], reference_length=1e-200)
    table = preintegrated_table(tf, low, high, size, step=step)
    assert np.isfinite(table).all()
    assert (table >= 0).all()
    assert (table <= 1).all()


@pytest.mark.parametrize(
    ("arguments", "message"),
    [
        ({"low": 1, "high": 0}, "from 1 to 0"),
        ({"low": 0, "high": math.nan}, "to nan"),
        ({"low": 0, "high": 1, "size": 1}, "size must be 2 or more, not 1"),
        ({"low": 0, "high": 1, "step": 0.0}, "step must be a positive"),
        ({"low": 0, "high": 1, "step": math.inf}, "step must be a positive"),
    ],
)
def test_refuses_bad_arguments(arguments, message):
    with pytest.raises(InputError, match=message):
        preintegrated_table(TransferFunction.preset("ct-bone"), **{"step": 1.0, **arguments})
