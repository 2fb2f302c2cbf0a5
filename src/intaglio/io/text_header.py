"""NRRD and MetaImage: what their text headers say is checked, then SimpleITK reads them."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import Any

from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.io import itk
from intaglio.io.itk import NO_ORIENTATION, Matrix
from intaglio.io.limits import check_index, check_memory, check_payload, check_shape, check_spacing

_LONGEST = 1 << 20


def _header(path: Path) -> tuple[dict[str, str], list[str], int]:
    """Fields in lower case, the lines after the one that ends the header, and where the voxels begin."""
    meta = path.suffix.lower() in (".mha", ".mhd")
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
    if not value:
        return []
    listed = value.split(" ")[0] == "LIST"
    pattern = re.match(r"\S*%\d*d\S*", value)
    names = rest if listed else [pattern[0]] if pattern else [value]
    folder = path.parent.resolve()
    for name in names:
        if not (folder / name).resolve().is_relative_to(folder):
            raise InputError(f"{path.name}: data file must lie in the header's folder, not at {name!r}; move it there")
    if pattern and not listed:
        return []
    files = [folder / name for name in names]
    for file in files:
        if not file.is_file():
            raise InputError(f"{path.name}: data file {file.name!r} must lie beside it; put it there")
    return files


def _numbers(text: str) -> list[float]:
    return [float(word) for word in re.findall(r"[^\s,()]+", text)]


def _check_spacing(name: str, fields: dict[str, str]) -> None:
    try:
        if "spacings" in fields:
            check_spacing(name, _numbers(fields["spacings"])[-3:])
        elif "spacedirections" in fields:
            axes = [_numbers(axis) for axis in re.findall(r"\(([^)]*)\)", fields["spacedirections"])]
            check_spacing(name, [math.hypot(*axis) for axis in axes][:3])
        elif "elementspacing" in fields or "elementsize" in fields:
            check_spacing(name, _numbers(fields.get("elementspacing") or fields["elementsize"])[:3])
    except ValueError as error:
        if isinstance(error, InputError):
            raise
        raise InputError(f"{name}: spacing must be numbers in mm ({error}); repair the header") from None


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
    return notes


def read_with_text_header(path: Path, *, index: int | None = None) -> tuple[NDArray[Any], Matrix, list[str]]:
    """Array (z, y, x), world_from_index and notes of an NRRD (.nrrd, .nhdr) or MetaImage (.mha, .mhd) file."""
    name = path.name
    fields, rest, begin = _header(path)
    what = "NRRD" if "sizes" in fields else "MetaImage"
    files = _detached(path, fields, rest)
    _check_spacing(name, fields)
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
    if len(reader.GetSize()) > 3:
        extra = len(reader.GetSize()) - 4
        reader.SetExtractSize([*size[:3], 0] + [0] * extra)
        reader.SetExtractIndex([0, 0, 0, index or 0] + [0] * extra)
    matrix = itk.world_from_index(reader.GetSpacing(), reader.GetOrigin(), reader.GetDirection())
    return itk.read(reader, name, what), matrix, _notes(fields)
