"""NRRD and MetaImage: what their text headers say is checked, then SimpleITK reads them."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.io import geometry, itk
from intaglio.io.distances import KEY, MARK
from intaglio.io.geometry import NO_ORIENTATION, Matrix
from intaglio.io.limits import check_index, check_memory, check_payload, check_shape, check_spacing
from intaglio.io.payload import check_zlib

_LONGEST = 1 << 20
_META = (".mha", ".mhd")


def _header(path: Path) -> tuple[dict[str, str], list[str], int]:
    """Fields in lower case, the lines after the one that ends the header, and where the voxels begin."""
    meta = path.suffix.lower() in _META
    fields: dict[str, str] = {}
    with path.open("rb") as file:
        if not meta and not file.readline(64).startswith(b"NRRD000"):
            raise InputError(f"{path.name}: is not an NRRD file (no NRRD magic); check its name")
        while file.tell() < _LONGEST:
            line = file.readline(_LONGEST)
            text = line.decode("latin-1").strip()
            if not line or (not text and not meta):
                break
            key, sign, value = text.partition("=" if meta else ":")
            if sign and not text.startswith("#"):
                fields[key.strip().lower().replace(" ", "")] = value.lstrip("=").strip()
            # The last field of either format that may be followed by a list of files.
            if meta and key.strip().lower() == "elementdatafile":
                break
            if not meta and key.strip().lower() in ("data file", "datafile") and value.strip().startswith("LIST"):
                break
        begin = file.tell()
        rest = file.read(_LONGEST).decode("latin-1").splitlines() if _data_file(fields).split(" ")[0] == "LIST" else []
    if meta and not {"dimsize", "elementdatafile"} <= fields.keys():
        raise InputError(f"{path.name}: is not a MetaImage header (no DimSize and ElementDataFile); check its name")
    return fields, [line.strip() for line in rest if line.strip()], begin


def _data_file(fields: dict[str, str]) -> str:
    value = fields.get("datafile") or fields.get("elementdatafile") or ""
    return "" if value.upper() == "LOCAL" else value


def _detached(path: Path, fields: dict[str, str], rest: list[str]) -> list[Path]:
    """Files with the voxels, none of them outside the header's folder."""
    value = _data_file(fields)
    pattern = re.fullmatch(r"([^%]*%\d*d[^%\s]*)\s+(-?\d+)\s+(-?\d+)(?:\s+(\d+))?.*", value)
    if not value:
        return []
    if value.split(" ")[0] == "LIST":
        names = rest
    elif pattern:
        begin, end, step = int(pattern[2]), int(pattern[3]), int(pattern[4] or 1)
        names = [pattern[1] % k for k in range(begin, min(end, begin + 1_000_000) + 1, max(step, 1))]
    else:
        names = [value]
    folder = path.parent.resolve()
    for name in names:
        file = (folder / name).resolve()
        if not file.is_relative_to(folder):
            raise InputError(f"{path.name}: data file must lie in the header's folder, not at {name!r}; move it there")
        if not file.is_file():
            raise InputError(f"{path.name}: data file {name!r} is missing; put it beside the header")
    return [folder / name for name in names]


def _numbers(text: str) -> list[float]:
    return [float(word) for word in re.findall(r"[^\s,()]+", text)]


def _check_grid(name: str, fields: dict[str, str]) -> None:
    """Shape and spacing as the text has them, since SimpleITK turns some broken ones into others."""
    try:
        sizes = [int(n) for n in _numbers(fields.get("sizes") or fields.get("dimsize", ""))]
        if len(sizes) != 3:
            return check_shape(name, sizes) if len(sizes) < 3 else None
        if "spacings" in fields:
            check_spacing(name, _numbers(fields["spacings"]))
        elif "spacedirections" in fields:
            axes = [_numbers(axis) for axis in re.findall(r"\(([^)]*)\)", fields["spacedirections"])]
            check_spacing(name, [math.hypot(*axis) for axis in axes])
        elif "elementspacing" in fields or "elementsize" in fields:
            check_spacing(name, _numbers(fields.get("elementspacing") or fields["elementsize"]))
    except InputError:
        raise
    except (ValueError, OverflowError) as error:
        raise InputError(f"{name}: size and spacing must be numbers ({error}); repair the header") from None


def _notes(fields: dict[str, str]) -> list[str]:
    notes = []
    if "sizes" in fields:
        space = fields.get("space", "")
        if not space:
            notes.append(NO_ORIENTATION)
        elif not re.fullmatch(r"(?i)(left|right)-(anterior|posterior)-superior(-time)?|[lr][ap]s(t)?", space):
            notes.append(f"space {space!r} says nothing of the patient: taken as left-posterior-superior")
    elif not fields.keys() & {"transformmatrix", "orientation", "rotation"}:
        notes.append(NO_ORIENTATION)
    if not fields.keys() & {"spacings", "spacedirections", "elementspacing", "elementsize"}:
        notes.append("no spacing stored: 1 mm assumed")
    if fields.get(KEY.lower()) == MARK:
        notes.append(MARK)
    return notes


def read_with_text_header(path: Path, *, index: int | None = None) -> tuple[NDArray[Any], Matrix, list[str]]:
    """Array (z, y, x), world_from_index and notes of an NRRD (.nrrd, .nhdr) or MetaImage (.mha, .mhd) file."""
    name = path.name
    fields, rest, begin = _header(path)
    what = "MetaImage" if path.suffix.lower() in _META else "NRRD"
    files = _detached(path, fields, rest)
    _check_grid(name, fields)
    reader = itk.header(path, what)
    size = list(reader.GetSize())
    while len(size) > 3 and size[-1] == 1:
        size.pop()
    dtype = itk.dtype_of(reader, name)
    check_shape(name, size[:3])
    if len(size) > 4:
        raise InputError(f"{name}: must have three or four axes, not {len(size)}; split the file")
    count = size[3] if len(size) == 4 else 1
    check_index(name, count, index)
    promised = math.prod(size) * dtype.itemsize
    stored = sum(file.stat().st_size for file in files) if files else path.stat().st_size - begin
    encoding = fields.get("encoding", "raw").lower()
    deflated = encoding in ("gz", "gzip") or fields.get("compresseddata", "").lower() == "true"
    if (files or not _data_file(fields)) and encoding in ("raw", "gz", "gzip"):
        check_payload(name, promised, stored, deflated=deflated)
    check_memory(name, promised // count)
    if what == "MetaImage" and deflated:
        check_zlib(files[0] if files else path, 0 if files else begin)
    if len(reader.GetSize()) > 3:
        extra = len(reader.GetSize()) - 4
        reader.SetExtractSize([*size[:3], 0] + [0] * extra)
        reader.SetExtractIndex([0, 0, 0, index or 0] + [0] * extra)
    check_spacing(name, reader.GetSpacing()[:3])
    matrix = geometry.world_from_index(reader.GetSpacing(), reader.GetOrigin(), reader.GetDirection())
    return itk.read(reader, name, what), matrix, _notes(fields)
