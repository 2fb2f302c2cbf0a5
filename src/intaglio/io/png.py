"""PNG: 8 bits through Pillow, 16 bits by our own few chunks, which Pillow cannot write in colour."""

# W3C, "Portable Network Graphics (PNG) Specification (Third Edition)", 2025.

from __future__ import annotations

import io
import struct
import zlib
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.drawing import Image
from intaglio.errors import InputError

SIGNATURE = b"\x89PNG\r\n\x1a\n"
COLOUR_TYPE = {1: 0, 3: 2, 4: 6}  # channels -> grey, RGB, RGBA


def png_bytes(image: Image, bits: int = 8) -> bytes:
    """The file's bytes; grey and opaque pictures are stored as such. bits is 8 or 16."""
    if bits == 8:
        return png_of_pixels(image.bytes8, image.dpi)
    if bits != 16:
        raise InputError(f"bits must be 8 or 16, not {bits!r}")
    return _png16(_least_channels((np.clip(image.array, 0.0, 1.0) * 65535.0 + 0.5).astype(np.uint16)), image.dpi)


def png_of_pixels(pixels: NDArray[np.uint8], dpi: float) -> bytes:
    """A file of (height, width, 3 or 4) uint8."""
    from PIL import Image as Pillow

    pixels = _least_channels(pixels)
    file = io.BytesIO()
    picture = Pillow.fromarray(pixels[:, :, 0] if pixels.shape[2] == 1 else pixels)
    picture.save(file, "PNG", dpi=(dpi, dpi))
    return file.getvalue()


def _least_channels(pixels: NDArray[Any]) -> NDArray[Any]:
    if pixels.shape[2] == 4 and (pixels[:, :, 3] == np.iinfo(pixels.dtype).max).all():
        pixels = pixels[:, :, :3]
    if pixels.shape[2] == 3 and (pixels[:, :, 1:] == pixels[:, :, :1]).all():
        pixels = pixels[:, :, :1]
    return np.ascontiguousarray(pixels)


def _png16(pixels: NDArray[np.uint16], dpi: float) -> bytes:
    height, width, channels = pixels.shape
    rows = np.zeros((height, 1 + 2 * width * channels), dtype=np.uint8)
    data = pixels.astype(">u2").view(np.uint8).reshape(height, -1)
    # Filter "up": a byte less the one above it, which smooth pictures repay.
    rows[:, 0] = 2
    rows[:, 1:] = data
    rows[1:, 1:] -= data[:-1]
    per_metre = round(dpi / 0.0254)
    return b"".join(
        [
            SIGNATURE,
            header(width, height, 16, channels),
            chunk(b"pHYs", struct.pack(">IIB", per_metre, per_metre, 1)),
            chunk(b"IDAT", zlib.compress(rows.tobytes(), 6)),
            chunk(b"IEND", b""),
        ]
    )


def header(width: int, height: int, bits: int, channels: int) -> bytes:
    return chunk(b"IHDR", struct.pack(">IIBBBBB", width, height, bits, COLOUR_TYPE[channels], 0, 0, 0))


def chunk(kind: bytes, data: bytes) -> bytes:
    return struct.pack(">I", len(data)) + kind + data + struct.pack(">I", zlib.crc32(kind + data))
