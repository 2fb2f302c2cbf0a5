"""Transfer functions as 3D Slicer and ParaView keep them."""

# 3D Slicer: volume-property-schema-v1.0.0.json (.vp.json); vtkMRMLVolumePropertyStorageNode (.vp, its older text).
# ParaView: vtkSMTransferFunctionProxy::ExportTransferFunction (.json).

from __future__ import annotations

import json
import math
import re
import reprlib
from itertools import pairwise
from os import PathLike
from pathlib import Path
from typing import Any, NoReturn

from intaglio.errors import InputError
from intaglio.io.plates import check_output, write_whole
from intaglio.io.svg import legible
from intaglio.io.vtk_functions import TINY, Knots, bent, in_space, joined, number, ordered, rows_of
from intaglio.transfer_function import TransferFunction

MAX_BYTES = 8_000_000
SCHEMA = (
    "https://raw.githubusercontent.com/slicer/slicer/main/Modules/Loadable/VolumeRendering/Resources/Schema/"
    "volume-property-schema-v1.0.0.json#"
)


def _text(file: Path) -> str:
    try:
        with file.open("rb") as stream:
            data = stream.read(MAX_BYTES + 1)
    except OSError as error:
        raise InputError(f"{file} cannot be read: {error.strerror}") from error
    if len(data) > MAX_BYTES:
        raise InputError(f"{file.name}: must be smaller than {MAX_BYTES // 1_000_000} MB to be a transfer function")
    try:
        return data.decode("utf-8-sig")
    except UnicodeDecodeError:
        raise InputError(f"{file.name}: must be text, a transfer function of 3D Slicer or ParaView") from None


def _parsed(file: str, text: str) -> Any:
    def refuse(constant: str) -> NoReturn:
        raise InputError(f"{file}: numbers must be finite, not {constant}")

    try:
        return json.loads(text, parse_constant=refuse)
    except (ValueError, RecursionError) as error:
        raise InputError(f"{file}: must be valid JSON: {error}") from None


def _nodes(what: str, component: Any, key: str, width: int) -> Knots:
    """A function of a volume property; `width` 3 for colours, 1 for opacity."""
    curve = component.get(key) if isinstance(component, dict) else None
    points = curve.get("points") if isinstance(curve, dict) else None
    if not isinstance(points, list) or not all(isinstance(point, dict) for point in points):
        raise InputError(f"{what} must hold components with {key}, which has points")
    what = f"{what}: {key}"
    flat: list[Any] = []
    for point in points:
        y = point.get("color") if width == 3 else [point.get("y")]
        if not isinstance(y, list) or len(y) != width:
            raise InputError(f"{what} must have points with a color of three numbers, not {reprlib.repr(y)}")
        flat += [point.get("x"), *y, point.get("midpoint", 0.5), point.get("sharpness", 0.0)]
    return bent(ordered(what, rows_of(what, flat, width + 3)))


def _from_slicer(file: str, document: dict[str, Any], name: str) -> TransferFunction:
    properties = document["volumeProperties"]
    first = properties[0] if isinstance(properties, list) and properties else None
    components = first.get("components") if isinstance(first, dict) else None
    component = components[0] if isinstance(components, list) and components else None
    colour, opacity = _nodes(file, component, "rgbTransferFunction", 3), _nodes(file, component, "scalarOpacity", 1)
    assert isinstance(component, dict)
    unit = number(f"{file}: scalarOpacityUnitDistance", component.get("scalarOpacityUnitDistance", 1.0))
    return joined(name, colour, opacity, unit)


def _from_text(file: str, text: str, name: str) -> TransferFunction:
    """Line 7: opacity, line 9: colours; each begins with how many numbers follow."""
    lines = text.splitlines()
    if len(lines) < 9:
        raise InputError(f"{file}: is no transfer function of 3D Slicer or ParaView")
    curves = []
    for line, width in ((lines[8], 4), (lines[6], 2)):
        try:
            count, *values = [float(word) for word in line.split()]
        except ValueError:
            raise InputError(f"{file}: must have numbers in lines 7 and 9, not {reprlib.repr(line)}") from None
        if count != len(values):
            raise InputError(f"{file}: must have as many numbers as it promises, not {len(values)} instead of {count:g}")
        rows = ordered(file, rows_of(file, values, width))
        curves.append((rows[:, 0], rows[:, 1:]))
    return joined(name, curves[0], curves[1], 1.0)


def _from_paraview(file: str, presets: list[Any], name: str | None, stem: str) -> TransferFunction:
    names = [legible(str(preset.get("Name", stem))) if isinstance(preset, dict) else "" for preset in presets]
    if name is None and len(presets) == 1:
        name = names[0]
    if name not in names:
        held = ", ".join(reprlib.repr(n) for n in names[:10]) + (", ..." if len(names) > 10 else "")
        raise InputError(f"{file}: name must be one of its presets ({held or 'it has none'}), not {name!r}")
    preset = presets[names.index(name)]
    what = f"{file}: {name}"
    if not isinstance(preset, dict) or not isinstance(preset.get("RGBPoints"), list):
        raise InputError(f"{what}: must hold colours by value (RGBPoints)")
    if not isinstance(preset.get("Points"), list):
        raise InputError(f"{what}: must hold opacities (Points), not only colours; export it from ParaView with them")
    if preset.get("UseLogScale", False):
        raise InputError(f"{what}: must be linear in the value, not logarithmic (UseLogScale)")
    rows = ordered(f"{what}: RGBPoints", rows_of(f"{what}: RGBPoints", preset["RGBPoints"], 4))
    opacity = bent(ordered(f"{what}: Points", rows_of(f"{what}: Points", preset["Points"], 4)))
    unit = number(f"{what}: ScalarOpacityUnitDistance", preset.get("ScalarOpacityUnitDistance", 1.0))
    return joined(name, in_space(what, (rows[:, 0], rows[:, 1:]), preset), opacity, unit)


def _apart(function: TransferFunction) -> list[tuple[float, list[float], float]]:
    """(value, colour, opacity) with no value twice: the first point of a step moves down by a rounding."""
    x, rgba = function.knots
    values = x.tolist()
    for i, (a, b) in enumerate(pairwise(x.tolist())):
        if a == b:
            values[i] = min(math.nextafter(a, -math.inf), a - TINY)
    return [(v, c[:3], c[3]) for v, c in zip(values, rgba.tolist(), strict=True)]


def _slicer(function: TransferFunction) -> dict[str, Any]:
    points = _apart(function)
    plain = {"midpoint": 0.5, "sharpness": 0.0}
    component = {
        "componentWeight": 1.0,
        "shade": True,
        "lighting": {"diffuse": 0.7, "ambient": 0.3, "specular": 0.1, "specularPower": 10.0},
        "disableGradientOpacity": False,
        "scalarOpacityUnitDistance": function.reference_length,
        "rgbTransferFunction": {
            "type": "colorTransferFunction",
            "points": [{"x": x, "color": colour, **plain} for x, colour, _ in points],
        },
        "scalarOpacity": {"type": "piecewiseLinearFunction", "points": [{"x": x, "y": a, **plain} for x, _, a in points]},
        "gradientOpacity": {"type": "piecewiseLinearFunction", "points": [{"x": 0.0, "y": 1.0, **plain}]},
    }
    volume_property = {
        "effectiveRange": [points[0][0], points[-1][0]],
        "isoSurfaceValues": [],
        "independentComponents": True,
        "interpolationType": "linear",
        "useClippedVoxelIntensity": False,
        "clippedVoxelIntensity": 0.0,
        "scatteringAnisotropy": 0.0,
        "components": [component],
    }
    return {"@schema": SCHEMA, "volumeProperties": [volume_property]}


def _paraview(function: TransferFunction) -> list[dict[str, Any]]:
    points = _apart(function)
    return [
        {
            "ColorSpace": "RGB",
            "Name": function.name,
            "Points": [v for x, _, a in points for v in (x, a, 0.5, 0.0)],
            "RGBPoints": [v for x, colour, _ in points for v in (x, *colour)],
            "ScalarOpacityUnitDistance": function.reference_length,
        }
    ]


def read_transfer_function(path: str | PathLike[str], *, name: str | None = None) -> TransferFunction:
    """Read a volume property of 3D Slicer (.vp.json, .vp) or a preset of ParaView (.json); the content decides which.

    name  of the preset, if a file of ParaView holds several

    Colour and opacity are kept, and the unit distance as reference length; light and gradient opacity are not. Of a
    volume property the first component is taken. Midpoints are exact; sharpness, and colours that ParaView mixes in
    HSV, Lab or Diverging, become short straight lines. InputError for a file that holds no such function, and for
    numbers that are not finite, out of order or beyond 0..1.
    """
    file = Path(path)
    text = _text(file)
    stem = legible(re.sub(r"(\.vp)?\.json$|\.vp$", "", file.name, flags=re.IGNORECASE))
    document = _parsed(file.name, text) if text.lstrip().startswith(("{", "[")) else None
    if isinstance(document, list) or (isinstance(document, dict) and "volumeProperties" not in document):
        return _from_paraview(file.name, document if isinstance(document, list) else [document], name, stem)
    if name is not None:
        raise InputError(f"{file.name}: name must be None, not {name!r}: a volume property of 3D Slicer has none")
    return _from_text(file.name, text, stem) if document is None else _from_slicer(file.name, document, stem)


def write_transfer_function(function: TransferFunction, path: str | PathLike[str]) -> None:
    """Write for 3D Slicer (.vp.json) or ParaView (.json); reading gives the same function, constants as steps.

    Colours, opacities and the reference length are exact. InputError for another extension, and where nothing can
    be written.
    """
    target = check_output(path, (".vp.json", ".json"))
    document = _slicer(function) if target.name.lower().endswith(".vp.json") else _paraview(function)
    write_whole(target, (json.dumps(document, indent=2) + "\n").encode())
