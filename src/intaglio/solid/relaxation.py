"""relaxed: a field that follows voxels' steps, without them."""

# S. Gibson, "Constrained elastic surface nets", 1998: what relaxes must not leave the voxels at the border.
# V. Lempitsky, "Surface extraction from binary volumes with higher-order smoothness", 2010: of all fields with the signs of the
# voxels the one that bends least. Here: a few steps towards it, and signs that may change where the body is thick.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, frozen, helper, kernel, strips
from intaglio.solid.field import stages
from intaglio.volume import Volume

# Smoothing of thin and of thick parts and gaps, in voxels; thick ones begin at this many voxels from surface to middle. Where
# slices are far apart, steps within them are narrow and those between them wide: the geometric mean with the widest voxel.
FINE, COARSE = 0.8, 2.0
THICK = 1.5
# How often thick parts are smoothed, and how often the volume is then set right.
STEPS, TRIMS = 2, 2
# The part of a voxel's distance that a voxel which must not change sides keeps from the surface.
KEEP = 0.05
# Voxels from the surface up to which a field is smoothed; the side of the tiles it is smoothed in; the least margin round one.
REACH, TILE, RIM = 4, 40, 5
ZERO = np.float32(0.0)
ONE = np.float32(1.0)


@helper
def _load(field, z0, y0, x0, tile):  # type: ignore[no-untyped-def]
    """tile = the field from (z0, y0, x0) on, continued by its border."""
    depth, height, width = tile.shape
    for z in range(depth):
        k = min(max(z0 + z, 0), field.shape[0] - 1)
        for y in range(height):
            row = field[k, min(max(y0 + y, 0), field.shape[1] - 1)]
            for x in range(width):
                tile[z, y, x] = row[min(max(x0 + x, 0), row.size - 1)]


@helper
def _step(tile, axis):  # type: ignore[no-untyped-def]
    """How far neighbours along x, y or z are apart in the flat tile. What loops over it makes of its rim is never used."""
    return 1 if axis == 0 else tile.shape[2] if axis == 1 else tile.shape[1] * tile.shape[2]


@helper
def _convolve(tile, taps, radius, spare):  # type: ignore[no-untyped-def]
    """The tile convolved with taps[axis], which reach radius[axis]; right as far from its rim as these."""
    flat, out = tile.ravel(), spare.ravel()
    for axis in range(3):
        step = _step(tile, axis)
        first, last = radius[axis] * step, flat.size - radius[axis] * step
        out[:] = flat
        for begin in range(first, last, 2048):
            end = min(begin + 2048, last)
            o, here = out[begin:end], flat[begin:end]
            for i in range(o.size):
                o[i] = taps[axis, 0] * here[i]
            for t in range(1, radius[axis] + 1):
                weight, far = taps[axis, t], t * step
                before, after = flat[begin - far : end - far], flat[begin + far : end + far]
                for i in range(o.size):
                    o[i] += weight * (before[i] + after[i])
        flat[:] = out


@helper
def _smooth(tile, taps, radius, twice, spare):  # type: ignore[no-untyped-def]
    """2 G - G G for the Gaussian G = taps[0], G G = taps[1]: keeps quadratic fields, so that round bodies do not shrink."""
    twice[:] = tile
    _convolve(tile, taps[0], radius, spare)
    _convolve(twice, taps[1], radius, spare)
    flat, wide = tile.ravel(), twice.ravel()
    for i in range(flat.size):
        flat[i] += flat[i] - wide[i]


@helper
def _spread(tile, reach, spare):  # type: ignore[no-untyped-def]
    """The largest values of the tile in boxes of that reach."""
    flat, other = tile.ravel(), spare.ravel()
    for axis in range(3):
        other[:] = flat
        for t in range(1, reach[axis] + 1):
            far = t * _step(tile, axis)
            out, before, after = flat[far:-far], other[: -2 * far], other[2 * far :]
            for i in range(out.size):
                out[i] = max(out[i], max(before[i], after[i]))


@helper
def _gather(tile, axis, bits, out):  # type: ignore[no-untyped-def]
    """out gets the bits of a voxel's two neighbours along an axis."""
    far = _step(tile, axis)
    here, before, after = out[far:-far], bits[: -2 * far], bits[2 * far :]
    for i in range(here.size):
        here[i] |= before[i] | after[i]


@helper
def _loosen(tile, side, core, near, hard, loose):  # type: ignore[no-untyped-def]
    """loose = 1 for voxels that may change sides.

    They are at the border, touch a voxel of their side that is not, and none of their side that is but does not: so what is
    up to two voxels wide stays, and stays attached. A side is a bit, so that both go at once.
    """
    flat = tile.ravel()
    n = flat.size
    for i in range(n):
        side[i] = np.uint8(2) if flat[i] < ZERO else np.uint8(1)
        near[i] = np.uint8(0)
    for axis in range(3):
        _gather(tile, axis, side, near)
    for i in range(n):
        core[i] = side[i] if near[i] == side[i] else np.uint8(0)
        loose[i] = near[i] != side[i]
        near[i] = np.uint8(0)
    for axis in range(3):
        _gather(tile, axis, core, near)
    for i in range(n):
        hard[i] = side[i] & ~near[i] & (np.uint8(0) - loose[i])
    for axis in range(3):
        near[:] = hard
        _gather(tile, axis, near, hard)
    for i in range(n):
        loose[i] = np.uint8(loose[i] != 0 and (hard[i] & side[i]) == 0)


@kernel
def _begin(begin, end, field, corners, margin, far, taps, radius, reach, thick, keep, out, share, free, near):  # type: ignore[no-untyped-def]
    """In tiles near the surface: out = the field, a little smoothed; share = how thick body and gaps are; who is free."""
    mx, my, mz = margin
    tile = np.empty((TILE + 2 * mz, TILE + 2 * my, TILE + 2 * mx), np.float32)
    wall, gap, spare = np.empty_like(tile), np.empty_like(tile), np.empty_like(tile)
    bits = tile.size
    side, core, nearby, hard = (
        np.empty(bits, np.uint8),
        np.empty(bits, np.uint8),
        np.empty(bits, np.uint8),
        np.empty(bits, np.uint8),
    )
    loose = np.empty(tile.shape, np.uint8)
    for n in range(begin, end):
        z0, y0, x0 = corners[n]
        z1, y1, x1 = min(z0 + TILE, field.shape[0]), min(y0 + TILE, field.shape[1]), min(x0 + TILE, field.shape[2])
        closest = np.float32(np.inf)
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    closest = min(closest, abs(field[z, y, x]))
        if closest > far:
            continue
        near[n] = 1
        _load(field, z0 - mz, y0 - my, x0 - mx, tile)
        _loosen(tile, side, core, nearby, hard, loose.ravel())
        flat, w, g = tile.ravel(), wall.ravel(), gap.ravel()
        for i in range(flat.size):
            w[i] = -flat[i]
            g[i] = flat[i]
        _spread(wall, reach, spare)
        _spread(gap, reach, spare)
        for i in range(flat.size):
            w[i] = min(max(min(w[i], g[i]) / thick - ONE, ZERO), ONE)
        _convolve(wall, taps[1], radius, spare)
        _smooth(tile, taps, radius, gap, spare)
        for z in range(z0, z1):
            for y in range(y0, y1):
                for x in range(x0, x1):
                    k, j, i = z - z0 + mz, y - y0 + my, x - x0 + mx
                    share[z, y, x] = wall[k, j, i]
                    free[z, y, x] = loose[k, j, i]
                    out[z, y, x] = _bounded(tile[k, j, i], field[z, y, x] < ZERO, free[z, y, x], keep)


@helper
def _bounded(value, inside, free, keep):  # type: ignore[no-untyped-def]
    return value if free else min(value, -keep) if inside else max(value, keep)


@kernel
def _relax(begin, end, field, mask, corners, margin, taps, radius, keep, share, free, out):  # type: ignore[no-untyped-def]
    """out = the field smoothed where it is thick."""
    mx, my, mz = margin
    tile = np.empty((TILE + 2 * mz, TILE + 2 * my, TILE + 2 * mx), np.float32)
    twice, spare = np.empty_like(tile), np.empty_like(tile)
    for n in range(begin, end):
        z0, y0, x0 = corners[n]
        _load(field, z0 - mz, y0 - my, x0 - mx, tile)
        _smooth(tile, taps, radius, twice, spare)
        for z in range(z0, min(z0 + TILE, field.shape[0])):
            for y in range(y0, min(y0 + TILE, field.shape[1])):
                for x in range(x0, min(x0 + TILE, field.shape[2])):
                    value = field[z, y, x]
                    value += share[z, y, x] * (tile[z - z0 + mz, y - y0 + my, x - x0 + mx] - value)
                    out[z, y, x] = _bounded(value, mask[z, y, x] != 0, free[z, y, x], keep)


@kernel
def _measure(begin, end, field, mask, corners, size, sums):  # type: ignore[no-untyped-def]
    """sums[n] = how much more the field's body fills of a tile's cells than the mask's, and its growth per mm; in cells."""
    at = (0.125, 0.375, 0.625, 0.875)
    slope = np.float32(4.0 / size)
    half = np.float32(0.5)
    for n in range(begin, end):
        z0, y0, x0 = corners[n]
        more, growth = np.float64(0.0), np.float64(0.0)
        for z in range(z0, min(z0 + TILE, field.shape[0] - 1)):
            for y in range(y0, min(y0 + TILE, field.shape[1] - 1)):
                for x in range(x0, min(x0 + TILE, field.shape[2] - 1)):
                    inside = set_ = 0
                    for corner in range(8):
                        k, j, i = z + (corner >> 2), y + (corner >> 1 & 1), x + (corner & 1)
                        inside += field[k, j, i] < ZERO
                        set_ += mask[k, j, i] != 0
                    if inside == set_ and inside % 8 == 0:
                        continue
                    more -= set_ / 8.0
                    for w in at:
                        w_ = np.float32(w)
                        a = field[z, y, x] + w_ * (field[z + 1, y, x] - field[z, y, x])
                        b = field[z, y, x + 1] + w_ * (field[z + 1, y, x + 1] - field[z, y, x + 1])
                        c = field[z, y + 1, x] + w_ * (field[z + 1, y + 1, x] - field[z, y + 1, x])
                        d = field[z, y + 1, x + 1] + w_ * (field[z + 1, y + 1, x + 1] - field[z, y + 1, x + 1])
                        for v in at:
                            v_ = np.float32(v)
                            e, f = a + v_ * (c - a), b + v_ * (d - b)
                            for u in at:
                                part = half - (e + np.float32(u) * (f - e)) * slope
                                more += min(max(part, ZERO), ONE) / 64.0
                                growth += slope / 64.0 if ZERO < part < ONE else 0.0
        sums[n, 0] = more
        sums[n, 1] = growth


@kernel
def _shift(begin, end, field, mask, corners, by, keep, free):  # type: ignore[no-untyped-def]
    for n in range(begin, end):
        z0, y0, x0 = corners[n]
        for z in range(z0, min(z0 + TILE, field.shape[0])):
            for y in range(y0, min(y0 + TILE, field.shape[1])):
                for x in range(x0, min(x0 + TILE, field.shape[2])):
                    field[z, y, x] = _bounded(field[z, y, x] + by, mask[z, y, x] != 0, free[z, y, x], keep)


def _taps(sigma: NDArray[np.float64]) -> tuple[NDArray[np.float32], NDArray[np.int64]]:
    """Weights (G or G G, axis, distance) of a Gaussian and of the same one twice; and their reach."""
    radius = np.ceil(2.8 * math.sqrt(2.0) * sigma).astype(np.int64)
    taps = np.zeros((2, 3, int(radius.max()) + 1))
    for axis, (s, r) in enumerate(zip(sigma, radius, strict=True)):
        x = np.arange(-r, r + 1)
        twice = np.exp(-0.25 * (x / s) ** 2)
        twice /= twice.sum()
        # The wide one ends early: the narrow one has half its variance.
        for _ in range(8):
            once = np.exp(-0.5 * (x / s) ** 2)
            once /= once.sum()
            s *= math.sqrt(0.5 * (twice * x * x).sum() / (once * x * x).sum())
        taps[:, axis, : r + 1] = once[r:], twice[r:]
    return taps.astype(np.float32), radius


def _corners(shape: tuple[int, int, int]) -> NDArray[np.int64]:
    """The first voxel (z, y, x) of every tile."""
    grid = np.meshgrid(*(np.arange(0, n, TILE) for n in shape), indexing="ij")
    return np.stack([g.ravel() for g in grid], axis=1).astype(np.int64)


def _margin(*reaches: NDArray[np.int64]) -> tuple[int, int, int]:
    x, y, z = (int(n) for n in np.maximum(RIM, np.max(reaches, axis=0)))
    return x, y, z


def relaxed(field: Volume, progress: Progress | None = None) -> Volume:
    """Signed distances of a mask, smoothed round their surface until the mask's steps are gone; the volume stays.

    Smoothed over two voxels, less where body or gap is thin. What is up to two voxels wide keeps the sides of its voxels. The
    field's array is overwritten.
    """
    start = field.array
    mask = frozen((start < 0).view(np.uint8))
    spacing = field.spacing
    widest = float(spacing.max())
    keep = np.float32(KEEP * spacing.min())
    begin, *relax, trim = stages(progress, STEPS + 2)
    corners = _corners(field.shape)
    near = np.zeros(len(corners), dtype=np.uint8)
    here, there = frozen(start), start.copy()
    share, free = np.zeros_like(start), np.zeros(field.shape, dtype=np.uint8)
    taps, radius = _taps(FINE * np.sqrt(widest / spacing))
    reach = np.ceil(3.0 * widest / spacing).astype(np.int64)
    strips(
        _begin, len(corners), here, corners, _margin(radius + reach), np.float32(REACH * widest), taps, radius, reach,
        np.float32(THICK * widest), keep, there, share, free, near, progress=begin,
    )  # fmt: skip
    corners = corners[near > 0]
    taps, radius = _taps(COARSE * np.sqrt(widest / spacing))
    other = start
    for stage in relax:
        strips(
            _relax, len(corners), frozen(there), mask, corners, _margin(radius), taps, radius, keep, share, free, other,
            progress=stage,
        )  # fmt: skip
        there, other = other, there
    size = float(np.prod(spacing) ** (1 / 3))
    sums = np.zeros((len(corners), 2))
    for stage in stages(trim, TRIMS):
        strips(_measure, len(corners), frozen(there), mask, corners, size, sums, progress=stage)
        more, growth = sums.sum(axis=0)
        by = np.float32(np.clip(more / growth, -0.1 * size, 0.1 * size) if growth else 0.0)
        strips(_shift, len(corners), there, mask, corners, by, keep, free)
    return Volume(there, field.world_from_index, field.name, distances=True)
