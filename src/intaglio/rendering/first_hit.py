"""The first crossing of an isovalue along a ray, block by block."""

# M. Levoy, "Efficient ray tracing of volume data", 1990 (skipping empty blocks).

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import helper, kernel
from intaglio.rendering.cutting import kept
from intaglio.rendering.skipping import BLOCK, SURFACE
from intaglio.sampling import trilinear

# Voxels between samples on a ray inside a block that can hold the surface.
STEP = 0.5


@helper
def clip(o, d, n, near, far):  # type: ignore[no-untyped-def]
    """Part of the ray between the planes 0 and n - 1 of one axis."""
    if abs(d) < 1e-12:
        if o < 0.0 or o > n - 1.0:
            return 1.0, 0.0
        return near, far
    a = (0.0 - o) / d
    b = (n - 1.0 - o) / d
    return max(near, min(a, b)), min(far, max(a, b))


@helper
def span(ray, shape, start):  # type: ignore[no-untyped-def]
    """Part of a ray (6,) in index space beyond `start` that lies in a volume of shape (z, y, x); near > far for none."""
    near, far = clip(ray[0], ray[3], shape[2], start, np.inf)
    near, far = clip(ray[1], ray[4], shape[1], near, far)
    return clip(ray[2], ray[5], shape[0], near, far)


@helper
def leave(o, d, cell, t):  # type: ignore[no-untyped-def]
    """Where the ray leaves a block's slab of one axis."""
    if d > 1e-12:
        return ((cell + 1) * BLOCK - o) / d
    if d < -1e-12:
        return (cell * BLOCK - o) / d
    return np.inf


@helper
def next_block(ray, shape, t, nudge):  # type: ignore[no-untyped-def]
    """The block a ray is in just behind t, and where it leaves it."""
    bx = min(max(int(ray[0] + (t + nudge) * ray[3]), 0), shape[2] - 2) // BLOCK
    by = min(max(int(ray[1] + (t + nudge) * ray[4]), 0), shape[1] - 2) // BLOCK
    bz = min(max(int(ray[2] + (t + nudge) * ray[5]), 0), shape[0] - 2) // BLOCK
    until = min(leave(ray[0], ray[3], bx, t), leave(ray[1], ray[4], by, t), leave(ray[2], ray[5], bz, t))
    return bz, by, bx, max(until, t + nudge)


@helper
def _inside(voxels, iso, sign, heads, data, x, y, z):  # type: ignore[no-untyped-def]
    """Positive inside the body and where no tool has cut it away."""
    f = sign * (trilinear(voxels, x, y, z) - iso)
    return min(f, kept(heads, data, x, y, z)) if heads.shape[0] > 0 else f


@kernel
def first_hit(voxels, blocks, iso, sign, heads, data, ray, start):  # type: ignore[no-untyped-def]
    """Depth at which sign * (value - iso) first reaches 0 beyond `start`, inf for none; and whether it begins inside.

    heads and data are of `packed_selections`. ray (6,) is origin and direction in index space. Trilinear; exact to about
    1e-5 voxel.
    """
    ox, oy, oz, dx, dy, dz = ray[0], ray[1], ray[2], ray[3], ray[4], ray[5]
    near, far = span(ray, voxels.shape, start)
    if not near <= far:
        return np.inf, False
    t = near
    length = math.sqrt(dx * dx + dy * dy + dz * dz)
    dt = STEP / length
    nudge = 1e-6 / length
    bz, by, bx, until = next_block(ray, voxels.shape, t, nudge)
    if blocks[bz, by, bx] and _inside(voxels, iso, sign, heads, data, ox + t * dx, oy + t * dy, oz + t * dz) >= 0.0:
        return t, True
    while t < far:
        bz, by, bx, until = next_block(ray, voxels.shape, t, nudge)
        until = min(until, far)
        if blocks[bz, by, bx] == SURFACE:
            a = t
            fa = _inside(voxels, iso, sign, heads, data, ox + a * dx, oy + a * dy, oz + a * dz)
            while a < until:
                b = min(a + dt, until)
                fb = _inside(voxels, iso, sign, heads, data, ox + b * dx, oy + b * dy, oz + b * dz)
                if fb >= 0.0:
                    # Regula falsi, halving the value that stays (Illinois).
                    for _ in range(24):
                        if b - a < 1e-5 * dt or fb == fa:
                            break
                        m = b - fb * (b - a) / (fb - fa)
                        fm = _inside(voxels, iso, sign, heads, data, ox + m * dx, oy + m * dy, oz + m * dz)
                        if abs(fm) < 1e-7 * abs(iso) + 1e-12:
                            return m, False
                        if fm >= 0.0:
                            b = m
                            fb = fm
                            fa *= 0.5
                        else:
                            a = m
                            fa = fm
                            fb *= 0.5
                    return b, False
                a = b
                fa = fb
        t = until
    return np.inf, False


@helper
def ray_at(rays, px, py, out):  # type: ignore[no-untyped-def]
    """out (6,) = origin and direction of `Camera.rays` at an image position."""
    for c in range(3):
        out[c] = rays[0, c] + px * rays[1, c] + py * rays[2, c]
        out[3 + c] = rays[3, c] + px * rays[4, c] + py * rays[5, c]
