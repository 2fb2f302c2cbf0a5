"""Transfer functions of 3D Slicer and ParaView: round trips, the formats' keys, VTK's curves, bad files."""

from __future__ import annotations

import json
import math
from contextlib import suppress

import numpy as np
import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st

from intaglio import InputError, TransferFunction
from intaglio.io.transfer_functions import SCHEMA
from intaglio.io.vtk_functions import MAX_POINTS

anything = settings(deadline=None, max_examples=60, suppress_health_check=[HealthCheck.function_scoped_fixture])

unit = st.floats(0, 1)
colours = st.tuples(unit, unit, unit)
functions = st.builds(
    lambda points, kind, length, name: TransferFunction.from_points(
        [(i / 64, c, a) for i, sides in sorted(points.items()) for c, a in sides[: 1 if kind == "constant" else 2]],
        interpolation=kind,
        reference_length=length,
        name=name,
    ),
    st.dictionaries(
        st.integers(-(2**40), 2**40), st.lists(st.tuples(colours, unit), min_size=1, max_size=2), min_size=1, max_size=8
    ),
    st.sampled_from(["linear", "constant"]),
    st.floats(1e-3, 1e3),
    st.text(max_size=8),
)
FORMATS = (".vp.json", ".json")


def component(colour=((0, [1, 0, 0]), (1, [0, 0, 1])), opacity=((0, 0.0), (1, 1.0)), **more):
    """A volume property with one component of points (x, y, midpoint, sharpness), the last two optional."""

    def point(key, x, y, *curve):
        return {"x": x, key: y, **dict(zip(("midpoint", "sharpness"), curve, strict=False))}

    return {
        "@schema": SCHEMA,
        "volumeProperties": [
            {
                "components": [
                    {
                        "rgbTransferFunction": {"type": "colorTransferFunction", "points": [point("color", *p) for p in colour]},
                        "scalarOpacity": {"type": "piecewiseLinearFunction", "points": [point("y", *p) for p in opacity]},
                        **more,
                    }
                ]
            }
        ],
    }


def preset(colours=(0, 1, 0, 0, 1, 0, 0, 1), opacities=(0, 0, 0.5, 0, 1, 1, 0.5, 0), **more):
    return {"Name": "a", "ColorSpace": "RGB", "RGBPoints": list(colours), "Points": list(opacities), **more}


@pytest.fixture
def read(tmp_path):
    """Read a document, or text, from a file."""

    def of(content, file="f.json", **options):
        path = tmp_path / file
        path.write_bytes(content if isinstance(content, bytes) else json.dumps(content).encode())
        return TransferFunction.read(path, **options)

    return of


@anything
@given(functions, st.sampled_from(FORMATS))
@example(TransferFunction.from_points([(0, "#000000", 0), (0, "#ffffff", 1)], name="step at zero"), ".vp.json")
@example(TransferFunction.from_points([(1, "#123456", 0.2), (1, "#123456", 0.2)]), ".json")
@example(TransferFunction.from_points([(-1e300, "#000000", 0), (1e300, "#ffffff", 1)]), ".json")
def test_what_was_written_is_read_to_the_last_bit(tmp_path, tf, extension):
    path = tmp_path / f"one{extension}"
    tf.write(path)
    back = TransferFunction.read(path)
    x, rgba = tf.knots
    # A step that changes nothing is one knot.
    fresh = np.concatenate([[True], (np.diff(x) > 0) | (np.diff(rgba, axis=0) != 0).any(axis=1)])
    np.testing.assert_array_equal(back.knots[0], x[fresh])
    np.testing.assert_array_equal(back.knots[1], rgba[fresh])
    assert back.reference_length == tf.reference_length
    values = np.unique([*x, *(x[1:] + x[:-1]) / 2, x[0] - 1, x[-1] + 1])
    np.testing.assert_array_equal(back(values), tf(values))
    assert not list(tmp_path.glob("*.partial"))


@pytest.mark.parametrize("extension", FORMATS)
@pytest.mark.parametrize("name", TransferFunction.presets())
def test_presets_come_back_equal(tmp_path, name, extension):
    tf = TransferFunction.preset(name, range=(0, 4095))
    tf.write(tmp_path / f"{name}{extension}")
    assert TransferFunction.read(tmp_path / f"{name}{extension}") == tf


def test_slicer_finds_every_key_of_its_schema(tmp_path):
    tf = TransferFunction.from_points([(-5, "#ff0000", 0.0), (0, "#ff0000", 0.0), (0, "#0000ff", 0.5)], reference_length=2.0)
    tf.write(tmp_path / "a.vp.json")
    document = json.loads((tmp_path / "a.vp.json").read_text(encoding="utf-8"))
    assert document["@schema"].endswith("/volume-property-schema-v1.0.0.json#")
    (volume_property,) = document["volumeProperties"]
    assert volume_property["effectiveRange"] == [-5.0, 0.0]
    assert volume_property["interpolationType"] in ("nearest", "linear", "cubic")
    (part,) = volume_property["components"]
    assert part["scalarOpacityUnitDistance"] == 2.0
    assert set(part["lighting"]) == {"ambient", "diffuse", "specular", "specularPower"}
    colour, opacity, gradient = (part[key]["points"] for key in ("rgbTransferFunction", "scalarOpacity", "gradientOpacity"))
    assert all(set(point) == {"x", "color", "midpoint", "sharpness"} for point in colour)
    assert all(set(point) == {"x", "y", "midpoint", "sharpness"} for point in opacity + gradient)
    # VTK keeps one point a value, so the step's first is beside it.
    below, at = opacity[1]["x"], opacity[2]["x"]
    assert -1e-300 < below < at == 0.0
    assert [p["y"] for p in opacity] == [0.0, 0.0, 0.5]


def test_paraview_finds_a_list_of_presets(tmp_path):
    TransferFunction.from_points([(0, "#ff0000", 0.0), (4, "#0000ff", 0.5)], name="plate").write(tmp_path / "a.json")
    (document,) = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    assert document["Name"] == "plate"
    assert document["ColorSpace"] == "RGB"
    assert document["RGBPoints"] == [0, 1, 0, 0, 4, 0, 0, 1]
    assert document["Points"] == [0, 0, 0.5, 0, 4, 0.5, 0.5, 0]


def test_the_content_decides_and_the_name_follows_the_file_where_it_has_none(read):
    assert read([preset()], "x.vp.json").name == "a"
    assert read(component(), "x.json").name == read(component(), "x.vp.json").name == "x"
    assert read(preset(Name="bare")).name == "bare"
    assert read(b"\xef\xbb\xbf  " + json.dumps([preset()]).encode()).name == "a"


def test_colours_and_opacities_have_points_of_their_own(read):
    tf = read(component([(0, [1, 0, 0]), (10, [0, 0, 1])], [(5, 0.0), (5, 1.0), (20, 0.5)], scalarOpacityUnitDistance=0.25))
    assert [(p.value, p.opacity) for p in tf.points] == [(0, 0), (5, 0), (5, 1), (10, 1 - 0.5 / 3), (20, 0.5)]
    np.testing.assert_allclose(tf([0, 2.5, 5, 15])[:, :3], [[1, 0, 0], [0.75, 0, 0.25], [0.5, 0, 0.5], [0, 0, 1]])
    assert tf.reference_length == 0.25


def test_three_points_at_a_value_are_a_step_from_the_first_to_the_last(read):
    tf = read(component(opacity=[(0, 0.1), (1, 0.2), (1, 0.9), (1, 0.4), (2, 0.4)]))
    assert [p.opacity for p in tf.points if p.value == 1] == [0.2, 0.4]


def test_points_that_slicer_moved_apart_by_a_rounding_are_a_step(read):
    tf = read(component(opacity=[(0, 0.0), (300, 0.0), (math.nextafter(300, 301), 1.0)]))
    assert len({p.value for p in tf.points if p.value >= 300}) == 1


def test_a_midpoint_is_where_half_the_way_is_gone(read):
    tf = read(component(opacity=[(0, 0.0, 0.25, 0.0), (8, 0.8, 0.5, 0.0), (9, 0.0)]))
    np.testing.assert_allclose(tf([1, 2, 5, 8, 8.5])[:, 3], [0.2, 0.4, 0.6, 0.8, 0.4], atol=1e-6)


@pytest.mark.parametrize("kind", ["opacity", "colour"])
@pytest.mark.parametrize("midpoint", [0.0, 0.3, 0.5, 1.0])
@pytest.mark.parametrize("sharpness", [0.0, 0.02, 0.3, 0.8, 1.0])
def test_sharp_curves_are_those_of_vtk(read, kind, midpoint, sharpness):
    vtk = pytest.importorskip("vtk")
    tf = read(component([(0, [0.2, 0.0, 0.9], midpoint, sharpness), (10, [1, 0, 0])], [(0, 0.2, midpoint, sharpness), (10, 1)]))
    values = np.linspace(-1, 11, 97)
    values = values[np.abs(values - 10 * midpoint) > 0.2] if sharpness == 1 else values
    if kind == "opacity":
        theirs = vtk.vtkPiecewiseFunction()
        theirs.AddPoint(0, 0.2, midpoint, sharpness)
        theirs.AddPoint(10, 1)
        ours, expected = tf(values)[:, 3], [theirs.GetValue(v) for v in values]
    else:
        theirs = vtk.vtkColorTransferFunction()
        theirs.AddRGBPoint(0, 0.2, 0, 0.9, midpoint, sharpness)
        theirs.AddRGBPoint(10, 1, 0, 0)
        ours, expected = tf(values)[:, :3], [theirs.GetColor(v) for v in values]
    np.testing.assert_allclose(ours, expected, atol=0.01)


@pytest.mark.parametrize("wrap", [0, 1])
@pytest.mark.parametrize("space", ["RGB", "HSV", "Lab", "Diverging", "Step"])
@pytest.mark.parametrize(
    ("first", "last"),
    [
        ([0.23, 0.3, 0.75], [0.71, 0.02, 0.15]),
        ([0.9, 0.9, 0.9], [0.2, 0.6, 0.3]),
        ([0.8, 0.5, 0.1], [1, 1, 1]),
        ([0, 0, 0], [1, 0.8, 0.3]),
        ([0.9, 0.1, 0.2], [0.8, 0.2, 0.7]),
    ],
)
def test_colours_are_mixed_as_vtk_does(read, first, last, space, wrap):
    vtk = pytest.importorskip("vtk")
    theirs = vtk.vtkColorTransferFunction()
    getattr(theirs, f"SetColorSpaceTo{space}")()
    theirs.SetHSVWrap(wrap)
    theirs.AddRGBPoint(-2, *first)
    theirs.AddRGBPoint(6, *last)
    tf = read([preset([-2, *first, 6, *last], ColorSpace=space, HSVWrap=wrap)])
    # In whole numbers of our parts there is no difference, between them we are straight.
    values = np.linspace(-2, 6, 33)[1:-1]
    np.testing.assert_allclose(tf(values)[:, :3], [theirs.GetColor(v) for v in values], atol=1e-6)
    values = np.linspace(-3.003, 7, 101)
    np.testing.assert_allclose(tf(values)[:, :3], [theirs.GetColor(v) for v in values], atol=0.03)


def test_vtk_shows_what_we_wrote(tmp_path):
    vtk = pytest.importorskip("vtk")
    tf = TransferFunction.from_points(
        [(0, "#ff0000", 0.1), (100, "#00ff00", 0.5), (300, "#0000ff", 0.9)], interpolation="constant"
    )
    tf.write(tmp_path / "a.json")
    (document,) = json.loads((tmp_path / "a.json").read_text(encoding="utf-8"))
    opacity, colour = vtk.vtkPiecewiseFunction(), vtk.vtkColorTransferFunction()
    for node in np.reshape(document["Points"], (-1, 4)):
        opacity.AddPoint(*node)
    for node in np.reshape(document["RGBPoints"], (-1, 4)):
        colour.AddRGBPoint(*node)
    values = [-5, 0, 99.99, 100, 200, 299.99, 300, 400]
    np.testing.assert_allclose([(*colour.GetColor(v), opacity.GetValue(v)) for v in values], tf(values), atol=1e-6)


def test_the_older_text_of_slicer(read):
    text = b"1\n1\n0.9\n0.1\n0.2\n10\n6 -100 0 50.5 0.25 200 0.8\n4 0 1 255 1\n8 -100 1 0 0 200 0 0 1\n"
    tf = read(text, "bone.vp")
    assert tf.name == "bone"
    assert [(p.value, p.opacity) for p in tf.points] == [(-100, 0.0), (50.5, 0.25), (200, 0.8)]
    np.testing.assert_allclose(tf(50)[:3], [0.5, 0, 0.5])


def test_of_several_presets_the_name_chooses(read):
    collection = [preset(Name="one"), {"Name": "colours only", "RGBPoints": [0, 1, 1, 1]}, preset(Name="two", ColorSpace="Step")]
    assert read(collection, name="two").name == "two"
    with pytest.raises(InputError, match=r"name must be one of its presets \('one', 'colours only', 'two'\), not None"):
        read(collection)
    with pytest.raises(InputError, match="not only colours"):
        read(collection, name="colours only")
    with pytest.raises(InputError, match="name must be None, not 'two'"):
        read(component(), name="two")


def slicer_with(**points):
    return component(**{key: [(0, [1, 0, 0] if key == "colour" else 0.0), value] for key, value in points.items()})


BAD = [
    (b"", "is no transfer function"),
    (b"5", "is no transfer function"),
    (b"\x89PNG\r\n\x1a\n\xff", "must be text"),
    (b"{", "must be valid JSON"),
    (b'{"a": 1', "must be valid JSON"),
    (b"[" * 100_000, "must be valid JSON"),
    (b"[" + b"9" * 5000 + b"]", "must be valid JSON"),
    (b"{}", "colours by value"),
    (b"[]", "it has none"),
    (b"[[]]", "colours by value"),
    ([3, preset()], "name must be one of"),
    ({"volumeProperties": 3}, "must hold components with rgbTransferFunction"),
    ({"volumeProperties": []}, "must hold components with rgbTransferFunction"),
    ({"volumeProperties": [{"components": [[]]}]}, "must hold components with rgbTransferFunction"),
    ({"volumeProperties": [{"components": [{"rgbTransferFunction": {"points": [3]}}]}]}, "rgbTransferFunction, which has points"),
    (slicer_with(opacity=(math.nan, 0.5)), "numbers must be finite, not NaN"),
    (slicer_with(opacity=(math.inf, 0.5)), "numbers must be finite, not Infinity"),
    (slicer_with(opacity=(10**400, 0.5)), "must be a finite number"),
    (b'[{"RGBPoints": [1e999, 0, 0, 0], "Points": [0, 0, 0.5, 0]}]', "RGBPoints must be a finite number, not inf"),
    (slicer_with(opacity=("1", 0.5)), "must be a finite number, not '1'"),
    (slicer_with(opacity=(True, 0.5)), "must be a finite number, not True"),
    (slicer_with(opacity=(1, None)), "must be a finite number, not None"),
    (slicer_with(opacity=(-1, 0.5)), "scalarOpacity must be sorted by value, not 0 before -1"),
    (slicer_with(opacity=(1, 1.5)), "between 0 and 1 beside its values, not 1.5"),
    (slicer_with(opacity=(1, 0.5, 7.0, 0.0)), "between 0 and 1 beside its values, not 7"),
    (slicer_with(opacity=(1, 0.5, 0.5, -1.0)), "between 0 and 1 beside its values, not -1"),
    (component(opacity=[(-1e308, 0), (1e308, 1)]), "finite distance apart"),
    (component(colour=[(-1e308, [0, 0, 0])], opacity=[(1e308, 1)]), "finite distance apart"),
    (slicer_with(colour=(1, [1, 0])), "a color of three numbers"),
    (slicer_with(colour=(1, 3)), "a color of three numbers"),
    (component(colour=[]), "1 to 10000 points of 6 numbers, not 0"),
    (component(opacity=[(i, 0.5) for i in range(MAX_POINTS + 1)]), "1 to 10000 points"),
    (component(scalarOpacityUnitDistance=0), "reference_length must be a positive"),
    (component(scalarOpacityUnitDistance="1"), "scalarOpacityUnitDistance must be a finite number"),
    ([preset([0, 1, 1])], "points of 4 numbers, not 3"),
    ([preset(opacities=[])], "points of 4 numbers, not 0"),
    ([preset([1, 0, 0, 0, 0, 1, 1, 1])], "sorted by value, not 1 before 0"),
    ([preset([0, 0, 0, 255])], "between 0 and 1 beside its values, not 255"),
    ([preset(UseLogScale=1)], "linear in the value, not logarithmic"),
    ([preset(ColorSpace="Lab/CIEDE2000")], "ColorSpace must be RGB, HSV, Lab, Diverging or Step, not 'Lab/CIEDE2000'"),
    ([preset(ColorSpace=[1])], "ColorSpace must be RGB"),
    ([{"Name": "a", "IndexedColors": [0, 0, 0]}], "colours by value"),
    (b"1\n1\n1\n1\n1\n1\n2 0 x\n2 0 1\n4 0 1 1 1\n", "numbers in lines 7 and 9"),
    (b"1\n1\n1\n1\n1\n1\n4 0 1\n2 0 1\n4 0 1 1 1\n", "as many numbers as it promises, not 2 instead of 4"),
    (b"1\n1\n1\n1\n1\n1\n2 0 nan\n2 0 1\n4 0 1 1 1\n", "must be a finite number, not nan"),
    (b"\n" * 20, "is no transfer function|numbers in lines"),
]


@pytest.mark.parametrize(("content", "message"), BAD, ids=range(len(BAD)))
def test_a_bad_file_is_said_to_be_so(read, content, message):
    with pytest.raises(InputError, match=message) as error:
        read(content, "bad.json")
    assert "bad" in str(error.value)
    assert len(str(error.value)) < 400


def test_a_large_file_is_not_read(tmp_path):
    path = tmp_path / "large.json"
    with path.open("wb") as file:
        file.truncate(10**9)
    with pytest.raises(InputError, match="smaller than 8 MB"):
        TransferFunction.read(path)


def test_a_file_that_is_not_there_and_one_that_cannot_be_written(tmp_path):
    with pytest.raises(InputError, match="cannot be read"):
        TransferFunction.read(tmp_path / "none.json")
    with pytest.raises(InputError, match="cannot be read"):
        TransferFunction.read(tmp_path)
    tf = TransferFunction.preset("ct-bone")
    with pytest.raises(InputError, match=r"must end in .vp.json or .json, not 'a.vp'"):
        tf.write(tmp_path / "a.vp")
    with pytest.raises(InputError, match="does not exist"):
        tf.write(tmp_path / "none" / "a.json")


leaves = st.none() | st.booleans() | st.integers(-3, 3) | st.floats() | st.text(max_size=3)
keys = st.sampled_from(
    [
        *("Name", "RGBPoints", "Points", "ColorSpace", "volumeProperties", "components", "rgbTransferFunction"),
        *("scalarOpacity", "points", "x", "y", "color"),
    ]
)
documents = st.recursive(
    leaves, lambda inner: st.lists(inner, max_size=4) | st.dictionaries(keys, inner, max_size=4), max_leaves=12
)
places = st.lists(st.floats(-9, 9) | st.floats() | leaves, max_size=9)


@anything
@given(
    documents | st.builds(lambda c, a, s: [preset(c, a, ColorSpace=s)], places, places, st.sampled_from(["Lab", "Step", None]))
)
def test_any_document_is_a_function_or_an_input_error(read, document):
    with suppress(InputError):
        assert isinstance(read(document), TransferFunction)


@anything
@given(st.binary(max_size=60))
def test_any_bytes_are_a_function_or_an_input_error(read, content):
    with suppress(InputError):
        assert isinstance(read(content), TransferFunction)
