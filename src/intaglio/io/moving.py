"""Drawings one after the other: animated GIF and PNG, or a folder of PNG files."""

# CompuServe, "Graphics Interchange Format", version 89a, 1990.

from __future__ import annotations

import io
from collections.abc import Iterable
from os import PathLike
from pathlib import Path
from typing import Any

from intaglio.drawing import Drawing
from intaglio.errors import InputError
from intaglio.io.plates import check_output, write_whole
from intaglio.io.png import png_of_pixels
from intaglio.io.raster import drawing_bytes8

MOVING = (".gif", ".png")
# Between paper and ink; more only make the file larger.
COLOURS = 32


def save_moving(drawings: Iterable[Drawing], path: str | PathLike[str], *, dpi: float = 150.0, rate: float = 12.0) -> int:
    """Write .gif, an animated .png, or a folder of 0001.png, 0002.png ...; returns the number of drawings.

    rate  pictures a second. Drawings are taken one by one; a file appears only when it is complete. InputError as
    `check_output`, for no drawings, and for a rate outside 1..50.
    """
    if not 1 <= rate <= 50:
        raise InputError(f"rate must be between 1 and 50 pictures a second, not {rate!r}")
    target = check_moving(path)
    if not target.suffix:
        count = 0
        for drawing in drawings:
            count += 1
            write_whole(target / f"{count:04d}.png", png_of_pixels(drawing_bytes8(drawing, dpi), dpi))
        return count
    pictures = [_indexed(drawing_bytes8(drawing, dpi)) for drawing in drawings]
    if not pictures:
        raise InputError("there is nothing to save: no drawings")
    file = io.BytesIO()
    kind = "GIF" if target.suffix.lower() == ".gif" else "PNG"
    pictures[0].save(file, kind, save_all=True, append_images=pictures[1:], duration=round(1000 / rate), loop=0)
    write_whole(target, file.getvalue())
    return len(pictures)


def check_moving(path: str | PathLike[str]) -> Path:
    """The path, if such a file can be written there, or if it is a folder, which is made if it does not exist."""
    target = Path(path)
    if target.suffix:
        return check_output(target, MOVING)
    try:
        target.mkdir(parents=True, exist_ok=True)
    except OSError as error:
        raise InputError(f"folder {target} cannot be made: {error.strerror}; choose another") from error
    return check_output(target / "0001.png").parent


def _indexed(pixels: Any) -> Any:
    from PIL import Image as Pillow

    return Pillow.fromarray(pixels).quantize(COLOURS, dither=Pillow.Dither.NONE)
