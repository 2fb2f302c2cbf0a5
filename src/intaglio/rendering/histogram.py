"""Pictures of transfer functions, over the histogram of the volume that they are for."""

from __future__ import annotations

import html
import math
import zlib
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.errors import InputError
from intaglio.transfer_function import TransferFunction
from intaglio.volume import Volume

Floats = NDArray[np.float64]

SAMPLES = 1_000_000
LEFT, RIGHT, TOP, BOTTOM = 18.0, 10.0, 10.0, 38.0
BAND = 12.0


def sampled(volume: Volume, count: int = SAMPLES) -> Floats:
    """Some of the volume's finite values (n,): of every so many voxels along each axis one, not many more than `count`."""
    stride = max(1, math.ceil((volume.array.size / count) ** (1 / 3)))
    values = volume.array[::stride, ::stride, ::stride].astype(np.float64).ravel()
    return values[np.isfinite(values)]


def _shown(function: TransferFunction, values: Floats) -> tuple[float, float]:
    """The values from left to right: all points, all of the volume, and a margin."""
    low, high = function.points[0].value, function.points[-1].value
    if len(values):
        low, high = min(low, float(values.min())), max(high, float(values.max()))
    margin = 0.04 * (high - low) if high - low > 1e-300 else max(0.5, 0.01 * abs(low))
    return (low - margin, high + margin) if math.isfinite(high - low + 2 * margin) else (low, high)


def _ticks(low: float, high: float) -> list[float]:
    rough = (high - low) / 6
    decade = 10.0 ** math.floor(math.log10(rough))
    step = next((m * decade for m in (1, 2, 5) if m * decade >= rough), 10 * decade)
    return [i * step for i in range(math.ceil(low / step), math.floor(high / step) + 1)]


def _hex(rgb: Floats) -> str:
    r, g, b = np.rint(255 * rgb[:3]).astype(int).tolist()
    return f"#{r:02x}{g:02x}{b:02x}"


def _path(x: Floats, y: Floats) -> str:
    return "M" + "L".join(f"{a:.1f} {b:.1f}" for a, b in zip(x.tolist(), y.tolist(), strict=True))


def picture(function: TransferFunction, volume: Volume | None = None, *, width: int = 480, height: int = 200) -> str:
    """SVG: opacity over value in the function's colours, its points, a band of the colours and the values' axis.

    volume         its histogram, with logarithmic counts, stands behind
    width, height  of the picture in pixels
    """
    if not (width >= 120 and height >= 80):
        raise InputError(f"picture must be 120 x 80 pixels or larger, not {width!r} x {height!r}")
    values = sampled(volume) if volume else np.empty(0)
    low, high = _shown(function, values)
    right, floor = width - RIGHT, height - BOTTOM
    knots, rgba = function.knots

    def across(v: ArrayLike) -> Any:
        return LEFT + (np.asarray(v) - low) / (high - low) * (right - LEFT)

    x = np.concatenate([[LEFT], across(knots), [right]])
    y = floor - np.concatenate([rgba[:1, 3], rgba[:, 3], rgba[-1:, 3]]) * (floor - TOP)
    stops = zip(((x[1:-1] - LEFT) / (right - LEFT)).tolist(), rgba, strict=True)
    gradient = "".join(f'<stop offset="{at:.5f}" stop-color="{_hex(colour)}"/>' for at, colour in stops)
    # A page may show many of these, and their ids share one space.
    name = f"colours-{zlib.crc32(f'{gradient} {width}'.encode()):08x}"
    title = html.escape("".join(c for c in function.name if c.isprintable()))
    parts = [
        f'<svg xmlns="http://www.w3.org/2000/svg" width="{width}" height="{height}" viewBox="0 0 {width} {height}">',
        f"<title>{title}</title>",
        f'<linearGradient id="{name}" gradientUnits="userSpaceOnUse" x1="{LEFT}" x2="{right}">{gradient}</linearGradient>',
        f'<rect width="{width}" height="{height}" fill="#ffffff"/>',
    ]
    if len(values):
        counts, edges = np.histogram(values, bins=max(16, int(right - LEFT) // 2), range=(low, high))
        tall = np.log1p(counts) / np.log1p(counts.max())
        sides = np.repeat(across(edges), 2)
        tops = floor - np.concatenate([[0.0], np.repeat(tall, 2), [0.0]]) * (floor - TOP)
        parts.append(f'<path d="{_path(sides, tops)}z" fill="#dedede"/>')
    corners = f"L{right:.1f} {floor:.1f}L{LEFT:.1f} {floor:.1f}z"
    parts += [
        f'<path d="{_path(x, y)}{corners}" fill="url(#{name})" fill-opacity="0.6"/>',
        f'<path d="{_path(x, y)}" fill="none" stroke="#333333" stroke-width="1.5" stroke-linejoin="round"/>',
        f'<path d="M{LEFT} {TOP}V{floor}H{right}" fill="none" stroke="#888888"/>',
        f'<rect x="{LEFT}" y="{floor + 4}" width="{right - LEFT}" height="{BAND}" fill="url(#{name})"/>',
    ]
    for value, colour, opacity in function.points:
        place = f'cx="{across(value):.1f}" cy="{floor - opacity * (floor - TOP):.1f}"'
        parts.append(f'<circle {place} r="3.5" fill="{_hex(np.array(colour))}" stroke="#333333"/>')
    parts.append('<g font-family="sans-serif" font-size="10" fill="#333333" text-anchor="middle">')
    parts += [f'<text x="{LEFT - 8}" y="{at + 3:.1f}">{label}</text>' for at, label in ((floor, "0"), (TOP, "1"))]
    for value in _ticks(low, high):
        mark = f"{across(value):.1f}"
        parts.append(f'<path d="M{mark} {floor + 4 + BAND}v4" stroke="#888888"/>')
        parts.append(f'<text x="{mark}" y="{floor + BAND + 18}">{value:.6g}</text>')
    return "\n".join([*parts, "</g>", "</svg>\n"])
