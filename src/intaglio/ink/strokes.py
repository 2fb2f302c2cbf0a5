"""From streamlines and contours to strokes: cut by tone, tapered, weighted."""

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.drawing import Strokes

Floats = NDArray[np.float32]


def sample(image: Floats, points: Floats) -> Floats:
    """Bilinear values of an image (h, w) at points (n, 2) in pixels, pixel centres at +0.5."""
    h, w = image.shape
    x = np.clip(points[:, 0] - 0.5, 0, w - 1)
    y = np.clip(points[:, 1] - 0.5, 0, h - 1)
    i, j = np.minimum(x.astype(np.int64), max(w - 2, 0)), np.minimum(y.astype(np.int64), max(h - 2, 0))
    i2, j2 = np.minimum(i + 1, w - 1), np.minimum(j + 1, h - 1)
    u, v = (x - i).astype(np.float32), (y - j).astype(np.float32)
    top = image[j, i] * (1 - u) + image[j, i2] * u
    low = image[j2, i] * (1 - u) + image[j2, i2] * u
    return (top * (1 - v) + low * v).astype(np.float32)


def line_of(offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) the line that each point belongs to."""
    return np.repeat(np.arange(len(offsets) - 1), np.diff(offsets))


def arc_length(points: Floats, offsets: NDArray[np.int64]) -> Floats:
    """(n,) length along each line from its first point."""
    if len(points) == 0:
        return np.zeros(0, dtype=np.float32)
    step = np.zeros(len(points))
    step[1:] = np.linalg.norm(np.diff(points.astype(np.float64), axis=0), axis=1)
    step[offsets[:-1]] = 0.0
    total = np.cumsum(step)
    return (total - np.repeat(total[offsets[:-1]], np.diff(offsets))).astype(np.float32)


def runs(keep: NDArray[np.bool_], offsets: NDArray[np.int64], least: int = 2) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Cut lines where `keep` is false: indices of the points that stay, and their offsets; runs under `least` go too."""
    n = len(keep)
    if n == 0:
        return np.zeros(0, dtype=np.int64), np.zeros(1, dtype=np.int64)
    starts_line = np.zeros(n, dtype=bool)
    starts_line[offsets[:-1]] = True
    begins = keep & (starts_line | ~np.concatenate([[False], keep[:-1]]))
    run = np.cumsum(begins) - 1
    size = np.bincount(run[keep], minlength=int(begins.sum()))
    stays = keep.copy()
    stays[keep] = size[run[keep]] >= max(least, 2)
    index = np.flatnonzero(stays)
    return index, np.concatenate([[0], np.cumsum(size[size >= max(least, 2)])]).astype(np.int64)


def _chance(rng: np.random.Generator, number: NDArray[np.int64] | None, lines: int, many: int) -> NDArray[np.float64]:
    """(lines, many) numbers from 0 to 1, in each row those that belong to the line's number."""
    if number is None:
        return rng.random((lines, many))
    return rng.random((int(number.max(initial=-1)) + 1, many))[number]


def lifted(
    along: Floats, offsets: NDArray[np.int64], longest: float, rng: np.random.Generator, number: NDArray[np.int64] | None = None
) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Break lines into pieces of about `longest` that overlap a little, as a hand does: indices of points, and offsets.

    along is the arc length of each point, in the unit of `longest`; number (m,) tells lines whose chance is to be the same in
    every call from others.
    """
    total = along[offsets[1:] - 1]
    # A piece has a few points at least.
    longest = max(longest, 8.0 * float(total.sum()) / len(along))
    pieces = np.maximum(1, np.round(total / longest)).astype(np.int64)
    line = np.repeat(np.arange(len(pieces)), pieces)
    piece = np.arange(len(line)) - np.repeat(np.cumsum(pieces) - pieces, pieces)
    chance = _chance(rng, number, len(pieces), 16)[line, piece % 16]
    cut = (piece + np.where(piece > 0, 0.5 * chance - 0.25, 0.0)) / pieces[line] * total[line]
    until = np.append(cut[1:], 0.0)
    last = piece == pieces[line] - 1
    until[last] = total[line[last]] + 1.0
    overlap = (0.06 + 0.1 * (7.0 * chance % 1.0)) * longest
    # Lines one after the other on one axis, so that one search finds every piece's points.
    span = float(total.max()) + 4.0 * longest
    axis = along.astype(np.float64) + span * line_of(offsets)
    begin = np.searchsorted(axis, np.maximum(cut, 0.0) + span * line - 1e-9)
    end = np.searchsorted(axis, np.minimum(until + np.where(last, 0.0, overlap), total[line] + 1.0) + span * line)
    count = end - begin
    keep = count >= 2
    begin, count = begin[keep], count[keep]
    packed = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    return np.repeat(begin - packed[:-1], count) + np.arange(packed[-1]), packed


def reversed_where(flip: NDArray[np.bool_], offsets: NDArray[np.int64]) -> NDArray[np.int64]:
    """(n,) indices that turn round the lines marked in `flip` (m,)."""
    index = np.arange(offsets[-1])
    turned = np.repeat(offsets[:-1] + offsets[1:] - 1, np.diff(offsets)) - index
    return np.where(np.repeat(flip, np.diff(offsets)), turned, index)


def taper(points: Floats, offsets: NDArray[np.int64], begin: Floats | float, end: Floats | float) -> Floats:
    """(n,) factor that rises from 0 over the first `begin` and falls to 0 over the last `end` units of each line.

    begin and end may be given for each line; 0 leaves that end blunt. Lines shorter than both keep their proportions.
    """
    along = arc_length(points, offsets)
    if len(along) == 0:
        return along
    count = np.diff(offsets)
    total = along[offsets[1:] - 1]
    begin, end = np.broadcast_to(begin, total.shape), np.broadcast_to(end, total.shape)
    shrink = np.minimum(1.0, total / np.maximum(begin + end, 1e-6))
    rise, fall = np.repeat(np.maximum(begin * shrink, 1e-6), count), np.repeat(np.maximum(end * shrink, 1e-6), count)
    blunt_begin, blunt_end = np.repeat(begin == 0, count), np.repeat(end == 0, count)
    up = np.where(blunt_begin, 1.0, np.minimum(along / rise, 1.0))
    down = np.where(blunt_end, 1.0, np.minimum((np.repeat(total, count) - along) / fall, 1.0))
    both = up * down
    return np.sqrt(both * (2.0 - both)).astype(np.float32)


def weight_by_light(light: Floats, bright: bool = False) -> Floats:
    """Factor of a contour's width: heavier in the shadow; on dark paper, with `bright` ink, in the light."""
    return (0.7 + 0.45 * light if bright else 1.15 - 0.45 * light).astype(np.float32)


def wander(
    offsets: NDArray[np.int64],
    along: Floats,
    amplitude: float,
    wavelength: float,
    rng: np.random.Generator,
    number: NDArray[np.int64] | None = None,
) -> Floats:
    """(n,) slow random sideways movement of a hand, of about `amplitude`, different for each line, or number of a line."""
    line = line_of(offsets)
    chance = _chance(rng, number, len(offsets) - 1, 6)
    phase, pitch = 2 * np.pi * chance[:, :3].T, (0.6 + chance[:, 3:].T) / wavelength
    total = sum(np.sin(2 * np.pi * along * pitch[k][line] * (k + 1) / 2 + phase[k][line]) / (k + 1) for k in range(3))
    return np.asarray(amplitude * 0.6 * total, dtype=np.float32)


def sideways(points: Floats, offsets: NDArray[np.int64]) -> Floats:
    """(n, 2) unit normals of lines, by central differences within each line."""
    n = len(points)
    if n == 0:
        return np.zeros((0, 2), dtype=np.float32)
    before, after = np.arange(n) - 1, np.arange(n) + 1
    before[offsets[:-1]] += 1
    after[offsets[1:] - 1] -= 1
    along = points[after] - points[before]
    length = np.maximum(np.linalg.norm(along, axis=1, keepdims=True), 1e-9)
    return np.stack([-along[:, 1], along[:, 0]], axis=1) / length


def pack(points: Floats, width: Floats, opacity: Floats, offsets: NDArray[np.int64]) -> Strokes:
    """Strokes from float arrays of any precision."""
    return Strokes(
        np.ascontiguousarray(points, dtype=np.float32),
        np.ascontiguousarray(width, dtype=np.float32),
        np.ascontiguousarray(opacity, dtype=np.float32),
        np.ascontiguousarray(offsets, dtype=np.int64),
    )


def smoothed(values: Floats, offsets: NDArray[np.int64], passes: int) -> Floats:
    """Values (n,) or (n, k) averaged with their neighbours (1 2 1) `passes` times within each line; ends stay."""
    if len(values) < 3:
        return values
    inner = np.ones(len(values), dtype=bool)
    inner[offsets[:-1]] = False
    inner[offsets[1:] - 1] = False
    middle = np.flatnonzero(inner)
    out = values.astype(np.float32, copy=True)
    for _ in range(passes):
        out[middle] = 0.25 * out[middle - 1] + 0.5 * out[middle] + 0.25 * out[middle + 1]
    return out
