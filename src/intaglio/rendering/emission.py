"""The emission-absorption integral along every ray, front to back, packet by packet."""

# M. Levoy, "Display of surfaces from volume data", 1988.
# N. Max, "Optical models for direct volume rendering", 1995.

from __future__ import annotations

import math

import numpy as np

from intaglio.compute import helper, kernel, lanes, pair
from intaglio.rendering.culling import TILE
from intaglio.rendering.cutting import kept, slopes_of_cut
from intaglio.rendering.first_hit import next_block, ray_at, span
from intaglio.rendering.packets import CELL, LANES, light_packet, slopes, spline, steepness, values, values_and_slopes
from intaglio.sampling import trilinear

# When colours are looked up; BOUNDARIES by value and slope.
PRE, POST, PREINTEGRATED, BOUNDARIES = 0, 1, 2, 3
# A ray ends when it is opaque but for this.
OPAQUE = 0.002


@helper
def _classified(voxels, grid, ray, first, step, count, low, scale, table, red, green, blue, alpha):  # type: ignore[no-untyped-def]
    """Pre-classification: colours of the eight voxels, weighted by opacity, interpolated; straight again at the end."""
    sy, sz = np.int64(grid[0]), np.int64(grid[1])
    top = len(table) // 4 - 1
    for lane in range(count):
        t = first + step * lane
        x = min(max(ray[0] + t * ray[3], 0.0), grid[2] - 1e-3)
        y = min(max(ray[1] + t * ray[4], 0.0), grid[3] - 1e-3)
        z = min(max(ray[2] + t * ray[5], 0.0), grid[4] - 1e-3)
        i, j, k = int(x), int(y), int(z)
        u, v, w = x - i, y - j, z - k
        r = g = b = a = 0.0
        for corner in range(8):
            cx, cy, cz = corner & 1, (corner >> 1) & 1, corner >> 2
            weight = (u if cx else 1.0 - u) * (v if cy else 1.0 - v) * (w if cz else 1.0 - w)
            value = float(voxels[(k + cz) * sz + (j + cy) * sy + i + cx])
            entry = 4 * min(max(int((value - low) * scale + 0.5), 0), top)
            opaque = weight * table[entry + 3]
            a += opaque
            r += opaque * table[entry]
            g += opaque * table[entry + 1]
            b += opaque * table[entry + 2]
        inverse = 1.0 / max(a, 1e-12)
        red[lane], green[lane], blue[lane], alpha[lane] = r * inverse, g * inverse, b * inverse, a


@helper
def _value_at(volume, ray, t):  # type: ignore[no-untyped-def]
    return np.float32(trilinear(volume, ray[0] + t * ray[3], ray[1] + t * ray[4], ray[2] + t * ray[5]))


@helper
def _behind(ghost, clear, r, g, b):  # type: ignore[no-untyped-def]
    """What a ray has gathered, and how clear it still is, behind a ghost."""
    weight = clear * ghost[4]
    return clear - weight, r + weight * ghost[1], g + weight * ghost[2], b + weight * ghost[3]


@kernel
def integrate(  # type: ignore[no-untyped-def]
    y0, y1, x0, x1, voxels, grid, shape, visible, heads, data, index_rays, world_rays, to_world, table, low, scale, columns,
    steep, classify, tricubic, gradient, reach, lit, fade,
    lights, material, shine, step, tile_near, tile_far, ghost, paper, out,
):  # fmt: skip
    """One tile of out (h, w, 4), straight, over paper (4,). step is in mm along the ray.

    table is flat; of a 2-D transfer function it has `columns` slopes for each value, `steep` of them to a value per mm.
    tricubic: values are the B-spline's. gradient: CELL, CENTRAL (`reach` voxels to either side) or SPLINE.
    tile_near, tile_far: see `tile_depths`. ghost (h, w, 5), or of no pixel: depth in mm, straight colour and opacity of what
    is seen through.
    """
    ray = np.empty(6)
    world = np.empty(6)
    shift = np.zeros(3)
    value, other, gx, gy, gz = lanes(), lanes(), lanes(), lanes(), lanes()
    share, diffuse, gloss = lanes(), lanes(), lanes()
    red, green, blue, alpha = lanes(), lanes(), lanes(), lanes()
    weight, margin = lanes(), lanes()
    # What a sample's opacity needs to know beforehand.
    known = tricubic or classify == BOUNDARIES or (lit and gradient == CELL and classify == POST)
    volume = voxels.reshape(shape)
    weights = np.empty((3, 3, 4))
    jet = np.empty(10)
    haunted = ghost.shape[0] > 0
    # So near to a cut, in mm, a sample is lit as part of its face.
    face = np.float32(1.5 * step)
    ka, kd, ks = np.float32(material[0]), np.float32(material[1]), np.float32(material[2])
    one = np.float32(1.0)
    base = np.float32(low)
    factor = np.float32(scale)
    top = np.float32(len(table) // (4 * columns) - 1)
    two = np.uint64(2)
    four = np.uint64(4)
    side = np.int32(columns)
    last_column = np.float32(columns - 1)
    slope_scale = np.float32(steep)
    for py in range(y0, y1):
        for px in range(x0, x1):
            ray_at(index_rays, px + 0.5, py + 0.5, ray)
            near, far = span(ray, shape, 0.0)
            begin = tile_near[py // TILE, px // TILE]
            missed = not (near < far and begin < far and tile_far[py // TILE, px // TILE] > near)
            if missed and not haunted:
                continue
            if missed:
                near = far = begin = 0.0
            ray_at(world_rays, px + 0.5, py + 0.5, world)
            dt = step / math.sqrt(world[3] ** 2 + world[4] ** 2 + world[5] ** 2)
            nudge = 1e-6 * dt
            total = 0 if missed else max(int(math.ceil((far - near) / dt - 1e-6)), 1)
            # The last sample stands for what is left of the ray, and sits in its middle.
            rest = (far - near) / dt - (total - 1)
            last_middle = far - 0.5 * rest * dt
            r = g = b = np.float32(0.0)
            clear = one
            veil = float(ghost[py, px, 0]) if haunted else np.inf
            # Samples stay where they are counted from the volume's face; only the empty ones in front are left out.
            k = max(int((begin - near) / dt), 0)
            t = near + k * dt
            stop = tile_far[py // TILE, px // TILE]
            end = k
            while clear >= np.float32(OPAQUE):
                # Blocks that show something, one behind the other, fill a packet together.
                after = k
                while end - k < LANES and end < total and t < stop:
                    bz, by, bx, until = next_block(ray, shape, t, nudge)
                    t = until
                    # A sample belongs to the block of its middle, a pre-integrated segment to every block that it touches.
                    beyond = (
                        int(math.ceil((until - near) / dt - (0.0 if classify == PREINTEGRATED else 0.5)))
                        if until < far
                        else total
                    )
                    if visible[bz, by, bx]:
                        end = max(min(beyond, total), end)
                        continue
                    after = int((until - near) / dt) if classify == PREINTEGRATED and until < far else beyond
                    if end > k:
                        break
                    k = end = max(k, after)
                if end <= k or k >= total:
                    break
                count = min(end - k, LANES)
                middle = near + (k + 0.5) * dt
                cut_short = k + count == total and rest < 0.999999
                if classify == PREINTEGRATED:
                    # Values at both ends of each segment, its middle being the sample.
                    values(voxels, grid, ray, near + k * dt, dt, count + 1, shift, value)
                    if cut_short:
                        value[count] = _value_at(volume, ray, far)
                    for lane in range(count):
                        f = min(max((value[lane] - base) * factor, np.float32(0.0)), last_column)
                        s = min(max((value[lane + 1] - base) * factor, np.float32(0.0)), last_column)
                        entry = np.uint64(np.int32(f + np.float32(0.5)) * side + np.int32(s + np.float32(0.5)))
                        hue, tint = pair(table, four * entry)
                        shade, opacity = pair(table, four * entry + two)
                        inverse = one / max(opacity, np.float32(1e-12))
                        red[lane] = hue * inverse
                        green[lane] = tint * inverse
                        blue[lane] = shade * inverse
                        alpha[lane] = opacity
                elif classify != PRE:
                    if tricubic:
                        spline(volume, ray, middle, dt, count, weights, jet, value, gx, gy, gz)
                    elif known and gradient == CELL:
                        values_and_slopes(voxels, grid, ray, middle, dt, count, value, gx, gy, gz)
                    else:
                        values(voxels, grid, ray, middle, dt, count, shift, value)
                        if known:
                            slopes(
                                voxels, volume, grid, ray, middle, dt, count, gradient, reach, shift, weights, jet, other, gx, gy,
                                gz,
                            )  # fmt: skip
                    if cut_short and not tricubic:
                        value[count - 1] = _value_at(volume, ray, last_middle)
                    if classify == BOUNDARIES:
                        steepness(gx, gy, gz, count, to_world, other)
                        for lane in range(count):
                            f = min(max((value[lane] - base) * factor + np.float32(0.5), np.float32(0.0)), top)
                            s = min(other[lane] * slope_scale + np.float32(0.5), last_column)
                            entry = four * np.uint64(np.int32(f) * side + np.int32(s))
                            red[lane], green[lane] = pair(table, entry)
                            blue[lane], alpha[lane] = pair(table, entry + two)
                    else:
                        for lane in range(count):
                            f = min(max((value[lane] - base) * factor + np.float32(0.5), np.float32(0.0)), top)
                            entry = four * np.uint64(np.int32(f))
                            red[lane], green[lane] = pair(table, entry)
                            blue[lane], alpha[lane] = pair(table, entry + two)
                else:
                    _classified(voxels, grid, ray, middle, dt, count, low, scale, table, red, green, blue, alpha)
                    if cut_short:
                        _classified(voxels, grid, ray, last_middle, dt, 1, low, scale, table, gx, gy, gz, other)
                        red[count - 1], green[count - 1], blue[count - 1], alpha[count - 1] = gx[0], gy[0], gz[0], other[0]
                if cut_short:
                    alpha[count - 1] = one - (one - alpha[count - 1]) ** np.float32(rest)

                if heads.shape[0] > 0:
                    for lane in range(count):
                        at = middle + lane * dt
                        x, y, z = ray[0] + at * ray[3], ray[1] + at * ray[4], ray[2] + at * ray[5]
                        margin[lane] = kept(heads, data, x, y, z)
                        if margin[lane] < np.float32(0.0):
                            alpha[lane] = np.float32(0.0)

                # Opacity alone says which samples count: from the first that is seen to the last that shows through.
                first = 0
                while first < count and alpha[first] <= np.float32(0.0):
                    first += 1
                past = first
                for lane in range(first, count):
                    if middle + lane * dt > veil:
                        veil = np.inf
                        clear, r, g, b = _behind(ghost[py, px], clear, r, g, b)
                    weight[lane] = clear * alpha[lane]
                    if alpha[lane] > np.float32(0.0):
                        past = lane + 1
                        clear *= one - alpha[lane]
                        if clear < np.float32(OPAQUE):
                            break
                seen = past - first
                if seen > 0:
                    skip = 0 if known else first
                    if lit:
                        start = middle + skip * dt
                        number = past - skip
                        if not known:
                            slopes(
                                voxels, volume, grid, ray, start, dt, number, gradient, reach, shift, weights, jet, other, gx, gy,
                                gz,
                            )  # fmt: skip
                        if heads.shape[0] > 0:
                            for lane in range(number):
                                if margin[skip + lane] < face:
                                    slopes_of_cut(heads, data, ray, start + lane * dt, fade, lane, gx, gy, gz)
                        light_packet(
                            gx, gy, gz, number, world, start, dt, to_world, lights, material, fade, shine, share, diffuse,
                            gloss,
                        )  # fmt: skip
                        for lane in range(number):
                            body = one + share[lane] * (ka + kd * diffuse[lane] - one)
                            glow = share[lane] * ks * gloss[lane]
                            red[skip + lane] = red[skip + lane] * body + glow
                            green[skip + lane] = green[skip + lane] * body + glow
                            blue[skip + lane] = blue[skip + lane] * body + glow
                    for lane in range(first, past):
                        r += weight[lane] * red[lane]
                        g += weight[lane] * green[lane]
                        b += weight[lane] * blue[lane]
                k += count
                if k == end:
                    k = end = max(k, after)
            if veil < np.inf:
                clear, r, g, b = _behind(ghost[py, px], clear, r, g, b)
            free = clear * paper[3]
            a = one - clear + free
            inverse = one / max(a, np.float32(1e-6))
            out[py, px, 0] = min((r + free * paper[0]) * inverse, one)
            out[py, px, 1] = min((g + free * paper[1]) * inverse, one)
            out[py, px, 2] = min((b + free * paper[2]) * inverse, one)
            out[py, px, 3] = min(a, one)
