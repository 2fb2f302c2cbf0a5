"""Small DICOM series, written with SimpleITK."""

from __future__ import annotations

from collections.abc import Iterable, Mapping
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

AXIAL = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0)
POSITION, ORIENTATION, NUMBER, SPACING = b"\x20\0\x32\0", b"\x20\0\x37\0", b"\x20\0\x13\0", b"\x28\0\x30\0"


def write_series(
    folder: Path,
    array: NDArray[Any],
    positions: Iterable[tuple[float, float, float]],
    *,
    axes: Iterable[float] = AXIAL,
    uid: str = "1.2.3.4",
    prefix: str = "s",
    tags: Mapping[str, str] | None = None,
    compressed: bool = False,
) -> Path:
    """One file for each plane of array (z, y, x), 0.75 mm apart along x and 0.5 mm along y, named in reverse order."""
    folder.mkdir(parents=True, exist_ok=True)
    for k, (plane, position) in enumerate(zip(array, positions, strict=True)):
        image = sitk.GetImageFromArray(plane)
        image.SetSpacing((0.75, 0.5))
        header = {
            "0008|0060": "CT",
            "0008|103e": f"series {uid}",
            "0020|000d": "1.2.3",
            "0020|000e": uid,
            "0008|0018": f"{uid}.{prefix}{k}".replace("s", "1.").replace("x", "2."),
            "0020|0013": str(k + 1),
            "0020|0032": "\\".join(f"{p:.6f}" for p in position),
            "0020|0037": "\\".join(f"{a:.8f}" for a in axes),
            **(tags or {}),
        }
        for tag, value in header.items():
            image.SetMetaData(tag, value)
        writer = sitk.ImageFileWriter()
        writer.KeepOriginalImageUIDOn()
        writer.SetImageIO("GDCMImageIO")
        writer.SetUseCompression(compressed)
        path = folder / f"{prefix}{900 - k}.dcm"
        writer.SetFileName(str(path))
        writer.Execute(image)
        # Once GDCM has read a file in this process, it writes a spacing between slices of its own.
        path.write_bytes(path.read_bytes().replace(b"\x18\0\x88\0", b"\x18\0\x89\0"))
    return folder


def patch(folder: Path, *replacements: tuple[bytes, bytes]) -> Path:
    """Replace bytes in every file."""
    for path in folder.iterdir():
        data = path.read_bytes()
        for old, new in replacements:
            assert old in data
            data = data.replace(old, new)
        path.write_bytes(data)
    return folder


def without(folder: Path, *tags: bytes) -> Path:
    """Rename tags to their unused neighbours, so that the headers lack them."""
    return patch(folder, *((tag, bytes([tag[0], 0, tag[2] + 1, 0])) for tag in tags))


def planes(count: int = 8) -> NDArray[np.int16]:
    """(count, 20, 30) noise that goes over the whole range of CT."""
    return np.random.default_rng(0).integers(-1000, 2000, (count, 20, 30)).astype(np.int16)


def stacked(count: int = 8, step: float = 2.0) -> list[tuple[float, float, float]]:
    """Positions in LPS mm along z."""
    return [(1.0, 2.0, 3.0 + step * k) for k in range(count)]
