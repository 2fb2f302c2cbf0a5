"""SimpleITK at the door: voxels without a copy, errors in one line."""

from __future__ import annotations

from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import numpy as np
import SimpleITK as sitk
from numpy.typing import NDArray

from intaglio.errors import InputError


class _Voxels:
    """Keeps an image alive for as long as an array looks at its buffer; SimpleITK's own view does not."""

    def __init__(self, image: sitk.Image) -> None:
        self.image = image
        interface = dict(sitk.GetArrayViewFromImage(image).__array_interface__)
        interface["data"] = (interface["data"][0], False)
        self.__array_interface__ = interface


def voxels(image: sitk.Image) -> NDArray[Any]:
    """The image's own buffer as an array (z, y, x); nobody else may hold the image."""
    return np.asarray(_Voxels(image))


@contextmanager
def quiet(name: str, what: str) -> Iterator[None]:
    """ITK's warnings off; what it throws becomes an InputError of one line."""
    before = sitk.ProcessObject.GetGlobalWarningDisplay()
    sitk.ProcessObject.SetGlobalWarningDisplay(False)
    try:
        yield
    except RuntimeError as error:
        lines = [line.strip() for line in str(error).splitlines() if line.strip()]
        reason = lines[-1].split("): ", 1)[-1].removeprefix("sitk::ERROR: ") if lines else "unknown reason"
        raise InputError(f"{name}: cannot be read as {what}: {reason.rstrip('.')}; check that the file is whole") from None
    finally:
        sitk.ProcessObject.SetGlobalWarningDisplay(before)


def header(path: Path, what: str, io: str = "") -> sitk.ImageFileReader:
    """A reader that has seen the file's header only."""
    reader = sitk.ImageFileReader()
    reader.SetFileName(str(path))
    reader.SetImageIO(io)
    with quiet(path.name, what):
        reader.ReadImageInformation()
    return reader


def read(reader: sitk.ImageFileReader, name: str, what: str) -> NDArray[Any]:
    """Voxels of what the reader points at."""
    with quiet(name, what):
        return voxels(reader.Execute())


def dtype_of(reader: sitk.ImageFileReader, name: str) -> np.dtype[Any]:
    """Type of one voxel; vectors, colours and complex numbers are refused."""
    components = reader.GetNumberOfComponents()
    text = sitk.GetPixelIDValueAsString(reader.GetPixelID())
    if components != 1 or "complex" in text or "label" in text:
        raise InputError(f"{name}: voxels must be single numbers, not {components} components ({text}); export one channel")
    kind = "f" if "float" in text else "u" if "unsigned" in text else "i"
    return np.dtype(f"{kind}{int(text.split('-')[0]) // 8}")
