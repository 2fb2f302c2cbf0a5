"""The squared distance from a point to a triangle, so written that a loop over points or over triangles becomes vector code."""

# C. Sigg, R. Peikert, M. Gross, "Signed distance transform using graphics hardware", 2003: a triangle's own frame, its origin
# at the foot of the height on the longest side, r along that side, s along the height, t along the normal.

from __future__ import annotations

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import helper

# A frame: the axes r, s, t (9); what to add to a point's products with them (3); where the base ends to the left and right
# of the height (2); per side, the unit vector from the base's end to the apex, for a side that lies to the right, and the
# side's length (2 x 3).
FRAME = 20
ZERO = np.float32(0.0)


def frames_of(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, FRAME) float64 frames of triangles (n, 3, 3); those without area become segments or points."""
    sides = np.linalg.norm(np.roll(corners, -1, axis=1) - corners, axis=2)
    turn = (sides.argmax(axis=1)[:, None] + np.arange(3)) % 3
    p, q, apex = np.moveaxis(np.take_along_axis(corners, turn[..., None], axis=1), 1, 0)
    base = sides.max(axis=1)
    r = _unit(q - p, np.array([1.0, 0.0, 0.0]))
    right = np.einsum("ij,ij->i", apex - p, r)
    foot = p + right[:, None] * r
    # Any vector that stands on r will do where there is no height.
    spare = np.cross(r, np.eye(3)[np.abs(r).argmin(axis=1)])
    s = _unit(apex - foot, spare / np.linalg.norm(spare, axis=1)[:, None])
    s = _unit(s - np.einsum("ij,ij->i", s, r)[:, None] * r, s)
    height = np.maximum(np.einsum("ij,ij->i", apex - foot, s), 0.0)
    axes = np.stack([r, s, np.cross(r, s)], axis=1)
    out = np.empty((len(corners), FRAME))
    out[:, :9] = axes.reshape(-1, 9)
    out[:, 9:12] = -np.einsum("nij,nj->ni", axes, foot)
    for side, end in enumerate((np.clip(right, 0, base), np.clip(base - right, 0, base))):
        rise = np.stack([-end, height], axis=1)
        out[:, 12 + side] = end
        out[:, 14 + 3 * side : 16 + 3 * side] = _unit(rise, np.array([0.0, 1.0]))
        out[:, 16 + 3 * side] = np.linalg.norm(rise, axis=1)
    return out


def _unit(vectors: NDArray[np.float64], instead: NDArray[np.float64]) -> NDArray[np.float64]:
    length = np.linalg.norm(vectors, axis=1)[:, None]
    return np.where(length > 0, vectors / np.where(length > 0, length, 1.0), instead)


@helper
def squared_distance(r, s, t, left, right, lx, ly, ll, rx, ry, rl, slack):  # type: ignore[no-untyped-def]
    """From (r, s, t) of a triangle's frame. By symmetry only one side counts, that on which the point lies.

    slack is what rounding may have done to r and s: points count as over the triangle only where they surely are, or
    else those beyond the end of a needle would.
    """
    mirrored = r < ZERO
    x = abs(r) - (left if mirrored else right)
    ux, uy, length = lx if mirrored else rx, ly if mirrored else ry, ll if mirrored else rl
    beyond = max(x, ZERO)
    along = ux * x + uy * s
    across = uy * x - ux * s
    rest = along - min(max(along, ZERO), length)
    flat = min(beyond * beyond + s * s, rest * rest + across * across)
    return (ZERO if max(-s, across) < -slack else flat) + t * t


@helper
def nearest_place(f, x, y, z):  # type: ignore[no-untyped-def]
    """The point of a triangle, given by its frame, that is nearest to (x, y, z)."""
    r = f[0] * x + f[1] * y + f[2] * z + f[9]
    s = f[3] * x + f[4] * y + f[5] * z + f[10]
    t = f[6] * x + f[7] * y + f[8] * z + f[11]
    k = 0 if r < 0 else 1
    end, ux, uy, length = f[12 + k], f[14 + 3 * k], f[15 + 3 * k], f[16 + 3 * k]
    g = abs(r) - end
    across = uy * g - ux * s
    nr, ns = abs(r), s
    if not (s > 0 and across < 0):
        rest = min(max(ux * g + uy * s, 0.0), length)
        nr, ns = end + rest * ux, rest * uy
        base = min(abs(r), end)
        if (abs(r) - base) ** 2 + s * s < (abs(r) - nr) ** 2 + (s - ns) ** 2:
            nr, ns = base, 0.0
    # How far to go from the point, along each axis.
    dr, ds = (-nr if r < 0 else nr) - r, ns - s
    return x + dr * f[0] + ds * f[3] - t * f[6], y + dr * f[1] + ds * f[4] - t * f[7], z + dr * f[2] + ds * f[5] - t * f[8]
