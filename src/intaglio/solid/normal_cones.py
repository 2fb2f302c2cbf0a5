"""How far the normals about each triangle's corners turn away from its own."""

# L. Shirman, S. Abi-Ezzi, "The cone of normals technique for fast processing of curved patches", 1993.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import frozen, kernel, strips

# Cosine of the angle from which on nothing is said.
LEAST = 0.5


@kernel
def _normals(begin, end, vertices, triangles, normals):  # type: ignore[no-untyped-def]
    """Unit normals; (0, 0, 0) for a triangle that has none."""
    for n in range(begin, end):
        a, b, c = triangles[n]
        ux, uy, uz = vertices[b, 0] - vertices[a, 0], vertices[b, 1] - vertices[a, 1], vertices[b, 2] - vertices[a, 2]
        vx, vy, vz = vertices[c, 0] - vertices[a, 0], vertices[c, 1] - vertices[a, 1], vertices[c, 2] - vertices[a, 2]
        nx, ny, nz = uy * vz - uz * vy, uz * vx - ux * vz, ux * vy - uy * vx
        length = math.sqrt(nx * nx + ny * ny + nz * nz)
        # A needle's normal is rounding.
        some = length > 1e-9 * (ux * ux + uy * uy + uz * uz + vx * vx + vy * vy + vz * vz)
        normals[n, 0], normals[n, 1], normals[n, 2] = (nx / length, ny / length, nz / length) if some else (0.0, 0.0, 0.0)


@kernel
def _cones(triangles, normals, whole, axes, cosines):  # type: ignore[no-untyped-def]
    """At each vertex the mean normal and the cosine to the one farthest from it; -1 where the surface is not whole."""
    for n in range(len(triangles)):
        for k in range(3):
            v = triangles[n, k]
            for i in range(3):
                axes[v, i] += normals[n, i]
    for v in range(len(whole)):
        length = math.sqrt(axes[v, 0] ** 2 + axes[v, 1] ** 2 + axes[v, 2] ** 2)
        cosines[v] = 1.0 if whole[v] and length > 0.0 else -1.0
        for i in range(3):
            axes[v, i] /= max(length, 1e-300)
    for n in range(len(triangles)):
        for k in range(3):
            v = triangles[n, k]
            cosine = axes[v, 0] * normals[n, 0] + axes[v, 1] * normals[n, 1] + axes[v, 2] * normals[n, 2]
            cosines[v] = min(cosines[v], cosine)


@kernel
def _sines(begin, end, triangles, normals, axes, cosines, sines):  # type: ignore[no-untyped-def]
    for n in range(begin, end):
        least = 1.0
        for k in range(3):
            v = triangles[n, k]
            mine = axes[v, 0] * normals[n, 0] + axes[v, 1] * normals[n, 1] + axes[v, 2] * normals[n, 2]
            if cosines[v] <= LEAST:
                least = -1.0
                break
            # From the triangle's normal to the axis of the cone, and from there to its border.
            both = mine * cosines[v] - math.sqrt(max(1.0 - mine * mine, 0.0) * max(1.0 - cosines[v] * cosines[v], 0.0))
            least = min(least, both)
        sines[n] = math.sqrt(max(1.0 - least * least, 0.0)) + 1e-6 if least > LEAST else 1.0


def normals_and_spread(
    vertices: NDArray[np.float64], triangles: NDArray[np.int32], left: NDArray[np.int64]
) -> tuple[NDArray[np.float64], NDArray[np.float32]]:
    """Unit normals (n, 3), and the sine of the largest angle to a normal of a triangle that shares a vertex (n,).

    left (m, 2) are edges that triangles use one way more often than the other. At their vertices triangles do not close; there,
    and where the angle exceeds 60 degrees, the sine is 1.
    """
    vertices, triangles = frozen(vertices), frozen(triangles)
    whole = np.ones(len(vertices), dtype=np.bool_)
    whole[left] = False
    normals = np.empty((len(triangles), 3))
    strips(_normals, len(triangles), vertices, triangles, normals, size=2**15)
    axes, cosines = np.zeros((len(whole), 3)), np.empty(len(whole))
    _cones(triangles, normals, whole, axes, cosines)
    sines = np.empty(len(triangles), dtype=np.float32)
    strips(_sines, len(triangles), triangles, normals, axes, cosines, sines, size=2**15)
    return normals, sines
