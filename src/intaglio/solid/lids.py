"""Lids over the holes of an open mesh, so that its generalized winding number follows from that of a closed one."""

# A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", 2013.
# A. van Oosterom, J. Strackee, "The solid angle of a plane triangle", 1983.
# G. Barill et al., "Fast winding numbers for soups and clouds", 2018: lids far away are summed up; here, as polynomials.
# A fan of triangles over each hole closes the mesh. The winding number of the whole is an integer, which scan conversion
# counts, and that of the mesh alone is less by the solid angles of the fans: a few triangles, and small except close to a hole.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel
from intaglio.mesh import TriangleMesh, merge_vertices
from intaglio.solid.edges import Edges, net_edges
from intaglio.solid.nearest import world
from intaglio.solid.point_triangle import nearest_place

# Voxels along the side of a block.
BLOCK = 8
# Nodes of a polynomial along each axis; lids count as far from this many times half of a box's diagonal on.
NODES, FAR = 4, 2.5
NODE = np.cos((2 * np.arange(NODES) + 1) * np.pi / (2 * NODES))


def _lagrange(places: NDArray[np.float64]) -> NDArray[np.float64]:
    """(n, NODES) matrix that takes values at the nodes to those at places in -1 .. 1."""
    out = np.ones((len(places), NODES))
    for m in range(NODES):
        for other in set(range(NODES)) - {m}:
            out[:, m] *= (places - NODE[other]) / (NODE[m] - NODE[other])
    return out


# From a box to the nodes of its halves, and to the voxel centres of a block.
HALF = np.stack([_lagrange((NODE - 1) / 2), _lagrange((NODE + 1) / 2)])
CENTRE = _lagrange((2 * np.arange(BLOCK) + 1) / BLOCK - 1)


@kernel
def solid_angle(lids, which, count, x, y, z):  # type: ignore[no-untyped-def]
    """Of some lids seen from a point, in parts of the full sphere; negative where a front faces the point.

    The tangents of half the angles are the arguments of complex numbers: multiplied instead of added up, with the turns
    counted, they need one arc tangent.
    """
    re, im, turns = 1.0, 0.0, 0
    for m in range(count):
        n = which[m]
        ax, ay, az = lids[n, 0, 0] - x, lids[n, 0, 1] - y, lids[n, 0, 2] - z
        bx, by, bz = lids[n, 1, 0] - x, lids[n, 1, 1] - y, lids[n, 1, 2] - z
        cx, cy, cz = lids[n, 2, 0] - x, lids[n, 2, 1] - y, lids[n, 2, 2] - z
        la, lb = math.sqrt(ax * ax + ay * ay + az * az), math.sqrt(bx * bx + by * by + bz * bz)
        lc = math.sqrt(cx * cx + cy * cy + cz * cz)
        v = ax * (by * cz - bz * cy) + ay * (bz * cx - bx * cz) + az * (bx * cy - by * cx)
        u = la * lb * lc + (ax * bx + ay * by + az * bz) * lc + (bx * cx + by * cy + bz * cz) * la
        u += (cx * ax + cy * ay + cz * az) * lb
        size = abs(u) + abs(v)
        if size == 0.0:
            continue
        p, q = (re * u - im * v) / size, (re * v + im * u) / size
        if im >= 0 and v >= 0 and q < 0:
            turns += 1
        elif im < 0 and v < 0 and q >= 0:
            turns -= 1
        re, im = p, q
        if m % 64 == 63:
            size = abs(re) + abs(im)
            re, im = re / size, im / size
    return turns + math.atan2(im, re) / (2 * math.pi)


@kernel
def _interpolate(values, along_x, along_y, along_z, out):  # type: ignore[no-untyped-def]
    """out = the polynomial with these values at the nodes, at the places along each axis that the matrices stand for."""
    n = len(along_x)
    one, two = np.zeros((NODES, NODES, n)), np.zeros((NODES, n, n))
    for k in range(NODES):
        for j in range(NODES):
            for m in range(NODES):
                for i in range(n):
                    one[k, j, i] += along_x[i, m] * values[k, j, m]
        for j in range(n):
            for m in range(NODES):
                for i in range(n):
                    two[k, j, i] += along_y[j, m] * one[k, m, i]
    for k in range(n):
        for j in range(n):
            for i in range(n):
                out[k, j, i] = 0.0
            for m in range(NODES):
                for i in range(n):
                    out[k, j, i] += along_z[k, m] * two[m, j, i]


@kernel
def angles_in_layers(z0, lids, frames, matrix, angle):  # type: ignore[no-untyped-def]
    """angle = the lids' solid angles at the voxels of BLOCK layers from z0 on, a multiple of BLOCK; to about 1e-4.

    A box of voxels takes the far lids into a polynomial and leaves the others to its halves, down to blocks.
    """
    layers, ny, nx = angle.shape
    levels = 1
    while BLOCK << (levels - 1) < max(z0 + BLOCK, max(ny, nx)):
        levels += 1
    diagonal = 0.0
    for k in range(4):
        square = 0.0
        for axis in range(3):
            a, b = matrix[axis, 0], matrix[axis, 1]
            square += ((-a if k & 1 else a) + (-b if k & 2 else b) + matrix[axis, 2]) ** 2
        diagonal = max(diagonal, math.sqrt(square))
    near = np.empty((levels + 1, len(lids)), dtype=np.int32)
    for n in range(len(lids)):
        near[0, n] = n
    counts = np.zeros(levels + 1, dtype=np.int64)
    counts[0] = len(lids)
    far = np.empty(len(lids), dtype=np.int32)
    values = np.zeros((levels + 1, NODES, NODES, NODES))
    block = np.empty((BLOCK, BLOCK, BLOCK))
    # Which quarter of a box comes next, and where the box is; all boxes hold the layers.
    turn, place = np.zeros(levels + 1, dtype=np.int64), np.zeros((levels + 1, 2), dtype=np.int64)
    level = 0
    while level >= 0:
        if turn[level] == (4 if level else 1):
            turn[level] = 0
            level -= 1
            continue
        side = BLOCK << (levels - 1 - level)
        quarter = turn[level]
        turn[level] += 1
        x, y, z = place[level, 0] + side * (quarter & 1), place[level, 1] + side * (quarter >> 1), z0 // side * side
        if x >= nx or y >= ny:
            continue
        to = level + 1
        if level:
            _interpolate(values[level], HALF[quarter & 1], HALF[quarter >> 1], HALF[z // side & 1], values[to])
        middle = 0.5 * side - 0.5
        u, v, w = world(matrix, x + middle, y + middle, z + middle)
        apart, counts[to] = 0, 0
        for m in range(counts[level]):
            n = near[level, m]
            qx, qy, qz = nearest_place(frames[n], u, v, w)
            if (qx - u) ** 2 + (qy - v) ** 2 + (qz - w) ** 2 > (FAR * 0.5 * side * diagonal) ** 2:
                far[apart] = n
                apart += 1
            else:
                near[to, counts[to]] = n
                counts[to] += 1
        if apart:
            for k in range(NODES):
                for j in range(NODES):
                    for i in range(NODES):
                        half = 0.5 * side
                        u, v, w = world(
                            matrix, x + middle + half * NODE[i], y + middle + half * NODE[j], z + middle + half * NODE[k]
                        )
                        values[to, k, j, i] += solid_angle(lids, far, apart, u, v, w)
        if to < levels:
            place[to, 0], place[to, 1] = x, y
            level = to
            continue
        _interpolate(values[to], CENTRE, CENTRE, CENTRE, block)
        for k in range(layers):
            for j in range(min(BLOCK, ny - y)):
                for i in range(min(BLOCK, nx - x)):
                    rest = 0.0
                    if counts[to]:
                        u, v, w = world(matrix, x + i, y + j, z + k)
                        rest = solid_angle(lids, near[to], counts[to], u, v, w)
                    angle[k, y + j, x + i] = block[k, j, i] + rest


def lids_of(mesh: TriangleMesh, left: Edges | None = None) -> tuple[NDArray[np.float64], int]:
    """Triangles (n, 3, 3) that close the mesh, in mm, and the number of holes; n = 0 where it is closed already.

    left: its net edges, if these are at hand.
    """
    vertices: NDArray[np.float64] = mesh.vertices
    edges, net = left or net_edges(mesh.triangles)
    if len(edges):
        # What meets in space but not by its indices, as along the seams of a texture, is not open.
        vertices, triangles = merge_vertices(mesh.vertices, mesh.triangles)
        edges, net = net_edges(triangles.astype(np.int32))
    if len(edges) == 0:
        return np.empty((0, 3, 3)), 0
    from scipy.sparse import coo_array
    from scipy.sparse.csgraph import connected_components

    ends, edge = np.unique(edges, return_inverse=True)
    edge = edge.reshape(edges.shape)
    graph = coo_array((np.ones(len(edge), dtype=bool), (edge[:, 0], edge[:, 1])), shape=(len(ends), len(ends)))
    holes, hole = connected_components(graph, directed=False)
    middle = np.stack([np.bincount(hole, vertices[ends, axis]) for axis in range(3)], axis=1) / np.bincount(hole)[:, None]
    # Against the edges of the mesh; an edge that is left over more than once gets as many triangles.
    from_, to = np.where(net[:, None] > 0, edge[:, ::-1], edge).T
    fan = np.stack([vertices[ends[from_]], vertices[ends[to]], middle[hole[from_]]], axis=1)
    return np.repeat(fan, np.abs(net), axis=0), int(holes)
