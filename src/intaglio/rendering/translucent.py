"""Several semi-transparent isosurfaces at once, without polygons."""

# K. Rezk-Salama et al., "Interactive volume rendering on standard PC graphics hardware", 2000 (non-polygonal isosurfaces).

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import kernel, lanes
from intaglio.rendering.cutting import kept
from intaglio.rendering.first_hit import next_block, ray_at, span
from intaglio.rendering.packets import LANES, central_differences, light_packet, values

STEP = 0.5
# Crossings that are remembered between two samples.
MOST = 8


@kernel
def trace_surfaces(  # type: ignore[no-untyped-def]
    y0, y1, x0, x1, voxels, grid, shape, visible, heads, data, index_rays, world_rays, to_world, levels,
    colours, lit, lights, material, shine, out,
):  # fmt: skip
    """One tile of out (h, w, 4), premultiplied: every crossing of levels (n,), in order, with colours (n, 4)."""
    ray = np.empty(6)
    world = np.empty(6)
    shift = np.zeros(3)
    value, other, gx, gy, gz = lanes(), lanes(), lanes(), lanes(), lanes()
    share, diffuse, gloss = lanes(), lanes(), lanes()
    when = np.empty(MOST)
    which = np.empty(MOST, dtype=np.int64)
    for py in range(y0, y1):
        for px in range(x0, x1):
            ray_at(index_rays, px + 0.5, py + 0.5, ray)
            near, far = span(ray, shape, 0.0)
            if not near < far:
                continue
            ray_at(world_rays, px + 0.5, py + 0.5, world)
            dt = STEP / math.sqrt(ray[3] ** 2 + ray[4] ** 2 + ray[5] ** 2)
            total = max(int(math.ceil((far - near) / dt - 1e-6)), 1)
            dt = (far - near) / total
            r = g = b = a = 0.0
            t = near
            k = 0
            while k < total and a < 0.999:
                bz, by, bx, until = next_block(ray, shape, t, 1e-6 * dt)
                end = min(int(math.ceil((until - near) / dt)), total) if until < far else total
                t = until
                if not visible[bz, by, bx]:
                    # The segment that leads into the next block is not skipped.
                    k = max(k, int((until - near) / dt)) if until < far else total
                    continue
                while k < end and a < 0.999:
                    count = min(end - k, LANES)
                    values(voxels, grid, ray, near + k * dt, dt, count + 1, shift, value)
                    for lane in range(count):
                        found = 0
                        for n in range(len(levels)):
                            f0 = value[lane] - levels[n]
                            f1 = value[lane + 1] - levels[n]
                            if (f0 < 0.0) != (f1 < 0.0) and found < MOST:
                                low, high = 0.0, 1.0
                                for _ in range(4):
                                    m = low + (high - low) * f0 / (f0 - f1)
                                    values(voxels, grid, ray, near + (k + lane + m) * dt, dt, 1, shift, other)
                                    fm = other[0] - levels[n]
                                    if (fm < 0.0) == (f0 < 0.0):
                                        low, f0 = m, fm
                                    else:
                                        high, f1 = m, fm
                                at = near + (k + lane + low + (high - low) * f0 / (f0 - f1)) * dt
                                if heads.shape[0] > 0:
                                    x, y, z = ray[0] + at * ray[3], ray[1] + at * ray[4], ray[2] + at * ray[5]
                                    if kept(heads, data, x, y, z) < 0.0:
                                        continue
                                place = found
                                while place > 0 and when[place - 1] > at:
                                    when[place] = when[place - 1]
                                    which[place] = which[place - 1]
                                    place -= 1
                                when[place] = at
                                which[place] = n
                                found += 1
                        for c in range(found):
                            body = 1.0
                            glow = 0.0
                            if lit:
                                central_differences(voxels, grid, ray, when[c], dt, 1, 1.0, shift, other, gx, gy, gz)
                                shift[:] = 0.0
                                # A surface is lit from the side on which it is seen.
                                if gx[0] * ray[3] + gy[0] * ray[4] + gz[0] * ray[5] < 0.0:
                                    gx[0], gy[0], gz[0] = -gx[0], -gy[0], -gz[0]
                                light_packet(
                                    gx,
                                    gy,
                                    gz,
                                    1,
                                    world,
                                    when[c],
                                    dt,
                                    to_world,
                                    lights,
                                    material,
                                    0.0,
                                    shine,
                                    share,
                                    diffuse,
                                    gloss,
                                )
                                body = material[0] + material[1] * diffuse[0]
                                glow = material[2] * gloss[0]
                            weight = (1.0 - a) * colours[which[c], 3]
                            r += weight * (colours[which[c], 0] * body + glow)
                            g += weight * (colours[which[c], 1] * body + glow)
                            b += weight * (colours[which[c], 2] * body + glow)
                            a += weight
                    k += count
            out[py, px, 0], out[py, px, 1], out[py, px, 2], out[py, px, 3] = r, g, b, a
