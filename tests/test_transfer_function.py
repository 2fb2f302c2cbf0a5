"""TransferFunction: interpolation, tables, presets, surfaces, pictures and what it refuses."""

from __future__ import annotations

import math
import re
import xml.etree.ElementTree as ET
from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import InputError, TransferFunction, Volume
from intaglio.transfer_function import OpacityPeak, corrected_opacity

RAMP = [(0.0, "#000000", 0.0), (10.0, "#ff8000", 0.5), (20.0, "#ffffff", 1.0)]

unit = st.floats(0, 1)
finite = st.floats(-1e6, 1e6)
points_by_value = st.lists(
    st.tuples(finite, st.tuples(unit, unit, unit), unit), min_size=1, max_size=12, unique_by=lambda p: p[0]
)
anything = settings(deadline=None, max_examples=60)

# Points on a raster, on which sums are exact, with many zeros and ties.
rough = st.sampled_from([0.0, 0.0, 0.25, 0.5, 1.0])
stepped = st.lists(st.tuples(st.integers(1, 9), rough, st.none() | rough), min_size=1, max_size=8, unique_by=lambda p: p[0])


def of_opacities(*points: tuple[float, float], **options) -> TransferFunction:
    return TransferFunction.from_points([(v, (min(1.0, abs(v) / 100), 0.0, 0.0), a) for v, a in points], **options)


def with_steps(points) -> TransferFunction:
    """Of (value, opacity before, opacity after or None)."""
    pairs = [(float(v), a) for v, before, after in sorted(points) for a in (before, after) if a is not None]
    return of_opacities(*pairs)


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


def test_several_tissues_are_several_surfaces_of_their_colour():
    skin, muscle, bone = TransferFunction.preset("ct-tissues").surfaces()
    assert -600 < skin.threshold < skin.value < 0 <= muscle.threshold < muscle.value < bone.threshold < 400
    assert skin.ceiling <= muscle.threshold
    assert muscle.ceiling <= bone.threshold
    assert bone.ceiling == math.inf
    assert skin.opacity < 0.3
    assert bone.opacity > 0.9
    assert muscle.colour[0] > 2 * muscle.colour[2]


def test_a_preset_comes_to_another_scale_by_landmarks():
    unit_range = TransferFunction.preset("ct-bone").mapped((-1000, -200, 300), (0, 0.2, 0.5))
    air, skin, bone = unit_range([0.0, 0.2, 0.7])
    assert air[3] == skin[3] == 0.0
    assert bone[3] > 0.8


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
        (lambda: of_opacities((-1e308, 0.0), (1e308, 0.0)), "finite distance apart"),
        (lambda: TransferFunction.from_points([(10**400, "#000000", 0.0)]), "a point must be"),
        (lambda: of_opacities((0, 0.0)).mapped((0, 1), (0, 1, 2)), "as many from_values as to_values, not 2 and 3"),
        (lambda: of_opacities((0, 0.0)).mapped((0,), (0,)), "two or more ascending values"),
        (lambda: of_opacities((0, 0.0)).mapped((0, 1), (1, 0)), r"ascending values, not \(1, 0\)"),
        (lambda: of_opacities((0, 0.0)).mapped((0, math.nan), (0, 1)), "ascending values"),
        (lambda: of_opacities((0, 0.0)).mapped((-1e308, 1e308), (0, 1)), "ascending values"),
        (lambda: of_opacities((0, 0.0)).mapped("ab", (0, 1)), "needs numbers, not 'ab'"),
        (lambda: of_opacities((5, 0.0)).mapped((0, 1e-300), (0, 1e300)), "value must be finite"),
        (lambda: of_opacities((0, 0.0)).rescaled(0, 1), "ascending values"),
        (lambda: of_opacities((0, 0.0)).picture(width=20), "120 x 80 pixels or larger, not 20 x 200"),
    ],
)
def test_refuses_bad_arguments(make, message):
    with pytest.raises(InputError, match=message):
        make()


@pytest.mark.parametrize(
    ("points", "peaks"),
    [
        ([(0, 0.0), (10, 1.0), (20, 0.0)], [(10, 1.0, 0, 20)]),
        ([(0, 0.0), (10, 0.5), (20, 0.5), (30, 0.0)], [(10, 0.5, 0, 30)]),
        ([(0, 0.0), (10, 0.0), (20, 0.5), (30, 0.2), (40, 0.2), (50, 0.9)], [(20, 0.5, 10, 30), (50, 0.9, 40, math.inf)]),
        ([(0, 0.5), (10, 0.0)], [(0, 0.5, -math.inf, 10)]),
        ([(0, 0.1), (0, 0.7), (5, 0.7), (5, 0.1)], [(0, 0.7, 0, 5)]),
        ([(0, 0.0), (1, 0.2), (2, 0.4), (3, 0.4), (4, 0.6)], [(4, 0.6, 0, math.inf)]),
        ([(0, 0.0)], []),
        ([(0, 0.3), (10, 0.3)], []),
    ],
)
def test_surfaces_are_local_maxima_with_the_minima_around_them(points, peaks):
    tf = of_opacities(*points)
    assert tf.surfaces() == [OpacityPeak(v, a, (v / 100, 0.0, 0.0), low, high) for v, a, low, high in peaks]


def test_surfaces_of_constants_begin_at_their_points():
    tf = of_opacities((0, 0.0), (10, 0.5), (20, 0.2), (30, 0.9), interpolation="constant")
    assert [(p.value, p.opacity, p.threshold, p.ceiling) for p in tf.surfaces()] == [
        (10, 0.5, 10, 20),
        (30, 0.9, 30, math.inf),
    ]


@anything
@given(stepped)
def test_opacity_rises_to_a_surface_and_falls_after_it(points):
    tf = with_steps(points)
    found = tf.surfaces()
    x, rgba = tf.knots
    for peak in found:
        inside = (x >= peak.threshold) & (x <= peak.ceiling)
        assert peak.threshold <= peak.value <= peak.ceiling
        assert peak.opacity in rgba[inside, 3]
        assert tf(peak.value)[3] <= peak.opacity
    for a, b in pairwise(found):
        assert a.value <= a.ceiling <= b.threshold <= b.value
    # As many as the sign of the slope turns from up to down, the outside counting as down.
    slope = np.diff(rgba[:, 3])
    slope = np.concatenate([[1], np.sign(slope[slope != 0]), [-1]])
    assert len(found) == (np.count_nonzero(np.diff(slope) < 0) if len(slope) > 2 else 0)


@anything
@given(stepped, st.sampled_from(["linear", "constant"]), st.data())
def test_visible_is_whether_any_value_shows(points, interpolation, data):
    tf = with_steps(points) if interpolation == "linear" else of_opacities(*((v, a) for v, a, _ in sorted(points)))
    x = tf.knots[0]
    ends = np.unique([*x, *np.nextafter(x, -99), *np.nextafter(x, 99), *(x[1:] + x[:-1]) / 2, -5.0, 15.0])
    low, high = sorted(data.draw(st.tuples(st.sampled_from(ends.tolist()), st.sampled_from(ends.tolist()))))
    # Between neighbouring ends opacity is linear, so that it is zero throughout or not half-way.
    inside = ends[(ends >= low) & (ends <= high)]
    seen = (tf([*inside, *(inside[1:] + inside[:-1]) / 2])[:, 3] > 0).any()
    assert tf.visible(low, high) == seen
    assert tf.visible(np.full((2, 3), low), np.full((2, 3), high)).tolist() == [[seen] * 3] * 2


def test_visible_sees_a_spike_that_tables_miss_and_judges_voxels_of_any_type():
    spike = of_opacities((500, 0.0), (500.001, 0.5), (500.002, 0.0))
    assert spike.table(0, 1000)[:, 3].max() == 0.0
    low, high = np.array([0, 500, 501, -7]), np.array([500, 501, 900, 2000])
    for dtype in (np.int16, np.float32, np.float64):
        np.testing.assert_array_equal(spike.visible(low.astype(dtype), high.astype(dtype)), [False, True, False, True])
    assert spike.visible(np.float32(500.001), np.float32(500.001)) == (spike(np.float32(500.001))[3] > 0)


def test_blocks_of_nan_may_hold_anything():
    np.testing.assert_array_equal(of_opacities((0, 0.0)).visible([np.nan, 0.0], [np.nan, 1.0]), [True, False])


@anything
@given(
    points_by_value,
    st.sampled_from(["linear", "constant"]),
    st.lists(st.integers(-50, 50), min_size=2, max_size=4, unique=True).map(sorted),
    st.data(),
)
def test_mapped_shows_at_the_new_value_what_showed_at_the_old(points, interpolation, landmarks, data):
    places = [(round(v / 2e4), colour, a) for v, colour, a in points]
    tf = TransferFunction.from_points(sorted({p[0]: p for p in places}.values()), interpolation=interpolation)
    to = data.draw(st.lists(st.integers(0, 64), min_size=len(landmarks), max_size=len(landmarks), unique=True).map(sorted))
    mapped = tf.mapped(landmarks, to)
    values = np.linspace(-60, 60, 241) + 0.01
    slope = np.diff(to) / np.diff(landmarks)
    moved = np.interp(values, landmarks, to)
    moved += np.minimum(values - landmarks[0], 0) * slope[0] + np.maximum(values - landmarks[-1], 0) * slope[-1]
    np.testing.assert_allclose(mapped(moved), tf(values), atol=1e-5)
    assert (mapped.interpolation, mapped.reference_length, mapped.name) == (tf.interpolation, tf.reference_length, tf.name)


def test_rescaled_runs_from_end_to_end():
    tf = TransferFunction.preset("ct-bone").rescaled(0, 1)
    assert (tf.points[0].value, tf.points[-1].value) == (0.0, 1.0)
    np.testing.assert_allclose(tf(100 / 1080), TransferFunction.preset("ct-bone")(220), atol=1e-6)


def drawn(svg: str) -> ET.Element:
    root = ET.fromstring(svg)
    assert not re.search(r"nan|inf", svg)
    assert root.find(".//{*}stop") is not None
    assert all(0 <= float(stop.get("offset")) <= 1 for stop in root.iterfind(".//{*}stop"))
    return root


def test_a_picture_shows_points_colours_and_values():
    tf = TransferFunction.from_points(RAMP, name="a <b> & \x00")
    svg = tf.picture(width=300, height=120)
    root = drawn(svg)
    assert (root.get("width"), root.get("height")) == ("300", "120")
    assert root.find("{*}title").text == "a <b> & "
    circles = root.findall("{*}circle")
    assert [c.get("fill") for c in circles] == ["#000000", "#ff8000", "#ffffff"]
    assert float(circles[0].get("cy")) > float(circles[1].get("cy")) > float(circles[2].get("cy"))
    assert {"0", "1", "10", "20"} <= {t.text for t in root.iterfind(".//{*}text")}
    assert tf._repr_svg_() == tf.picture()


def test_a_picture_holds_the_volume_behind_the_curve():
    array = np.full((40, 50, 60), 100, dtype=np.int16)
    array[:, :, 30:] = 900
    array[0, 0, 0] = -500
    tf = TransferFunction.preset("ct-bone")
    plain, behind = drawn(tf.picture()), drawn(tf.picture(Volume.from_array(array)))
    assert len(behind.findall("{*}path")) > len(plain.findall("{*}path"))
    assert {"-500", "0", "500"} <= {t.text for t in behind.iterfind(".//{*}text")}


@pytest.mark.parametrize("fill", [np.nan, np.inf, 7.0])
def test_a_picture_of_a_volume_without_a_range(fill):
    volume = Volume.from_array(np.full((4, 4, 4), fill, dtype=np.float32))
    drawn(TransferFunction.window(0, 10).picture(volume))


def test_large_volumes_are_sampled():
    volume = Volume.from_array(np.broadcast_to(np.int8(3), (2000, 2000, 2000)))
    drawn(TransferFunction.window(0, 10).picture(volume))


@anything
@given(st.lists(st.tuples(st.floats(-8e307, 8e307), unit), min_size=1, max_size=5, unique_by=lambda p: p[0]))
def test_any_function_can_be_drawn(points):
    drawn(TransferFunction.from_points([(v, "#123456", a) for v, a in sorted(points)]).picture())
