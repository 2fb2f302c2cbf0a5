"""read_volume: any scan, placed in the patient."""

from __future__ import annotations

import math
import os
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.errors import InputError
from intaglio.io.distances import GUESSED, MARK, are_distances
from intaglio.io.geometry import Matrix, directions, is_placed
from intaglio.io.limits import check_index
from intaglio.io.nifti import read_nifti
from intaglio.io.raw import Raw, read_raw
from intaglio.volume import Volume

if TYPE_CHECKING:
    from intaglio.compute import Progress

KINDS = ".nii .nii.gz .nrrd .nhdr .mha .mhd .dcm .tif .tiff .raw .raw.gz, a folder of DICOM, TIFF or PNG slices"


def _read(
    path: Path,
    raw: Raw | None,
    spacing: list[float] | None,
    series: str | int | None,
    index: int | None,
    progress: Progress | None,
) -> tuple[NDArray[Any], Matrix, list[str]]:
    """One reader for each kind of file; those that need SimpleITK, with its 65 MB, are loaded when they are wanted."""
    kind = path.name.lower()
    if raw is not None:
        check_index(path.name, 1, index)
        return read_raw(path, raw, progress=progress)
    if path.is_file() and path.stat().st_size == 0:
        raise InputError(f"{path.name}: is empty; get the file again")
    if kind.endswith((".nii", ".nii.gz")) and not path.is_dir():
        return read_nifti(path, index=index, spacing=spacing, progress=progress)
    from intaglio.io.dicom import read_dicom
    from intaglio.io.stack import SUFFIXES, read_pages, read_stack, slices_in
    from intaglio.io.text_header import read_with_text_header

    if path.is_dir():
        check_index(path.name, 1, index)
        return read_stack(path, progress=progress) if slices_in(path) else read_dicom(path, series=series, progress=progress)
    if kind.endswith((".nrrd", ".nhdr", ".mha", ".mhd")):
        return read_with_text_header(path, index=index)
    if kind.endswith(SUFFIXES):
        return read_pages(path, index=index)
    if kind.endswith((".raw", ".raw.gz")):
        raise InputError(f"{path.name}: raw voxels need raw=((x, y, z), dtype, spacing)")
    if kind.endswith((".dcm", ".ima", ".dicom")) or _is_dicom(path):
        check_index(path.name, 1, index)
        return read_dicom(path, series=series, progress=progress)
    raise InputError(f"{path.name}: kind must be one of {KINDS}; not {path.suffix or 'a file without extension'!r}")


def _is_dicom(path: Path) -> bool:
    with path.open("rb") as file:
        return file.read(132)[128:] == b"DICM"


def _finite(name: str, array: NDArray[Any], fill: float | None) -> NDArray[Any]:
    """The array with NaN and infinite voxels replaced by fill."""
    if array.dtype.kind != "f":
        return array
    bad = sum(int(plane.size - np.count_nonzero(np.isfinite(plane))) for plane in array)
    if bad and fill is None:
        raise InputError(f"{name}: {bad} voxels are NaN or infinite; replace them with fill=VALUE")
    if bad:
        for plane in array:
            plane[~np.isfinite(plane)] = fill
    return array


def _three(spacing: ArrayLike) -> list[float]:
    try:
        step = [float(s) for s in np.broadcast_to(np.asarray(spacing, dtype=np.float64), (3,))]
    except (TypeError, ValueError):
        step = []
    if not step or not all(math.isfinite(s) and s > 0 for s in step):
        raise InputError(f"spacing must be three positive numbers in mm, or one, not {spacing!r}")
    return step


def _respaced(matrix: Matrix, step: list[float]) -> Matrix:
    matrix = matrix.copy()
    matrix[:3, :3] *= step / np.linalg.norm(matrix[:3, :3], axis=0)
    return matrix


def read_volume(
    path: str | os.PathLike[str],
    *,
    raw: Raw | None = None,
    spacing: ArrayLike | None = None,
    axes: str | None = None,
    fill: float | None = None,
    series: str | int | None = None,
    index: int | None = None,
    progress: Progress | None = None,
) -> Volume:
    """A volume from a file or a folder, in RAS+ mm, its voxels in their own type.

    path      NIfTI, NRRD, MetaImage, a multi-page TIFF, raw voxels (also gzipped), a DICOM folder (searched
              recursively) or one .dcm file of a series, a folder of numbered .tif, .tiff or .png slices
    raw       ((x, y, z), dtype, spacing) for files without a header: number of voxels, a numpy type with
              byte order such as ">u2", and mm
    spacing   (x, y, z) in mm, or one number, in place of what the file says
    axes      to which side of the patient x, y and z run, in place of what the file says: LPS is columns to the left, rows
              posterior, slices superior; RAS, PIR and so on
    fill      the value for voxels that are NaN or infinite
    series    which DICOM series: its uid, or its number from 1 in the listing that the error gives
    index     which volume of a 4-D file, from 0
    progress  called with slices done and in all

    Signed distances are recognized, in files that `write_volume` made and by their values in others: see `Volume.distances`.
    What had to be assumed is in the volume's notes. The array may be read-only.
    Raises InputError for anything that is not one whole volume of finite numbers.
    """
    path = Path(os.path.abspath(path))
    name = path.name
    if fill is not None and not math.isfinite(fill):
        raise InputError(f"fill must be a finite number, not {fill!r}")
    step = None if spacing is None else _three(spacing)
    sides = None if axes is None else directions(axes)
    try:
        if not path.exists():
            raise InputError(f"{path}: no such file or folder; check the path")
        array, matrix, notes = _read(path, raw, step, series, index, progress)
    except OSError as error:
        raise InputError(f"{name}: cannot be read ({error.strerror}); check its permissions and the disk") from None
    array = _finite(name, array, fill)
    if step is not None:
        matrix = _respaced(matrix, step)
        notes = [note for note in notes if "mm assumed" not in note]
    if sides is not None:
        matrix = matrix.copy()
        matrix[:3, :3] = sides * np.linalg.norm(matrix[:3, :3], axis=0)
        notes = [note for note in notes if is_placed([note])]
    distances = array.dtype.kind == "f" and (MARK in notes or are_distances(array, matrix))
    notes = [note for note in notes if note != MARK] + ([GUESSED] if distances and MARK not in notes else [])
    return Volume(array, matrix, name, tuple(notes), distances)
