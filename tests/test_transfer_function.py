"""TransferFunction: interpolation, tables, presets and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import InputError, TransferFunction
from intaglio.transfer_function import corrected_opacity

RAMP = [(0.0, "#000000", 0.0), (10.0, "#ff8000", 0.5), (20.0, "#ffffff", 1.0)]

unit = st.floats(0, 1)
finite = st.floats(-1e6, 1e6)
points_by_value = st.lists(
    st.tuples(finite, st.tuples(unit, unit, unit), unit), min_size=1, max_size=12, unique_by=lambda p: p[0]
)
anything = settings(deadline=None, max_examples=60)


def test_linear_between_points_and_held_outside():
    tf = TransferFunction.from_points(RAMP)
    np.testing.assert_allclose(tf(5.0), [0.5, 64 / 255, 0.0, 0.25], rtol=1e-6)
    np.testing.assert_array_equal(tf([-1e9, -np.inf]), tf([0.0, 0.0]))
    np.testing.assert_array_equal(tf([1e9, np.inf]), tf([20.0, 20.0]))


def test_linear_step_takes_the_later_point_at_the_value_itself():
    tf = TransferFunction.from_points([(0, "#000000", 0.0), (5, "#000000", 0.0), (5, "#ffffff", 1.0), (9, "#ffffff", 1.0)])
    np.testing.assert_array_equal(tf([np.nextafter(5, 0), 5.0])[:, 3], [0.0, 1.0])


def test_constant_holds_each_point_up_to_the_next():
    tf = TransferFunction.from_points(RAMP, interpolation="constant")
    np.testing.assert_array_equal(tf([-5, 0, 9.99, 10, 19.99, 20, 99])[:, 3], np.float32([0, 0, 0, 0.5, 0.5, 1, 1]))


def test_keeps_the_shape_and_makes_nan_nothing():
    tf = TransferFunction.from_points([(0, "#ffffff", 1.0)])
    result = tf(np.array([[0, np.nan, 3]]))
    assert result.shape == (1, 3, 4)
    assert result.dtype == np.float32
    np.testing.assert_array_equal(result[0, 1], 0.0)
    assert tf(np.zeros((0, 2), dtype=np.int16)).shape == (0, 2, 4)


def test_integer_voxels_and_floats_agree():
    tf = TransferFunction.preset("ct-bone")
    values = np.array([-1024, 150, 300, 3071], dtype=np.int16)
    np.testing.assert_array_equal(tf(values), tf(values.astype(np.float64)))


def test_table_samples_both_ends():
    tf = TransferFunction.from_points(RAMP)
    table = tf.table(-5, 25, size=7)
    assert table.shape == (7, 4)
    assert table.dtype == np.float32
    np.testing.assert_array_equal(table, tf([-5, 0, 5, 10, 15, 20, 25]))


def test_opacity_correction_composes():
    # Two steps of half the reference length let through what one step of it does.
    alpha = np.float32([0.0, 0.1, 0.5, 0.99, 1.0])
    half = corrected_opacity(alpha, 0.5, 1.0)
    np.testing.assert_allclose(1 - (1 - half) ** 2, alpha, atol=1e-6)
    np.testing.assert_array_equal(corrected_opacity(alpha, 2.0, 2.0), alpha)


def test_table_corrects_opacity_and_leaves_colour():
    tf = TransferFunction.from_points(RAMP, reference_length=2.0)
    plain, corrected = tf.table(0, 20, 5), tf.table(0, 20, 5, step=1.0)
    np.testing.assert_array_equal(plain[:, :3], corrected[:, :3])
    np.testing.assert_allclose(corrected[:, 3], 1 - np.sqrt(1 - plain[:, 3]), atol=1e-6)


def test_window_runs_over_its_width():
    tf = TransferFunction.window(40, 400)
    np.testing.assert_allclose(tf([-1000, -160, 40, 240, 3000])[:, 0], [0, 0, 0.5, 1, 1], atol=1e-6)
    np.testing.assert_allclose(tf([-160, 40, 240])[:, 3], [0, 0.5, 1], atol=1e-6)
    three = TransferFunction.window(0, 2, colours=["#ff0000", "#00ff00", (0, 0, 1)], opacities=(0.2, 0.2))
    np.testing.assert_allclose(three([-1, 0, 1]), np.float32([[1, 0, 0, 0.2], [0, 1, 0, 0.2], [0, 0, 1, 0.2]]))


@pytest.mark.parametrize("name", TransferFunction.presets())
def test_presets_show_something_and_leave_air_out(name):
    tf = TransferFunction.preset(name, range=(0, 4095))
    low, high = tf.points[0].value, tf.points[-1].value
    assert tf(low)[3] == 0.0
    assert tf.table(low, high)[:, 3].max() > 0.8
    assert tf.name == name


def test_mr_presets_follow_the_range_and_ct_presets_do_not():
    near, far = (TransferFunction.preset("mr-default", range=(0, high)) for high in (100, 1000))
    np.testing.assert_allclose(near(45), far(450), rtol=1e-6)
    assert TransferFunction.preset("ct-bone", range=(0, 1)) == TransferFunction.preset("ct-bone")


def test_ct_presets_tell_tissues_apart():
    air, fat, muscle, bone = -1000.0, -80.0, 50.0, 900.0
    assert TransferFunction.preset("ct-skin")(fat)[3] > 0.8
    assert TransferFunction.preset("ct-bone")([air, fat, muscle])[:, 3].max() == 0.0
    assert TransferFunction.preset("ct-bone")(bone)[3] > 0.8
    assert TransferFunction.preset("ct-muscle")(muscle)[3] > 5 * TransferFunction.preset("ct-muscle")(fat)[3]


def test_equal_points_are_equal_and_hashable():
    a, b = TransferFunction.from_points(RAMP), TransferFunction.from_points([list(p) for p in RAMP])
    assert a == b
    assert hash(a) == hash(b)


@anything
@given(points_by_value, st.lists(finite, max_size=20), st.sampled_from(["linear", "constant"]))
def test_stays_between_its_points(points, values, interpolation):
    tf = TransferFunction.from_points(sorted(points), interpolation=interpolation)
    at_points = tf([p.value for p in tf.points])
    np.testing.assert_array_equal(at_points, np.float32([(*p.colour, p.opacity) for p in tf.points]))
    result = tf(values)
    assert (result >= at_points.min(axis=0)).all()
    assert (result <= at_points.max(axis=0)).all()


@anything
@given(points_by_value, st.lists(finite, max_size=20))
def test_linear_is_numpys_interp(points, values):
    tf = TransferFunction.from_points(sorted(points))
    expected = np.interp(values, [p.value for p in tf.points], [p.opacity for p in tf.points])
    np.testing.assert_allclose(tf(values)[:, 3], expected, atol=1e-6)


@pytest.mark.parametrize(
    ("points", "message"),
    [
        ([], "at least one"),
        ([(1, "#000000", 0), (0, "#000000", 0)], "sorted by value, not 1 before 0"),
        ([(math.nan, "#000000", 0)], "value must be finite, not nan"),
        ([(math.inf, "#000000", 0)], "value must be finite, not inf"),
        ([(0, "#000000", math.nan)], "opacity must be between 0 and 1, not nan"),
        ([(0, "#000000", 1.5)], "opacity must be between 0 and 1, not 1.5"),
        ([(0, "#000000", -0.1)], "opacity must be between 0 and 1, not -0.1"),
        ([(0, "red", 0.5)], "colour must be \"#rrggbb\", not 'red'"),
        ([(0, (0, 0, 300), 0.5)], "colour must be three numbers between 0 and 1"),
        ([(0, (0, math.nan, 0), 0.5)], "colour must be three numbers between 0 and 1"),
        ([(0, (0, 0), 0.5)], 'colour must be "#rrggbb" or three numbers'),
        ([(0, None, 0.5)], 'colour must be "#rrggbb" or three numbers'),
        ([(0, "#000000")], r"a point must be \(value, colour, opacity\)"),
        ([7], r"a point must be \(value, colour, opacity\)"),
        ([(0, "#000000", 0)] * 3, "at most two points may share a value"),
    ],
)
def test_refuses_bad_points(points, message):
    with pytest.raises(InputError, match=message):
        TransferFunction.from_points(points)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: TransferFunction.from_points(RAMP, interpolation="cubic"), "linear or constant, not 'cubic'"),
        (lambda: TransferFunction.from_points([RAMP[0]] * 2, interpolation="constant"), "must differ in value, not be 0 twice"),
        (lambda: TransferFunction.from_points(RAMP, reference_length=0), "reference_length must be a positive"),
        (lambda: TransferFunction.preset("ct-nothing"), "preset must be one of ct-skin, .*mr-default.*not 'ct-nothing'"),
        (lambda: TransferFunction.preset("mr-default"), "give range="),
        (lambda: TransferFunction.preset("mr-default", range=(3, 3)), "from a smaller to a larger number, not from 3 to 3"),
        (lambda: TransferFunction.window(0, 0), "positive width"),
        (lambda: TransferFunction.window(0, 1, colours=["#000000"]), "two or more, not 1"),
        (lambda: TransferFunction.window(0, 1, opacities=(0, 2)), "opacity must be between 0 and 1, not 2"),
        (lambda: TransferFunction.from_points(RAMP).table(1, 0), "from 1 to 0"),
        (lambda: TransferFunction.from_points(RAMP).table(0, math.nan), "to nan"),
        (lambda: TransferFunction.from_points(RAMP).table(0, 1, size=1), "size must be 2 or more, not 1"),
        (lambda: TransferFunction.from_points(RAMP).table(0, 1, step=0), "step must be a positive"),
    ],
)
def test_refuses_bad_arguments(make, message):
    with pytest.raises(InputError, match=message):
        make()
