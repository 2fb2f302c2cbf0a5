"""What a ray does with a packet of its samples at once: values, gradients, light. Loops over lanes, for LLVM to vectorize."""

from __future__ import annotations

import math
from typing import Any
from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import frozen, helper, kernel, pair, quad
from intaglio.sampling import tricubic
from intaglio.volume import Volume

# Where gradients come from: the cell's own trilinear field, central differences, the tricubic B-spline.
CELL, CENTRAL, SPLINE = 0, 1, 2

# Samples in a packet; a block of 8 voxels holds about that many at half a voxel's step.
LANES = 32

# What scans are: a kernel is compiled for each of these.
TYPES = (np.uint8, np.int16, np.uint16, np.float32)
_floats: WeakKeyDictionary[Volume, NDArray[np.float32]] = WeakKeyDictionary()

_ZERO = np.float32(0.0)
_ONE = np.float32(1.0)
_HALF = np.float32(0.5)


def flat(volume: Volume) -> NDArray[Any]:
    """A volume's voxels end to end, of a type that packets are compiled for; others become the float32 they are read as."""
    if volume.samples.dtype in TYPES:
        return np.asarray(frozen(volume.samples).reshape(-1))
    if volume not in _floats:
        _floats[volume] = volume.samples.astype(np.float32)
    return np.asarray(frozen(_floats[volume]).reshape(-1))


@helper
def _lerp(a, b, u):  # type: ignore[no-untyped-def]
    return a + u * (b - a)


@helper
def _start(grid, ray, first, step, shift):  # type: ignore[no-untyped-def]
    """Strides, last index, first position and way of a packet, as kernels of lanes take them."""
    return (
        (np.uint64(grid[0]), np.uint64(grid[1])),
        (np.float32(grid[2]), np.float32(grid[3]), np.float32(grid[4])),
        (
            np.float32(ray[0] + first * ray[3] + shift[0]),
            np.float32(ray[1] + first * ray[4] + shift[1]),
            np.float32(ray[2] + first * ray[5] + shift[2]),
        ),
        (np.float32(step * ray[3]), np.float32(step * ray[4]), np.float32(step * ray[5])),
    )


@helper
def _cell(voxels, strides, last, at, way, lane):  # type: ignore[no-untyped-def]
    """Where a sample lies in its cell, and the values at the cell's four edges along x: their beginning and their rise."""
    t = np.float32(lane)
    x = min(max(at[0] + t * way[0], _ZERO), last[0])
    y = min(max(at[1] + t * way[1], _ZERO), last[1])
    z = min(max(at[2] + t * way[2], _ZERO), last[2])
    i = np.int32(min(x, last[0] - _ONE))
    j = np.int32(min(y, last[1] - _ONE))
    k = np.int32(min(z, last[2] - _ONE))
    sy, sz = strides
    b = np.uint64(k) * sz + np.uint64(j) * sy + np.uint64(i)
    a00, b00 = pair(voxels, b)
    a01, b01 = pair(voxels, b + sy)
    a10, b10 = pair(voxels, b + sz)
    a11, b11 = pair(voxels, b + sz + sy)
    place = (x - np.float32(i), y - np.float32(j), z - np.float32(k))
    return place, (a00, a01, a10, a11), (b00 - a00, b01 - a01, b10 - a10, b11 - a11)


@helper
def values(voxels, grid, ray, first, step, count, shift, out):  # type: ignore[no-untyped-def]
    """out[l] = trilinear value at origin + (first + l step) direction + shift.

    voxels flat; grid (5,) = strides of y and z, then the last index of x, y, z; ray (6,) in index space, float64.
    """
    strides, last, at, way = _start(grid, ray, first, step, shift)
    for lane in range(count):
        (u, v, w), a, e = _cell(voxels, strides, last, at, way, lane)
        c0 = _lerp(a[0] + u * e[0], a[1] + u * e[1], v)
        c1 = _lerp(a[2] + u * e[2], a[3] + u * e[3], v)
        out[lane] = _lerp(c0, c1, w)


@helper
def values_and_slopes(voxels, grid, ray, first, step, count, out, gx, gy, gz):  # type: ignore[no-untyped-def]
    """The same with the gradient of the trilinear field itself, in index space: cheap, but it jumps between cells."""
    strides, last, at, way = _start(grid, ray, first, step, (0.0, 0.0, 0.0))
    for lane in range(count):
        (u, v, w), a, e = _cell(voxels, strides, last, at, way, lane)
        c00 = a[0] + u * e[0]
        c10 = a[2] + u * e[2]
        d0 = a[1] + u * e[1] - c00
        d1 = a[3] + u * e[3] - c10
        c0 = c00 + v * d0
        c1 = c10 + v * d1
        out[lane] = _lerp(c0, c1, w)
        gx[lane] = _lerp(_lerp(e[0], e[1], v), _lerp(e[2], e[3], v), w)
        gy[lane] = _lerp(d0, d1, w)
        gz[lane] = c1 - c0


@kernel
def central_differences(voxels, grid, ray, first, step, count, h, shift, other, gx, gy, gz):  # type: ignore[no-untyped-def]
    """Gradient from six more values, h voxels away on either side, in index space; smooth across cells."""
    half = np.float32(0.5 / h)
    for axis in range(3):
        out = gx if axis == 0 else (gy if axis == 1 else gz)
        shift[0] = shift[1] = shift[2] = 0.0
        shift[axis] = h
        values(voxels, grid, ray, first, step, count, shift, out)
        shift[axis] = -h
        values(voxels, grid, ray, first, step, count, shift, other)
        for lane in range(count):
            out[lane] = half * (out[lane] - other[lane])


@helper
def _between(four, u):  # type: ignore[no-untyped-def]
    """The value between the middle two of four neighbours."""
    return four[1] + u * (four[2] - four[1])


@helper
def smooth_slopes(voxels, grid, ray, first, step, count, gx, gy, gz):  # type: ignore[no-untyped-def]
    """Gradient from central differences at the voxels around, interpolated: what `central_differences` gives one voxel away,
    but from the 32 voxels that count, each read once, instead of 48. Constant in the outermost cells. At least 4 voxels each way.
    """
    (sy, sz), last, at, way = _start(grid, ray, first, step, (0.0, 0.0, 0.0))
    one = np.uint64(1)
    last_x, last_y, last_z = last[0] - _ONE, last[1] - _ONE, last[2] - _ONE
    for lane in range(count):
        t = np.float32(lane)
        x = min(max(at[0] + t * way[0], _ONE), last_x)
        y = min(max(at[1] + t * way[1], _ONE), last_y)
        z = min(max(at[2] + t * way[2], _ONE), last_z)
        i = np.int32(min(x, last_x - _ONE))
        j = np.int32(min(y, last_y - _ONE))
        k = np.int32(min(z, last_z - _ONE))
        u = x - np.float32(i)
        v = y - np.float32(j)
        w = z - np.float32(k)
        b = np.uint64(k) * sz + np.uint64(j) * sy + np.uint64(i)
        q00 = quad(voxels, b - one)
        q01 = quad(voxels, b + sy - one)
        q10 = quad(voxels, b + sz - one)
        q11 = quad(voxels, b + sz + sy - one)
        x0 = _lerp(_lerp(q00[2] - q00[0], q00[3] - q00[1], u), _lerp(q01[2] - q01[0], q01[3] - q01[1], u), v)
        x1 = _lerp(_lerp(q10[2] - q10[0], q10[3] - q10[1], u), _lerp(q11[2] - q11[0], q11[3] - q11[1], u), v)
        gx[lane] = _HALF * _lerp(x0, x1, w)
        c00 = _between(q00, u)
        c01 = _between(q01, u)
        c10 = _between(q10, u)
        c11 = _between(q11, u)
        l0, r0 = pair(voxels, b - sy)
        l1, r1 = pair(voxels, b - sy + sz)
        m0, s0 = pair(voxels, b + sy + sy)
        m1, s1 = pair(voxels, b + sy + sy + sz)
        y0 = _lerp(c01 - _lerp(l0, r0, u), _lerp(m0, s0, u) - c00, v)
        y1 = _lerp(c11 - _lerp(l1, r1, u), _lerp(m1, s1, u) - c10, v)
        gy[lane] = _HALF * _lerp(y0, y1, w)
        l0, r0 = pair(voxels, b - sz)
        l1, r1 = pair(voxels, b - sz + sy)
        m0, s0 = pair(voxels, b + sz + sz)
        m1, s1 = pair(voxels, b + sz + sz + sy)
        z0 = _lerp(c10 - _lerp(l0, r0, u), _lerp(m0, s0, u) - c00, w)
        z1 = _lerp(c11 - _lerp(l1, r1, u), _lerp(m1, s1, u) - c01, w)
        gz[lane] = _HALF * _lerp(z0, z1, v)


@kernel
def spline(voxels, ray, first, step, count, weights, jet, out, gx, gy, gz):  # type: ignore[no-untyped-def]
    """Value and gradient of the tricubic B-spline; voxels (z, y, x), weights and jet are scratch of `tricubic`."""
    nz, ny, nx = voxels.shape
    for lane in range(count):
        t = first + step * lane
        x = min(max(ray[0] + t * ray[3], 0.0), nx - 1.0)
        y = min(max(ray[1] + t * ray[4], 0.0), ny - 1.0)
        z = min(max(ray[2] + t * ray[5], 0.0), nz - 1.0)
        tricubic(voxels, x, y, z, weights, jet)
        out[lane] = jet[0]
        gx[lane], gy[lane], gz[lane] = jet[1], jet[2], jet[3]


@helper
def slopes(voxels, volume, grid, ray, first, step, count, gradient, reach, shift, weights, jet, other, gx, gy, gz):  # type: ignore[no-untyped-def]
    """Gradients from the source asked for; voxels flat, volume the same in (z, y, x)."""
    if gradient == CELL:
        values_and_slopes(voxels, grid, ray, first, step, count, other, gx, gy, gz)
    elif gradient == SPLINE:
        spline(volume, ray, first, step, count, weights, jet, other, gx, gy, gz)
    elif reach == 1.0:
        smooth_slopes(voxels, grid, ray, first, step, count, gx, gy, gz)
    else:
        central_differences(voxels, grid, ray, first, step, count, reach, shift, other, gx, gy, gz)
        shift[:] = 0.0


@helper
def steepness(gx, gy, gz, count, to_world, out):  # type: ignore[no-untyped-def]
    """Magnitude of gradients in index space, in values per mm."""
    m = to_world
    m00, m01, m02 = np.float32(m[0, 0]), np.float32(m[0, 1]), np.float32(m[0, 2])
    m10, m11, m12 = np.float32(m[1, 0]), np.float32(m[1, 1]), np.float32(m[1, 2])
    m20, m21, m22 = np.float32(m[2, 0]), np.float32(m[2, 1]), np.float32(m[2, 2])
    for lane in range(count):
        x = m00 * gx[lane] + m10 * gy[lane] + m20 * gz[lane]
        y = m01 * gx[lane] + m11 * gy[lane] + m21 * gz[lane]
        z = m02 * gx[lane] + m12 * gy[lane] + m22 * gz[lane]
        out[lane] = math.sqrt(x * x + y * y + z * z)


@helper
def light_packet(gx, gy, gz, count, ray, first, step, to_world, lights, material, fade, shine, share, diffuse, gloss):  # type: ignore[no-untyped-def]
    """Diffuse and specular light (Blinn-Phong) of the normals -g/|g|; share[l] says how much of a normal there is.

    Below a slope of `fade` per mm the share falls to 0 at half of it: homogeneous regions have no normal. ray is in the
    world, gx, gy, gz in index space and overwritten; shine is a table of x^shininess over 0..1.
    """
    m = to_world
    m00, m01, m02 = np.float32(m[0, 0]), np.float32(m[0, 1]), np.float32(m[0, 2])
    m10, m11, m12 = np.float32(m[1, 0]), np.float32(m[1, 1]), np.float32(m[1, 2])
    m20, m21, m22 = np.float32(m[2, 0]), np.float32(m[2, 1]), np.float32(m[2, 2])
    back = -1.0 / math.sqrt(ray[3] ** 2 + ray[4] ** 2 + ray[5] ** 2)
    vx, vy, vz = np.float32(back * ray[3]), np.float32(back * ray[4]), np.float32(back * ray[5])
    two_sided = material[4] > 0.5
    top = np.float32(len(shine) - 1)
    low = np.float32(0.5 * fade)
    scale = _ONE / max(low, np.float32(1e-20))
    for lane in range(count):
        nx = -(m00 * gx[lane] + m10 * gy[lane] + m20 * gz[lane])
        ny = -(m01 * gx[lane] + m11 * gy[lane] + m21 * gz[lane])
        nz = -(m02 * gx[lane] + m12 * gy[lane] + m22 * gz[lane])
        slope = np.float32(math.sqrt(nx * nx + ny * ny + nz * nz))
        inverse = _ONE / max(slope, np.float32(1e-20))
        gx[lane] = nx * inverse
        gy[lane] = ny * inverse
        gz[lane] = nz * inverse
        part = min(max((slope - low) * scale, _ZERO), _ONE)
        share[lane] = part * part * (np.float32(3.0) - np.float32(2.0) * part)
        diffuse[lane] = _ZERO
        gloss[lane] = _ZERO
    for n in range(lights.shape[0]):
        spot = lights[n, 0] > np.float32(1.5)
        near = lights[n, 0] > np.float32(0.5)
        lx, ly, lz = lights[n, 1], lights[n, 2], lights[n, 3]
        ox, oy, oz = np.float32(lights[n, 4] - ray[0]), np.float32(lights[n, 5] - ray[1]), np.float32(lights[n, 6] - ray[2])
        rx, ry, rz = np.float32(ray[3]), np.float32(ray[4]), np.float32(ray[5])
        start, pace = np.float32(first), np.float32(step)
        edge = _ONE / max(lights[n, 9] - lights[n, 8], np.float32(1e-6))
        for lane in range(count):
            power = lights[n, 7]
            ax, ay, az = lx, ly, lz
            if near:
                t = start + pace * np.float32(lane)
                ax, ay, az = ox - t * rx, oy - t * ry, oz - t * rz
                closer = _ONE / max(np.float32(math.sqrt(ax * ax + ay * ay + az * az)), np.float32(1e-6))
                ax, ay, az = ax * closer, ay * closer, az * closer
                if spot:
                    part = min(max((ax * lx + ay * ly + az * lz - lights[n, 8]) * edge, _ZERO), _ONE)
                    power = power * part * part * (np.float32(3.0) - np.float32(2.0) * part)
            hx, hy, hz = ax + vx, ay + vy, az + vz
            long = _ONE / max(np.float32(math.sqrt(hx * hx + hy * hy + hz * hz)), np.float32(1e-9))
            lit = gx[lane] * ax + gy[lane] * ay + gz[lane] * az
            half = (gx[lane] * hx + gy[lane] * hy + gz[lane] * hz) * long
            if two_sided:
                lit = abs(lit)
                half = abs(half)
            half = min(max(half, _ZERO), _ONE) if lit > _ZERO else _ZERO
            diffuse[lane] += power * max(lit, _ZERO)
            gloss[lane] += power * shine[np.uint64(np.int32(half * top))]
