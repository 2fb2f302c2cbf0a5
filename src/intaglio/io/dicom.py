"""DICOM series: found, chosen, and read slice by slice."""

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.io import geometry, itk
from intaglio.io.dicom_slices import GDCM, Slice, read_header, sort_slices
from intaglio.io.geometry import Matrix
from intaglio.io.limits import check_memory, check_shape

if TYPE_CHECKING:
    from intaglio.compute import Progress


def find_series(folder: Path, *, recursive: bool = True) -> tuple[dict[str, list[Slice]], list[str]]:
    """Slices by series, and the DICOM files that hold no readable image."""
    groups: dict[str, list[Slice]] = {}
    left_out = []
    for path in sorted(folder.rglob("*") if recursive else folder.iterdir()):
        if path.name.startswith(".") or path.name == "DICOMDIR" or not path.is_file():
            continue
        marked = _has_magic(path)
        if not marked and path.suffix.lower() not in ("", ".dcm", ".ima", ".dicom"):
            continue
        found = read_header(path)
        if found:
            groups.setdefault(found.series or "without uid", []).append(found)
        elif marked or path.suffix.lower() == ".dcm":
            left_out.append(path.name)
    return groups, left_out


def _has_magic(path: Path) -> bool:
    try:
        with path.open("rb") as file:
            return file.read(132)[128:] == b"DICM"
    except OSError as error:
        raise InputError(f"{path.name}: cannot be read ({error.strerror}); check its permissions") from None


def _depth(slices: list[Slice]) -> int:
    return slices[0].size[2] if len(slices) == 1 and len(slices[0].size) > 2 else len(slices)


def choose_series(name: str, groups: dict[str, list[Slice]], series: str | int | None) -> tuple[list[Slice], list[str]]:
    """Slices of the series asked for by uid or by number from 1, or of the only one that is a volume; and a note."""
    uids = sorted(groups)
    listing = "; ".join(
        f"{k + 1}: {groups[uid][0].extent} x {_depth(groups[uid])} {groups[uid][0].title or 'untitled'} ({uid})"
        for k, uid in enumerate(uids)
    )
    if series is not None:
        key = str(series).strip()
        if key not in groups and not (key.isdigit() and 1 <= int(key) <= len(uids)):
            raise InputError(f"{name}: series must be one of 1..{len(uids)} or a uid, not {series!r}; it holds {listing}")
        return groups[key if key in groups else uids[int(key) - 1]], []
    if len(uids) == 1:
        return groups[uids[0]], []
    volumes = [uid for uid in uids if _depth(groups[uid]) > 3]
    if len(volumes) != 1:
        raise InputError(f"{name}: holds {len(uids)} DICOM series; choose one with series=: {listing}")
    return groups[volumes[0]], [
        f"series {uids.index(volumes[0]) + 1} of {len(uids)} chosen, the others are no volumes: {listing}"
    ]


def _read_frames(s: Slice, notes: list[str]) -> tuple[NDArray[Any], Matrix, list[str]]:
    reader = itk.header(s.path, "DICOM", GDCM)
    assert s.dtype is not None
    check_shape(s.path.name, s.size)
    check_memory(s.path.name, math.prod(s.size) * s.dtype.itemsize)
    notes.append("multi-frame file: frames taken to be evenly spaced and in order")
    matrix = geometry.world_from_index(reader.GetSpacing(), reader.GetOrigin(), reader.GetDirection())
    return itk.read(reader, s.path.name, "DICOM"), matrix, notes


def _read_pixels(name: str, slices: list[Slice], progress: Progress | None) -> NDArray[Any]:
    """The rescaled pixels. GDCM gives int32 where the rescaled range of the stored type might need it: int16 if it does not."""
    dtype = np.result_type(*[s.dtype for s in slices if s.dtype is not None])
    narrow = np.iinfo(np.int16)
    start = np.dtype(np.int16) if dtype == np.int32 else dtype
    x, y = slices[0].size[:2]
    check_memory(name, len(slices) * x * y * dtype.itemsize)
    array = np.empty((len(slices), y, x), start)
    for k, s in enumerate(slices):
        pixels = itk.read(itk.header(s.path, "DICOM", GDCM), s.path.name, "DICOM").reshape(y, x)
        if array.dtype != dtype and not (narrow.min <= pixels.min() and pixels.max() <= narrow.max):
            array = array.astype(dtype)
        array[k] = pixels
        if progress:
            progress(k + 1, len(slices))
    return array


def read_dicom(
    path: Path, *, series: str | int | None = None, progress: Progress | None = None
) -> tuple[NDArray[Any], Matrix, list[str]]:
    """Array (z, y, x), world_from_index and notes of a DICOM folder, or of the series that one file belongs to."""
    name = path.name
    if path.is_dir():
        groups, left_out = find_series(path)
    else:
        one = read_header(path)
        if one is None:
            raise InputError(f"{name}: is not a DICOM image; check that the file is whole")
        groups, left_out = find_series(path.parent, recursive=False)
        series = series or one.series or "without uid"
    if not groups:
        raise InputError(f"{name}: no slices found; give a folder with DICOM, .tif or .png slices")
    slices, notes = choose_series(name, groups, series)
    if left_out:
        notes.append(f"{len(left_out)} DICOM files without a readable image left out: {', '.join(left_out[:3])}")
    for s in slices:
        if s.dtype is None:
            raise InputError(f"{name}: {s.path.name} has colour or vector pixels; single numbers are needed")
    if len(slices) == 1 and _depth(slices) > 1:
        return _read_frames(slices[0], notes)
    check_shape(name, (*slices[0].size[:2], len(slices)))
    try:
        slices, matrix, assumed = sort_slices(name, slices)
    except InputError as error:
        raise InputError(f"{error} (not readable: {', '.join(left_out[:3])})" if left_out else str(error)) from None
    return _read_pixels(name, slices, progress), matrix, notes + assumed
