"""The squared distance from a point to a triangle, so written that a loop over points or over triangles becomes vector code."""

# C. Sigg, R. Peikert, M. Gross, "Signed distance transform using graphics hardware", 2003: a triangle's own frame, its origin
# at the foot of the height on the longest side, r along that side, s along the height, t along the normal.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import frozen, helper, kernel, strips

# A frame: the axes r, s, t (9); what to add to a point's products with them (3); where the base ends to the left and right
# of the height (2); per side, the unit vector from the base's end to the apex, for a side that lies to the right, and the
# side's length (2 x 3).
FRAME = 20
ZERO = np.float32(0.0)


@helper
def _unit(x, y, z, ex, ey, ez):  # type: ignore[no-untyped-def]
    """A vector of length one, or another instead of one without length."""
    length = math.sqrt(x * x + y * y + z * z)
    return (x / length, y / length, z / length) if length > 0 else (ex, ey, ez)


@helper
def frame_of(ax, ay, az, bx, by, bz, cx, cy, cz, f):  # type: ignore[no-untyped-def]
    """f = the frame of the triangle a, b, c; one without area becomes a segment or a point. All float64."""
    ab = (bx - ax) ** 2 + (by - ay) ** 2 + (bz - az) ** 2
    bc = (cx - bx) ** 2 + (cy - by) ** 2 + (cz - bz) ** 2
    ca = (ax - cx) ** 2 + (ay - cy) ** 2 + (az - cz) ** 2
    # Turned, until a -> b is the longest side.
    if bc > ab and bc >= ca:
        ax, ay, az, bx, by, bz, cx, cy, cz = bx, by, bz, cx, cy, cz, ax, ay, az
    elif ca > ab:
        ax, ay, az, bx, by, bz, cx, cy, cz = cx, cy, cz, ax, ay, az, bx, by, bz
    base = math.sqrt(max(ab, max(bc, ca)))
    rx, ry, rz = _unit(bx - ax, by - ay, bz - az, 1.0, 0.0, 0.0)
    right = (cx - ax) * rx + (cy - ay) * ry + (cz - az) * rz
    fx, fy, fz = ax + right * rx, ay + right * ry, az + right * rz
    hx, hy, hz = cx - fx, cy - fy, cz - fz
    # So short, it is rounding, and may well lie along r.
    if hx * hx + hy * hy + hz * hz < (1e-12 * base) ** 2:
        hx, hy, hz = 0.0, 0.0, 0.0
    # Any vector that stands on r will do where there is no height.
    if abs(rx) <= abs(ry) and abs(rx) <= abs(rz):
        ex, ey, ez = _unit(0.0, rz, -ry, 0.0, 0.0, 0.0)
    elif abs(ry) <= abs(rz):
        ex, ey, ez = _unit(-rz, 0.0, rx, 0.0, 0.0, 0.0)
    else:
        ex, ey, ez = _unit(ry, -rx, 0.0, 0.0, 0.0, 0.0)
    sx, sy, sz = _unit(hx, hy, hz, ex, ey, ez)
    tilt = sx * rx + sy * ry + sz * rz
    sx, sy, sz = _unit(sx - tilt * rx, sy - tilt * ry, sz - tilt * rz, ex, ey, ez)
    height = max(hx * sx + hy * sy + hz * sz, 0.0)
    f[0], f[1], f[2], f[3], f[4], f[5] = rx, ry, rz, sx, sy, sz
    f[6], f[7], f[8] = ry * sz - rz * sy, rz * sx - rx * sz, rx * sy - ry * sx
    for axis in range(3):
        f[9 + axis] = -(f[3 * axis] * fx + f[3 * axis + 1] * fy + f[3 * axis + 2] * fz)
    for side in range(2):
        end = min(max(right if side == 0 else base - right, 0.0), base)
        length = math.sqrt(end * end + height * height)
        f[12 + side] = end
        f[14 + 3 * side] = -end / length if length > 0 else 0.0
        f[15 + 3 * side] = height / length if length > 0 else 1.0
        f[16 + 3 * side] = length


@kernel
def _frames(begin, end, corners, out):  # type: ignore[no-untyped-def]
    for n in range(begin, end):
        frame_of(
            corners[n, 0, 0], corners[n, 0, 1], corners[n, 0, 2], corners[n, 1, 0], corners[n, 1, 1], corners[n, 1, 2],
            corners[n, 2, 0], corners[n, 2, 1], corners[n, 2, 2], out[n],
        )  # fmt: skip


def frames_of(corners: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, FRAME) float64 frames of triangles (n, 3, 3)."""
    out = np.empty((len(corners), FRAME))
    strips(_frames, len(corners), frozen(corners), out, size=2**14)
    return out


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
