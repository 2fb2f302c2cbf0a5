"""Drawings one after the other: animated GIF and PNG, or a folder of PNG files."""

# CompuServe, "Graphics Interchange Format", version 89a, 1990.
# W3C, "Portable Network Graphics (PNG) Specification (Third Edition)", 2025: its chunks of animation.

from __future__ import annotations

import os
import struct
import zlib
from collections.abc import Callable, Iterable, Iterator
from os import PathLike
from pathlib import Path
from typing import IO

import numpy as np
from numpy.typing import NDArray

from intaglio.drawing import Drawing
from intaglio.errors import InputError
from intaglio.io.plates import check_output, whole, write_whole
from intaglio.io.png import SIGNATURE, chunk, header, png_of_pixels
from intaglio.io.raster import drawing_bytes8

Pixels = NDArray[np.uint8]

MOVING = (".gif", ".png")
# Between paper and ink; more only make the file larger.
COLOURS = 32


def save_moving(drawings: Iterable[Drawing], path: str | PathLike[str], *, dpi: float = 150.0, rate: float = 12.0) -> int:
    """Write .gif, an animated .png, or a folder of 0001.png, 0002.png ...; returns the number of drawings.

    rate  pictures a second. Drawings are taken and written one by one, so that memory does not grow with their number; a file
    appears only when it is complete. InputError as `check_output`, for no drawings, for drawings of several sizes in one
    file, and for a rate outside 1..50.
    """
    if not 1 <= rate <= 50:
        raise InputError(f"rate must be between 1 and 50 pictures a second, not {rate!r}")
    target = check_moving(path)
    pictures = (drawing_bytes8(drawing, dpi) for drawing in drawings)
    if not target.suffix:
        count = 0
        for count, pixels in enumerate(pictures, 1):
            target.mkdir(parents=True, exist_ok=True)
            write_whole(target / f"{count:04d}.png", png_of_pixels(pixels, dpi))
        return count
    write: Callable[[IO[bytes], Iterator[Pixels], float], int] = _gif if target.suffix.lower() == ".gif" else _png
    with whole(target) as file:
        return write(file, _of_one_size(pictures), rate)


def check_moving(path: str | PathLike[str]) -> Path:
    """The path, if such a file can be written there, or if it is a folder, or one that can be made."""
    target = Path(path)
    if target.suffix:
        return check_output(target, MOVING)
    there = next(folder for folder in (target, *target.absolute().parents) if folder.exists())
    if not (there.is_dir() and os.access(there, os.W_OK | os.X_OK)):
        raise InputError(f"folder {target} cannot be made: {there} is no folder to write in; choose another")
    return target


def _of_one_size(pictures: Iterable[Pixels]) -> Iterator[Pixels]:
    first = None
    for pixels in pictures:
        first = first or pixels.shape
        if pixels.shape != first:
            raise InputError(f"drawings of a moving picture must be equally large, not {pixels.shape[1::-1]} and {first[1::-1]}")
        yield pixels
    if first is None:
        raise InputError("there is nothing to save: no drawings")


def _gif(file: IO[bytes], pictures: Iterator[Pixels], rate: float) -> int:
    """Each picture whole, with a table of its own colours."""
    from PIL import GifImagePlugin, Image as Pillow

    count = 0
    for count, pixels in enumerate(pictures, 1):
        if count == 1:
            height, width = pixels.shape[:2]
            file.write(struct.pack("<6sHHBBB", b"GIF89a", width, height, 0, 0, 0))
            file.write(b"\x21\xff\x0bNETSCAPE2.0\x03\x01\x00\x00\x00")  # for ever
        indexed = Pillow.fromarray(pixels).quantize(COLOURS, dither=Pillow.Dither.NONE)
        file.writelines(GifImagePlugin.getdata(indexed, duration=round(1000 / rate), include_color_table=True))
    file.write(b";")
    return count


def _png(file: IO[bytes], pictures: Iterator[Pixels], rate: float) -> int:
    """Each picture whole; their number, which stands before them, is known behind them."""
    count = number = 0

    def numbered(data: bytes) -> bytes:
        nonlocal number
        number += 1
        return struct.pack(">I", number - 1) + data

    for count, pixels in enumerate(pictures, 1):
        height, width = pixels.shape[:2]
        if count == 1:
            file.write(SIGNATURE + header(width, height, 8, 3))
            at = file.tell()
            file.write(chunk(b"acTL", bytes(8)))
        time = struct.pack(">HHBB", round(1000 / rate), 1000, 0, 0)
        file.write(chunk(b"fcTL", numbered(struct.pack(">IIII", width, height, 0, 0) + time)))
        rows = np.zeros((height, 1 + 3 * width), dtype=np.uint8)
        rows[:, 1:] = pixels.reshape(height, -1)
        data = zlib.compress(rows.tobytes(), 6)
        file.write(chunk(b"IDAT", data) if count == 1 else chunk(b"fdAT", numbered(data)))
    file.write(chunk(b"IEND", b""))
    file.seek(at)
    file.write(chunk(b"acTL", struct.pack(">II", count, 0)))
    return count
