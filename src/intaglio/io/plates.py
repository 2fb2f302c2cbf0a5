"""Saving drawings and images: by extension, whole or not at all."""

from __future__ import annotations

import os
import secrets
from collections.abc import Iterator, Sequence
from contextlib import contextmanager
from os import PathLike
from pathlib import Path
from typing import IO

from intaglio.drawing import Drawing, Image
from intaglio.errors import InputError

PLATES = (".svg", ".pdf", ".png")


def save_drawing(drawing: Drawing, path: str | PathLike[str], *, dpi: float = 300.0, plotter: bool = False) -> None:
    """Write .svg, .pdf or .png; dpi (10..2400) is for PNG, plotter for SVG. InputError as check_output."""
    target = check_output(path)
    extension = target.suffix.lower()
    if plotter and extension != ".svg":
        raise InputError(f"plotter output must be .svg, not {target.name!r}")
    if extension == ".svg":
        from intaglio.io.svg import svg_text

        data = svg_text(drawing, plotter=plotter).encode()
    elif extension == ".pdf":
        from intaglio.io.pdf import pdf_bytes

        data = pdf_bytes(drawing)
    else:
        from intaglio.io.png import png_of_pixels
        from intaglio.io.raster import drawing_bytes8

        data = png_of_pixels(drawing_bytes8(drawing, dpi), dpi)
    write_whole(target, data)


def save_image(image: Image, path: str | PathLike[str], *, bits: int = 8) -> None:
    """Write .png of 8 or 16 bits. InputError as check_output."""
    from intaglio.io.png import png_bytes

    target = check_output(path, (".png",))
    write_whole(target, png_bytes(image, bits))


def check_output(path: str | PathLike[str], kinds: Sequence[str] = PLATES) -> Path:
    """The path, if a file of one of these extensions can be written there; meant to be called before long work.

    InputError for another extension, a missing folder, a folder in the file's place, or one that must not be written.
    """
    target = Path(path)
    try:
        folder = target.is_dir()
    except OSError as error:
        raise InputError(f"{target} cannot be written: {error.strerror}") from error
    if folder:
        raise InputError(f"{target} is a folder: name a file in it, ending in {_either(kinds)}")
    if target.suffix.lower() not in kinds:
        raise InputError(f"output must end in {_either(kinds)}, not {target.name!r}")
    if not target.parent.is_dir():
        raise InputError(f"output folder {target.parent} does not exist: create it first")
    if not os.access(target.parent, os.W_OK | os.X_OK):
        raise InputError(f"output folder {target.parent} is not writable: choose another or change its permissions")
    if target.exists() and not os.access(target, os.W_OK):
        raise InputError(f"{target} is write-protected: choose another name or change its permissions")
    return target


def write_whole(target: Path, data: bytes) -> None:
    """Write a file that appears under its name only when it is complete."""
    with whole(target) as file:
        file.write(data)


@contextmanager
def whole(target: Path) -> Iterator[IO[bytes]]:
    """A file to write to, which appears under its name when it is complete, and not at all if anything goes wrong."""
    # Opened with mode "x" instead of tempfile's, so that the umask decides who may read it.
    partial = target.with_name(f".{secrets.token_hex(6)}.partial")
    try:
        with open(partial, "xb") as file:
            yield file
        os.replace(partial, target)
    except OSError as error:
        raise InputError(f"{target} cannot be written: {error.strerror}") from error
    finally:
        partial.unlink(missing_ok=True)


def _either(kinds: Sequence[str]) -> str:
    return " or ".join([", ".join(kinds[:-1]), kinds[-1]]) if len(kinds) > 1 else kinds[0]
