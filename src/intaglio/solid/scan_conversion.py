"""voxelize: which voxel centres lie inside a mesh."""

# T. Kaehler, "Vergleich von Volumenmodellen", 2010, chapter 2: scan conversion of closed meshes.
# H. Edelsbrunner, E. Muecke, "Simulation of simplicity", 1990: rows that meet an edge or a vertex are moved aside by less
# than any number, so that each shared edge belongs to one of its triangles.

from __future__ import annotations

import math
from dataclasses import dataclass
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress, each, frozen, helper, kernel, strips
from intaglio.errors import InputError
from intaglio.mesh import TriangleMesh
from intaglio.solid.edges import Edges
from intaglio.solid.grid import Shape, grid_around
from intaglio.solid.lids import BLOCK, angles_in_layers, lids_of, solid_angle
from intaglio.solid.nearest import world
from intaglio.solid.point_triangle import frames_of
from intaglio.volume import Volume

WINDING, PARITY = 0, 1
# Bits of a coordinate in fixed point: products of two differences must fit into 63.
BITS = 29
# Crossings counted at a time, in voxels.
SLAB = 2**18
# So close to a half, a winding number is not taken from a polynomial.
CLOSE = 1e-3


@helper
def _beside(ay, az, by, bz, py, pz):  # type: ignore[no-untyped-def]
    """Twice the area of a, b, p in the plane (y, z): exact in integers."""
    return (by - ay) * (pz - az) - (bz - az) * (py - ay)


@helper
def _takes(value, ay, az, by, bz):  # type: ignore[no-untyped-def]
    """Whether p lies left of a -> b, or on it and then when moved by (e, e * e) in (y, z)."""
    return value > 0 or (value == 0 and (bz < az or (bz == az and by > ay)))


@kernel
def _layers(begin, end, fixed, triangles, shift, shape, first, last):  # type: ignore[no-untyped-def]
    """First and last layer z of the grid that each triangle may meet; none where last < first."""
    one = (1 << shift) - 1
    for t in range(begin, end):
        a, b, c = triangles[t]
        low = min(fixed[a, 1], min(fixed[b, 1], fixed[c, 1]))
        high = max(fixed[a, 1], max(fixed[b, 1], fixed[c, 1]))
        left = min(fixed[a, 0], min(fixed[b, 0], fixed[c, 0]))
        right = max(fixed[a, 0], max(fixed[b, 0], fixed[c, 0]))
        first[t] = max(0, (low + one) >> shift)
        last[t] = min(shape[0] - 1, high >> shift)
        if right < 0 or (left >> shift) >= shape[1]:
            last[t] = -1


@kernel
def _sorted_into(slabs, thick, shared, first, last, start, members):  # type: ignore[no-untyped-def]
    """Triangles of each slab of layers, in order: members[start[s] : start[s + 1]]. Counts only where members is empty."""
    for t in range(len(first)):
        if first[t] <= last[t]:
            for s in range(max(0, first[t] - shared) // thick, min(last[t] // thick, slabs - 1) + 1):
                if len(members):
                    members[start[s]] = t
                    start[s] += 1
                else:
                    start[s + 1] += 1


@kernel
def scan(z0, z1, members, fixed, along, triangles, shift, rule, lids, frames, matrix, turned, base, inside, doubt):  # type: ignore[no-untyped-def]
    """Fill layers z0..z1 of `inside`, which begins at layer `base`: crossings of each row with its triangles, summed along x."""
    _, ny, nx = inside.shape
    rows = (z1 - z0) * ny
    crossing = np.zeros((rows, nx + 1), dtype=np.int32)
    begin = np.full(rows, nx + 1, dtype=np.int32)
    end = np.zeros(rows, dtype=np.int32)
    step = np.int64(1) << shift
    for t in members:
        a, b, c = triangles[t]
        ay, az, by, bz, cy, cz = fixed[a, 0], fixed[a, 1], fixed[b, 0], fixed[b, 1], fixed[c, 0], fixed[c, 1]
        area = _beside(ay, az, by, bz, cy, cz)
        if area == 0:
            continue
        sign = -1
        if area < 0:
            b, c, by, bz, cy, cz, area, sign = c, b, cy, cz, by, bz, -area, 1
        xa, xb, xc = along[a], along[b], along[c]
        first_z = max(z0, (min(az, min(bz, cz)) + step - 1) >> shift)
        last_z = min(z1 - 1, max(az, max(bz, cz)) >> shift)
        first_y = max(0, (min(ay, min(by, cy)) + step - 1) >> shift)
        last_y = min(ny - 1, max(ay, max(by, cy)) >> shift)
        for z in range(first_z, last_z + 1):
            for y in range(first_y, last_y + 1):
                py, pz = y << shift, z << shift
                wa = _beside(by, bz, cy, cz, py, pz)
                wb = _beside(cy, cz, ay, az, py, pz)
                wc = _beside(ay, az, by, bz, py, pz)
                if _takes(wa, by, bz, cy, cz) and _takes(wb, cy, cz, ay, az) and _takes(wc, ay, az, by, bz):
                    x = (wa * xa + wb * xb + wc * xc) / area
                    i = 0 if x <= 0.0 else nx if x > nx - 1 else int(math.ceil(x))
                    row = (z - z0) * ny + y
                    crossing[row, i] += sign
                    begin[row] = min(begin[row], i)
                    end[row] = max(end[row], i)
    low = z0 // BLOCK * BLOCK
    angle = np.empty((z1 - low, ny, nx if len(lids) else 0), dtype=np.float32)
    every = np.arange(len(lids)).astype(np.int32)
    for z in range(low, z1 if len(lids) else low, BLOCK):
        angles_in_layers(z, lids, frames, matrix, angle[z - low : z - low + BLOCK])
    for row in range(rows):
        z, y = z0 + row // ny, row % ny
        total = 0
        out = inside[z - base, y]
        for i in range(begin[row], min(end[row] + 1, nx)):
            total += crossing[row, i]
            crossing[row, i] = total
            out[i] = total & 1 if rule == PARITY else total != 0
        if len(lids) == 0:
            continue
        for i in range(nx):
            total = turned * crossing[row, i]
            winding = abs(total - angle[z - low, y, i])
            if abs(winding - 0.5) < CLOSE:
                u, v, w = world(matrix, i, y, z)
                winding = abs(total - solid_angle(lids, every, len(lids), u, v, w))
            out[i] = winding > 0.5
            doubt[z - base] += 0.25 < winding < 0.75


def _fixed(points: NDArray[np.float64], shape: Shape, name: str) -> tuple[NDArray[np.int64], int]:
    """y and z of points in index space, in fixed point of BITS bits, and how many of these stand behind the point."""
    most = max(float(np.abs(points[:, 1:]).max()), *shape)
    shift = BITS - 1 - math.ceil(math.log2(most + 1))
    if shift < 0:
        raise InputError(f"{name}: is {most:.3g} voxels away or large; check units, or take a grid that holds it")
    return np.rint(points[:, 1:] * 2.0**shift).astype(np.int64), shift


@dataclass(frozen=True)
class Slabs:
    """A mesh and a grid made ready for `scan`: its arguments for each slab of layers, but for where to write to.

    A slab goes `shared` layers into the next, where there is one. One that has nothing to say may be missing.
    """

    jobs: list[tuple[Any, ...]]
    name: str
    notes: tuple[str, ...]
    fans: int
    holes: int

    def notes_with(self, some: bool, doubt: int) -> tuple[str, ...]:
        """What had to be assumed, one sentence each, given whether some voxel is inside and how many are in doubt."""
        notes = list(self.notes)
        if self.fans:
            notes.append(
                f"{self.name}: open, {self.fans} edges round {self.holes} hole{'s' * (self.holes > 1)}; inside is where the "
                f"generalized winding number exceeds a half, which leaves {doubt} voxels in doubt (0.25 to 0.75)"
            )
        if not some:
            notes.append(f"{self.name}: no voxel centre of the grid lies inside")
        return tuple(notes)


def slabs_of(
    mesh: TriangleMesh,
    shape: Shape,
    world_from_index: NDArray[np.float64],
    thick: int | None = None,
    shared: int = 0,
    left: Edges | None = None,
) -> Slabs:
    """The slabs of `thick` + `shared` layers that a grid falls into; without `thick`, of as many as a job had best do.

    left: the mesh's net edges, if these are at hand.
    """
    fans, holes = lids_of(mesh, left)
    rule, notes = WINDING, []
    vertices, triangles = mesh.vertices, mesh.triangles
    if len(fans) and mesh.report.closed:
        rule = PARITY
        notes.append(f"{mesh.name}: triangles face different ways; inside is what an odd number of them separates from outside")
    elif len(fans):
        extra = np.arange(3 * len(fans), dtype=np.int32).reshape(-1, 3) + len(vertices)
        vertices, triangles = np.concatenate([vertices, fans.reshape(-1, 3)]), np.concatenate([triangles, extra])
    index_from_world = np.linalg.inv(world_from_index)
    points = vertices @ index_from_world[:3, :3].T + index_from_world[:3, 3]
    fixed, shift = _fixed(points, shape, mesh.name)
    fixed, triangles = frozen(fixed), frozen(triangles)
    first, last = np.empty(len(triangles), dtype=np.int32), np.empty(len(triangles), dtype=np.int32)
    strips(_layers, len(triangles), fixed, triangles, shift, shape, first, last, size=2**15)
    if rule == PARITY:
        fans = fans[:0]
    thick = thick or (BLOCK if len(fans) else 0) or max(1, min(BLOCK, SLAB // (shape[1] * (shape[2] + 1))))
    slabs = -(-(shape[0] - shared) // thick)
    start = np.zeros(slabs + 1, dtype=np.int64)
    _sorted_into(slabs, thick, shared, first, last, start, np.empty(0, dtype=np.int32))
    start = np.cumsum(start)
    members = np.empty(start[-1], dtype=np.int32)
    if len(members):
        _sorted_into(slabs, thick, shared, first, last, start[:-1].copy(), members)
    turned = 1 if np.linalg.det(world_from_index) > 0 else -1
    surface = (fixed, frozen(points[:, 0]), triangles, shift, rule)
    lids = (fans, frames_of(fans), frozen(world_from_index), turned)
    jobs = []
    for s in range(slabs):
        z0, z1, mine = s * thick, min(shape[0], (s + 1) * thick + shared), members[start[s] : start[s + 1]]
        if len(mine) or len(fans):
            jobs.append((z0, z1, mine, *surface, *lids))
    return Slabs(jobs, mesh.name, tuple(notes), len(fans), holes)


def occupancy(
    mesh: TriangleMesh,
    shape: Shape,
    world_from_index: NDArray[np.float64],
    progress: Progress | None = None,
    left: Edges | None = None,
) -> tuple[NDArray[np.bool_], tuple[str, ...]]:
    """Inside or not of each voxel centre (z, y, x), and what had to be assumed, one sentence each."""
    slabs = slabs_of(mesh, shape, world_from_index, left=left)
    inside = np.zeros(shape, dtype=np.bool_)
    doubt = np.zeros(shape[0], dtype=np.int64)
    each(scan, [(*job, 0, inside.view(np.uint8), doubt) for job in slabs.jobs], progress=progress)
    return inside, slabs.notes_with(bool(inside.any()), int(doubt.sum()))


def voxelize(
    mesh: TriangleMesh,
    *,
    resolution: int | None = None,
    spacing: float | None = None,
    like: Volume | None = None,
    progress: Progress | None = None,
) -> Volume:
    """The voxels whose centres lie inside a mesh: a volume of bool.

    resolution  voxels along the longest side of a grid around the mesh, which has 5 % of the mesh's extent to spare on
                each side
    spacing     or the distance of its voxels in mm
    like        or a volume whose grid is taken, turned or sheared as it may be
    progress    called with slabs done and in all

    Inside is where the surface winds round a point: shells that overlap or lie within one another add up, a shell that
    faces inwards within one that faces outwards leaves a cavity, and shells that stand apart are solid whichever way they
    face. Crossings are counted exactly on coordinates rounded to 2^-16 of a voxel or finer; a voxel centre on the surface
    belongs to one side by a rule that leaves neither gaps nor doubles.
    A mesh with holes is decided by its generalized winding number, one whose triangles face different ways by parity;
    the volume's notes say so, with numbers. Raises InputError for a mesh without extent or a grid that is not one.
    Source: scan conversion, Kaehler 2010; generalized winding numbers, Jacobson et al. 2013.
    """
    shape, matrix = grid_around(mesh, resolution, spacing, like)
    inside, notes = occupancy(mesh, shape, matrix, progress)
    return Volume(inside, matrix, f"{mesh.name} voxelized", notes)
