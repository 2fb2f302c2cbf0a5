"""The field of stroke directions: principal curvature directions in the image, smoothed as lines."""

# V. Interrante, "Illustrating surface shape in volume data via principal direction-driven 3D line
# integral convolution", 1997 (strokes follow the direction of greatest curvature).

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel, strips
from intaglio.gbuffer import GBuffer
from intaglio.ink.smoothing import connections, smooth

Field = NDArray[np.float32]

# Where nothing curves, strokes follow cuts of the surface with planes of this normal (view space), as if it were sliced.
SLICING = (0.30, 0.90, 0.30)
SLICING_WEIGHT = 0.2
# The form at large has this say beside the form nearby, which is averaged over a third of the distance.
LARGE_WEIGHT = 0.35
# Where a surface is bent tighter than the averaging's distance divided by this, it is an edge and has half a say.
EDGE = 5.0


@kernel
def _seed(y0, y1, normal, curvature, direction, depth, frame, rays, bend, slicing, weight, field):  # type: ignore[no-untyped-def]
    """field = double angle times weight, and weight."""
    h, w = depth.shape
    for y in range(y0, y1):
        for x in range(w):
            if depth[y, x] == np.inf:
                continue
            # The picture of a direction e at a point seen along v: e - v (e.forward) / (v.forward).
            ex = ey = ez = 0.0
            k1 = abs(curvature[y, x, 0])
            k2 = abs(curvature[y, x, 1])
            nx, ny, nz = normal[y, x, 0], normal[y, x, 1], normal[y, x, 2]
            ex, ey, ez = direction[y, x, 0], direction[y, x, 1], direction[y, x, 2]
            if k2 > k1:
                ex, ey, ez = ny * ez - nz * ey, nz * ex - nx * ez, nx * ey - ny * ex
            # The slicing direction n x s.
            sx = ny * slicing[2] - nz * slicing[1]
            sy = nz * slicing[0] - nx * slicing[2]
            sz = nx * slicing[1] - ny * slicing[0]
            vx = rays[3, 0] + (x + 0.5) * rays[4, 0] + (y + 0.5) * rays[5, 0]
            vy = rays[3, 1] + (x + 0.5) * rays[4, 1] + (y + 0.5) * rays[5, 1]
            vz = rays[3, 2] + (x + 0.5) * rays[4, 2] + (y + 0.5) * rays[5, 2]
            anisotropy = abs(k1 - k2) * bend
            power = anisotropy * anisotropy / (1.0 + anisotropy * anisotropy)
            # An edge is no form: strokes run over it from one face to the other.
            sharp = max(k1, k2) * bend / EDGE
            calm = 1.0 / (1.0 + sharp * sharp)
            power *= calm
            for source in range(2):
                if source == 1:
                    ex, ey, ez = sx, sy, sz
                    power = weight * calm
                away = -(frame[2, 0] * ex + frame[2, 1] * ey + frame[2, 2] * ez)
                ix = frame[0, 0] * (ex - vx * away) + frame[0, 1] * (ey - vy * away) + frame[0, 2] * (ez - vz * away)
                iy = -(frame[1, 0] * (ex - vx * away) + frame[1, 1] * (ey - vy * away) + frame[1, 2] * (ez - vz * away))
                # Doubling the angle makes a line equal to its reverse; the length drops out with foreshortening kept.
                size = math.sqrt(ix * ix + iy * iy)
                if size > 1e-6:
                    field[0, y, x] += power * (ix * ix - iy * iy) / size
                    field[1, y, x] += power * 2.0 * ix * iy / size
                    field[2, y, x] += power * size


def direction_field(gb: GBuffer, sigma: float, passes: int = 3) -> Field:
    """(2, h, w) float32: cosine and sine of twice the stroke's angle (x right, y down); (0, 0) where nothing was hit.

    The direction of the greater of |k1|, |k2|, projected, is averaged as a line over `sigma` pixels, weighted by
    how unlike the two curvatures are, never across a jump in depth and hardly across a crease. Strong features nearby
    count more. Where the surface is flat or round, its cut with parallel planes takes over.
    """
    h, w = gb.depth.shape
    field = np.zeros((3, h, w), dtype=np.float32)
    links = connections(gb)
    pixel = float(np.median(gb.pixel_mm[gb.mask])) if gb.mask.any() else 1.0
    frame = gb.camera.view_from_world
    slicing = np.asarray(SLICING) @ frame
    strips(
        _seed, h, gb.normal, gb.curvature, gb.direction, gb.depth, frame, gb.camera.rays(),
        sigma * pixel, slicing, SLICING_WEIGHT, field, size=32,
    )  # fmt: skip
    large = field.copy()
    smooth(field, links, sigma / 3.0, passes)
    smooth(large, links, sigma, passes)
    field += np.float32(LARGE_WEIGHT) * large
    size = np.hypot(field[0], field[1])
    size[size == 0.0] = 1.0
    unit: Field = field[:2] / size
    return unit
