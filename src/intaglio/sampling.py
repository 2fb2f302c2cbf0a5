"""Interpolation: trilinear values; value, gradient and Hessian of the tricubic B-spline. Index space (x, y, z)."""

# C. Sigg, M. Hadwiger, "Fast third-order texture filtering", 2005 (the spline's weights).
# G. Kindlmann et al., "Curvature-based transfer functions for direct volume rendering", 2003 (its use for curvature).

from __future__ import annotations

from intaglio.compute import helper, kernel


@helper
def trilinear(voxels, x, y, z):  # type: ignore[no-untyped-def]
    """Value at (x, y, z); positions outside are clamped to the grid."""
    nz, ny, nx = voxels.shape
    x = min(max(x, 0.0), nx - 1.0)
    y = min(max(y, 0.0), ny - 1.0)
    z = min(max(z, 0.0), nz - 1.0)
    i = min(int(x), nx - 2)
    j = min(int(y), ny - 2)
    k = min(int(z), nz - 2)
    u = x - i
    v = y - j
    w = z - k
    a = voxels[k, j, i] * (1.0 - u) + voxels[k, j, i + 1] * u
    b = voxels[k, j + 1, i] * (1.0 - u) + voxels[k, j + 1, i + 1] * u
    c = voxels[k + 1, j, i] * (1.0 - u) + voxels[k + 1, j, i + 1] * u
    d = voxels[k + 1, j + 1, i] * (1.0 - u) + voxels[k + 1, j + 1, i + 1] * u
    return (a * (1.0 - v) + b * v) * (1.0 - w) + (c * (1.0 - v) + d * v) * w


@helper
def _weights(u, value, first, second):  # type: ignore[no-untyped-def]
    """The four weights of a cubic B-spline at fraction u, and of its first and second derivative."""
    t = 1.0 - u
    value[0] = t * t * t / 6.0
    value[1] = 2.0 / 3.0 - u * u * (1.0 - 0.5 * u)
    value[2] = 2.0 / 3.0 - t * t * (1.0 - 0.5 * t)
    value[3] = u * u * u / 6.0
    first[0] = -0.5 * t * t
    first[1] = u * (1.5 * u - 2.0)
    first[2] = -t * (1.5 * t - 2.0)
    first[3] = 0.5 * u * u
    second[0] = t
    second[1] = 3.0 * u - 2.0
    second[2] = 3.0 * t - 2.0
    second[3] = u


@kernel
def tricubic(voxels, x, y, z, weights, out):  # type: ignore[no-untyped-def]
    """out = value, gx, gy, gz, hxx, hyy, hzz, hxy, hxz, hyz of the smoothing (not prefiltered) B-spline.

    weights is scratch of shape (3, 3, 4). The grid is continued by its border voxels.
    """
    nz, ny, nx = voxels.shape
    i = min(max(int(x), 0), nx - 2)
    j = min(max(int(y), 0), ny - 2)
    k = min(max(int(z), 0), nz - 2)
    _weights(x - i, weights[0, 0], weights[0, 1], weights[0, 2])
    _weights(y - j, weights[1, 0], weights[1, 1], weights[1, 2])
    _weights(z - k, weights[2, 0], weights[2, 1], weights[2, 2])
    x0 = max(i - 1, 0)
    x3 = min(i + 2, nx - 1)
    wx = weights[0]
    f = gx = gy = gz = hxx = hyy = hzz = hxy = hxz = hyz = 0.0
    for c in range(4):
        zz = min(max(k + c - 1, 0), nz - 1)
        s = sx = sy = sxx = syy = sxy = 0.0
        for b in range(4):
            yy = min(max(j + b - 1, 0), ny - 1)
            p0 = float(voxels[zz, yy, x0])
            p1 = float(voxels[zz, yy, i])
            p2 = float(voxels[zz, yy, i + 1])
            p3 = float(voxels[zz, yy, x3])
            r = wx[0, 0] * p0 + wx[0, 1] * p1 + wx[0, 2] * p2 + wx[0, 3] * p3
            rx = wx[1, 0] * p0 + wx[1, 1] * p1 + wx[1, 2] * p2 + wx[1, 3] * p3
            rxx = wx[2, 0] * p0 + wx[2, 1] * p1 + wx[2, 2] * p2 + wx[2, 3] * p3
            s += weights[1, 0, b] * r
            sx += weights[1, 0, b] * rx
            sxx += weights[1, 0, b] * rxx
            sy += weights[1, 1, b] * r
            sxy += weights[1, 1, b] * rx
            syy += weights[1, 2, b] * r
        w0 = weights[2, 0, c]
        w1 = weights[2, 1, c]
        f += w0 * s
        gx += w0 * sx
        gy += w0 * sy
        gz += w1 * s
        hxx += w0 * sxx
        hyy += w0 * syy
        hzz += weights[2, 2, c] * s
        hxy += w0 * sxy
        hxz += w1 * sx
        hyz += w1 * sy
    out[0] = f
    out[1] = gx
    out[2] = gy
    out[3] = gz
    out[4] = hxx
    out[5] = hyy
    out[6] = hzz
    out[7] = hxy
    out[8] = hxz
    out[9] = hyz
