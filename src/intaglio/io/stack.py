"""Stacks of images: a folder of numbered slices, or one TIFF with many pages."""

from __future__ import annotations

import math
import re
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.io import geometry, itk
from intaglio.io.geometry import NO_ORIENTATION, Matrix
from intaglio.io.limits import check_index, check_memory, check_shape
from intaglio.io.tiff import check_tiff

if TYPE_CHECKING:
    from intaglio.compute import Progress

SUFFIXES = (".tif", ".tiff", ".png")
# The resolution that TIFF and PNG hold is that of a printer, and there is none across slices.
_NOTES = ("no spacing stored: 1 mm assumed", NO_ORIENTATION)


def slices_in(folder: Path) -> list[Path]:
    """Image files of a folder, in the order of the numbers in their names."""
    files = [f for f in folder.iterdir() if f.suffix.lower() in SUFFIXES and not f.name.startswith(".")]
    return sorted(files, key=lambda f: [int(part) if part.isdigit() else part for part in re.split(r"(\d+)", f.stem)])


def _check_numbers(name: str, files: list[Path]) -> None:
    """Refuse a stack in which the last number of the names leaves a gap."""
    found = [re.findall(r"\d+", f.stem) for f in files]
    if not all(found):
        return
    numbers = [int(digits[-1]) for digits in found]
    steps = np.diff(numbers)
    if len(steps) and (steps > 0).all():
        k = int(np.argmax(steps))
        if steps[k] != np.median(steps):
            raise InputError(
                f"{name}: slices are missing between {files[k].name} and {files[k + 1].name}; "
                "complete the stack or number its files evenly"
            )


def read_stack(folder: Path, *, progress: Progress | None = None) -> tuple[NDArray[Any], Matrix, list[str]]:
    """Array (z, y, x), world_from_index and notes of a folder of .tif, .tiff or .png slices."""
    name = folder.name
    files = slices_in(folder)
    _check_numbers(name, files)
    first = itk.header(files[0], "an image")
    dtype = itk.dtype_of(first, files[0].name)
    size = first.GetSize()
    if len(size) != 2 and math.prod(size[2:]) != 1:
        raise InputError(f"{name}: {files[0].name} has {size[2]} pages; give that file, not its folder")
    check_shape(name, (*size[:2], len(files)))
    check_memory(name, math.prod(size) * len(files) * dtype.itemsize)
    array = np.empty((len(files), size[1], size[0]), dtype)
    for k, file in enumerate(files):
        if file.suffix.lower() != ".png":
            check_tiff(file)
        reader = itk.header(file, "an image")
        if reader.GetSize() != size or itk.dtype_of(reader, file.name) != dtype:
            raise InputError(
                f"{name}: {file.name} is {' x '.join(map(str, reader.GetSize()))} {itk.dtype_of(reader, file.name)}, "
                f"{files[0].name} is {' x '.join(map(str, size))} {dtype}; a stack needs slices of one kind"
            )
        array[k] = itk.read(reader, file.name, "an image").reshape(array.shape[1:])
        if progress:
            progress(k + 1, len(files))
    return array, geometry.world_from_index((1.0, 1.0, 1.0)), list(_NOTES)


def read_pages(path: Path, *, index: int | None = None) -> tuple[NDArray[Any], Matrix, list[str]]:
    """Array (z, y, x), world_from_index and notes of a TIFF file whose pages are slices."""
    if path.suffix.lower() != ".png":
        check_tiff(path)
    reader = itk.header(path, "TIFF")
    dtype = itk.dtype_of(reader, path.name)
    check_shape(path.name, reader.GetSize())
    check_index(path.name, 1, index)
    check_memory(path.name, math.prod(reader.GetSize()) * dtype.itemsize)
    return itk.read(reader, path.name, "TIFF"), geometry.world_from_index((1.0, 1.0, 1.0)), list(_NOTES)
