"""One DICOM image's header, and how the images of a series lie in the patient."""

# DICOM PS3.3, C.7.6.2 (image plane module).

from __future__ import annotations

import math
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.io import geometry, itk
from intaglio.io.geometry import Matrix
from intaglio.io.limits import check_spacing

if TYPE_CHECKING:
    import SimpleITK as sitk

GDCM = "GDCMImageIO"


@dataclass(frozen=True)
class Slice:
    """What the header of one image says; geometry in LPS mm, None where it says nothing."""

    path: Path
    series: str
    title: str
    size: tuple[int, ...]
    dtype: np.dtype[Any] | None
    position: NDArray[np.float64] | None
    axes: NDArray[np.float64] | None  # rows: direction along x, along y
    spacing: list[float] | None  # along y, along x, as DICOM has it
    location: float | None
    number: float | None
    thickness: float | None

    @property
    def extent(self) -> str:
        """Columns and rows."""
        return " x ".join(str(n) for n in self.size[:2])


def _values(reader: sitk.ImageFileReader, tag: str, count: int) -> list[float] | None:
    """The numbers of a tag, or None where it is missing, empty or no numbers."""
    if not reader.HasMetaDataKey(tag):
        return None
    try:
        values = [float(part) for part in reader.GetMetaData(tag).strip(" \0").split("\\")]
    except ValueError:
        return None
    return values if len(values) == count else None


def _text(reader: sitk.ImageFileReader, tag: str) -> str:
    return " ".join(str(reader.GetMetaData(tag)).strip("\0").split()) if reader.HasMetaDataKey(tag) else ""


def read_header(path: Path) -> Slice | None:
    """The header of a DICOM image; None if the file is no such thing."""
    try:
        reader = itk.header(path, "DICOM", GDCM)
    except InputError:
        return None
    one = {key: _values(reader, tag, 1) for key, tag in (("location", "0020|1041"), ("number", "0020|0013"))}
    position = _values(reader, "0020|0032", 3)
    axes = _values(reader, "0020|0037", 6)
    thickness = _values(reader, "0018|0088", 1) or _values(reader, "0018|0050", 1)
    try:
        dtype: np.dtype[Any] | None = itk.dtype_of(reader, path.name)
    except InputError:
        dtype = None
    bits = _values(reader, "0028|0100", 1)
    if dtype == np.float64 and bits and bits[0] <= 16:
        dtype = np.dtype(np.float32)  # GDCM rescales in float64, which 16 bits do not need
    return Slice(
        path=path,
        series=_text(reader, "0020|000e"),
        title=" ".join(t for t in (_text(reader, "0008|0060"), _text(reader, "0008|103e")) if t),
        size=reader.GetSize(),
        dtype=dtype,
        position=np.array(position) if position else None,
        axes=np.reshape(axes, (2, 3)) if axes else None,
        spacing=_values(reader, "0028|0030", 2),
        location=one["location"][0] if one["location"] else None,
        number=one["number"][0] if one["number"] else None,
        thickness=thickness[0] if thickness else None,
    )


def _check_steps(name: str, slices: list[Slice], positions: NDArray[np.float64], along: NDArray[np.float64]) -> None:
    """Refuse slices that share a position, leave a gap, or do not lie on a line at equal steps."""
    steps = np.diff(along)
    usual = float(np.median(steps))
    files = [s.path.name for s in slices]
    for k in np.flatnonzero(steps < 1e-4):
        raise InputError(
            f"{name}: {files[k]} and {files[k + 1]} lie at the same position ({along[k]:.2f} mm), "
            f"{int((steps < 1e-4).sum())} such pairs; keep one image of each position"
        )
    for k in np.flatnonzero(steps > 1.5 * usual):
        raise InputError(
            f"{name}: a gap of {steps[k]:.2f} mm between {files[k]} and {files[k + 1]}, others are {usual:.2f} mm apart; "
            "add the missing slices or leave out those beyond"
        )
    line = np.linspace(positions[0], positions[-1], len(slices))
    apart = np.linalg.norm(positions - line, axis=1)
    worst = int(np.argmax(apart))
    # Positions are often rounded to a tenth of a millimetre.
    if apart[worst] > max(0.05 * usual, 0.051):
        raise InputError(
            f"{name}: slices are not evenly spaced: steps from {steps.min():.3f} to {steps.max():.3f} mm, {files[worst]} lies "
            f"{apart[worst]:.3f} mm off; resample them to even spacing"
        )


def sort_slices(name: str, slices: list[Slice]) -> tuple[list[Slice], Matrix, list[str]]:
    """Slices in the order of their positions, world_from_index, and what had to be assumed."""
    first = slices[0]
    notes = []
    for s in slices[1:]:
        if s.size != first.size:
            raise InputError(f"{name}: {s.path.name} is {s.extent}, {first.path.name} is {first.extent}; keep images of one size")
    spacing = first.spacing
    if spacing is None:
        spacing = [1.0, 1.0]
        notes.append("no pixel spacing stored: 1 mm assumed")
    for s in slices:
        if s.spacing is not None and not np.allclose(s.spacing, spacing, rtol=1e-3):
            raise InputError(f"{name}: {s.path.name} has pixel spacing {s.spacing}, {first.path.name} {spacing}; keep one kind")
    if any(s.axes is None for s in slices):
        axes = np.eye(3)[:2]
        notes.append("no orientation stored: axial slices assumed")
    else:
        axes = np.array([s.axes for s in slices])[0]
        for s in slices:
            assert s.axes is not None
            if not np.allclose(s.axes, axes, atol=1e-3):
                raise InputError(f"{name}: {s.path.name} and {first.path.name} face different ways; keep one orientation")
    normal = np.cross(axes[0], axes[1])
    if not abs(float(np.linalg.norm(normal)) - 1.0) < 1e-3:
        raise InputError(f"{name}: image orientation must be two perpendicular unit vectors, not {axes.ravel().tolist()}")

    known = [s.position for s in slices if s.position is not None]
    # Converters without positions write the same one, mostly zero, into every image.
    if len(known) == len(slices) and np.ptp(known, axis=0).any():
        positions = np.array(known)
    elif all(s.location is not None for s in slices):
        positions = np.array([s.location for s in slices], dtype=np.float64)[:, None] * normal
        notes.append("no positions stored: slices placed by their slice location")
    elif all(s.number is not None for s in slices):
        step = first.thickness or 1.0
        positions = np.array([s.number for s in slices], dtype=np.float64)[:, None] * normal * step
        notes.append(f"no positions stored: slices placed by instance number, {step:g} mm apart")
    else:
        raise InputError(f"{name}: slices have no position, location or instance number, so no order; export them again")
    along = positions @ normal
    order = np.argsort(along, kind="stable")
    slices, positions, along = [slices[k] for k in order], positions[order], along[order]
    _check_steps(name, slices, positions, along)
    step = (positions[-1] - positions[0]) / (len(slices) - 1)
    check_spacing(name, [spacing[1], spacing[0], float(np.linalg.norm(step))])
    tilt = math.degrees(math.acos(min(1.0, float(step @ normal) / float(np.linalg.norm(step)))))
    if tilt > 0.1:
        notes.append(f"gantry tilt of {tilt:.1f} degrees kept: slices are sheared, not resampled")
    matrix = np.eye(4)
    matrix[:3, :4] = np.stack([axes[0] * spacing[1], axes[1] * spacing[0], step, positions[0]], axis=1)
    return slices, geometry.ras_from_lps(matrix), notes
