"""Lids over the holes of an open mesh, so that its generalized winding number follows from that of a closed one."""

# A. Jacobson, L. Kavan, O. Sorkine-Hornung, "Robust inside-outside segmentation using generalized winding numbers", 2013.
# A. van Oosterom, J. Strackee, "The solid angle of a plane triangle", 1983.
# A fan of triangles over each hole closes the mesh. The winding number of the whole is an integer, which scan conversion
# counts, and that of the mesh alone is less by the solid angles of the fans: a few triangles, and small except close to a hole.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import each, frozen, kernel
from intaglio.mesh import TriangleMesh, merge_vertices
from intaglio.solid.grid import Shape
from intaglio.solid.nearest import world
from intaglio.solid.point_triangle import frames_of, nearest_place

Triangles = NDArray[np.int32]
# Voxels along the side of a block.
BLOCK = 8


@kernel
def solid_angle(lids, x, y, z):  # type: ignore[no-untyped-def]
    """Of all lids seen from a point, in parts of the full sphere; negative where a front faces the point.

    The tangents of half the angles are the arguments of complex numbers: multiplied instead of added up, with the turns
    counted, they need one arc tangent.
    """
    re, im, turns = 1.0, 0.0, 0
    for n in range(len(lids)):
        a, b, c = lids[n]
        ax, ay, az = a[0] - x, a[1] - y, a[2] - z
        bx, by, bz = b[0] - x, b[1] - y, b[2] - z
        cx, cy, cz = c[0] - x, c[1] - y, c[2] - z
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
        if n % 64 == 63:
            size = abs(re) + abs(im)
            re, im = re / size, im / size
    return turns + math.atan2(im, re) / (2 * math.pi)


@kernel
def _far_from_lids(begin, end, lids, frames, area, reach, matrix, angle, slack):  # type: ignore[no-untyped-def]
    """Per block of voxels the lids' solid angles in its middle, and by how much others in it may differ.

    Both stay zero where the angles cannot add up to a quarter of the sphere.
    """
    for k in range(begin, end):
        for j in range(angle.shape[1]):
            for i in range(angle.shape[2]):
                x, y, z = world(matrix, i * BLOCK + 3.5, j * BLOCK + 3.5, k * BLOCK + 3.5)
                most, change = 0.0, 0.0
                for n in range(len(lids)):
                    qx, qy, qz = nearest_place(frames[n], x, y, z)
                    d = math.sqrt((qx - x) ** 2 + (qy - y) ** 2 + (qz - z) ** 2) - reach
                    if d <= 0:
                        most, change = 1.0, math.inf
                        break
                    # Area over distance squared; never more than half of the sphere.
                    most += min(0.5, area[n] / (4 * math.pi * d * d))
                    # The law of Biot and Savart: the slope of a surface's solid angle is a sum over its edge alone.
                    a, b = lids[n, 0], lids[n, 1]
                    edge = math.sqrt((a[0] - b[0]) ** 2 + (a[1] - b[1]) ** 2 + (a[2] - b[2]) ** 2)
                    change += reach * edge / (4 * math.pi * d * d)
                if most >= 0.25:
                    slack[k, j, i] = change
                    if change < 0.5:
                        angle[k, j, i] = solid_angle(lids, x, y, z)


def net_edges(triangles: Triangles) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """The boundary of a set of oriented triangles as a chain: edges (n, 2), and how often each is left over (n,), not zero.

    An edge counts +1 for a triangle that runs along it and -1 for one that runs against it, so that edges of more than
    two triangles may well cancel out. Where nothing is left, every winding number is an integer.
    """
    a, b, c = triangles.T.astype(np.int64)
    from_, to = np.concatenate([a, b, c]), np.concatenate([b, c, a])
    count = int(triangles.max()) + 1
    # Both ends and, in the last bit, the direction: sorted, all uses of an edge stand together.
    key = np.sort((np.minimum(from_, to) * count + np.maximum(from_, to)) * 2 + (from_ < to))
    edge, forward = key >> 1, (key & 1) * 2 - 1
    starts = np.flatnonzero(np.concatenate([[True], edge[1:] != edge[:-1]]))
    net = np.where(edge[starts] // count == edge[starts] % count, 0, np.add.reduceat(forward, starts))
    left = edge[starts[net != 0]]
    return np.stack([left // count, left % count], axis=1), net[net != 0]


def lids_of(mesh: TriangleMesh) -> tuple[NDArray[np.float64], int]:
    """Triangles (n, 3, 3) that close the mesh, in mm, and the number of holes; n = 0 where it is closed already."""
    vertices: NDArray[np.float64] = mesh.vertices
    edges, net = net_edges(mesh.triangles)
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


def angles_in_blocks(
    lids: NDArray[np.float64], shape: Shape, world_from_index: NDArray[np.float64]
) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    """Per block of voxels, (z, y, x): the lids' solid angle in its middle, and by how much others in it may differ from that.

    Both are zero where the angle stays below a quarter of the sphere; where it may differ by a half or more, the first is.
    """
    angle, slack = np.zeros([2, *(-(-n // BLOCK) for n in shape)])
    if len(lids):
        area = np.linalg.norm(np.cross(lids[:, 1] - lids[:, 0], lids[:, 2] - lids[:, 0]), axis=1) / 2
        signs = np.array([(a, b, c) for a in (-1, 1) for b in (-1, 1) for c in (-1, 1)])
        reach = (BLOCK - 1) / 2 * float(np.linalg.norm(signs @ world_from_index[:3, :3].T, axis=1).max())
        fixed = (lids, frames_of(lids), area, reach, frozen(world_from_index), angle, slack)
        each(_far_from_lids, [(k, k + 1, *fixed) for k in range(len(slack))])
    return angle, slack
