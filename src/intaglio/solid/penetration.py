"""penetration_depth: how far two solids are in each other."""

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import Progress
from intaglio.solid.field import check_field
from intaglio.solid.resample import resample
from intaglio.volume import Volume


@dataclass(frozen=True, eq=False)
class Penetration:
    """depth in mm, negative for a gap; place (3,) in RAS+ mm; direction (3,), unit, that frees the second solid."""

    depth: float
    place: NDArray[np.float64]
    direction: NDArray[np.float64]


# Up to this many voxels off, quadratic polynomials stand for the fields; beyond, there is an edge.
MISFIT = 0.05
# Less curvature than this, per voxel, is none.
FLAT = 0.01


def _fit(values: NDArray[np.float64], offsets: NDArray[np.float64]) -> tuple[NDArray[np.float64], float]:
    """The quadratic c + g d + d H d / 2 nearest to values at offsets, as (4, 4): [[H, g], [g, 2 c]]; and how far it is off."""
    d = np.column_stack([offsets, np.ones(len(offsets))])
    i, j = np.triu_indices(4)
    found = np.linalg.lstsq(d[:, i] * d[:, j], values, rcond=None)[0]
    matrix = np.zeros((4, 4))
    matrix[i, j] += found
    matrix[j, i] += found
    return matrix, float(np.abs(0.5 * np.einsum("ni,ij,nj->n", d, matrix, d) - values).max())


def _refined(
    a: NDArray[np.float64], b: NDArray[np.float64], offsets: NDArray[np.float64], step: float
) -> tuple[float, NDArray[np.float64], NDArray[np.float64]]:
    """The least sum of two fields near a voxel, where that is halfway between the surfaces, and the direction there; in mm."""
    (of_a, off_a), (of_b, off_b) = _fit(a, offsets), _fit(b, offsets)
    here = np.array([0.0, 0.0, 0.0, 1.0])
    depth = -float((a + b)[len(a) // 2])
    smooth = max(off_a, off_b) < MISFIT * step
    if smooth:
        both = of_a + of_b
        size, axes = np.linalg.eigh(both[:3, :3])
        # Along the way from surface to surface, and between parallel faces, the sum is the same.
        bent = size > FLAT / step
        here[:3] -= axes[:, bent] @ ((axes.T @ both[:3, 3])[bent] / size[bent])
        here[:3] *= min(1.0, step / max(float(np.linalg.norm(here[:3])), 1e-12))
        depth = -0.5 * float(here @ both @ here)
    slope = ((of_a - of_b) @ here)[:3]
    length = float(np.linalg.norm(slope))
    direction = slope / length if length > 0 else np.array([0.0, 0.0, 1.0])
    # a grows and b shrinks along the direction, by 1 each.
    along = -0.25 * float(here @ (of_a - of_b) @ here)
    return depth, here[:3] + direction * (along if smooth else min(max(along, -step), step)), direction


def penetration_depth(a: Volume, b: Volume, *, progress: Progress | None = None) -> Penetration:
    """How far two solids, given as signed distances in mm, are in each other, where, and which way b leaves a.

    depth      the greatest sum of the depths of one place in both. Round it, a ball of a and a ball of b of those radii
               overlap by as much, so no shift by less parts the solids; where they are round there, this shift does.
               Solids apart have a negative depth, the gap between them
    place      of all places with that sum, the one halfway between the surfaces
    direction  from a's surface outwards, at the place
    For exact distances, where surfaces are smooth, depth is exact to about 0.02 voxel and the place to 0.2, by quadratic
    polynomials through 27 voxels; at edges to half a voxel. b is resampled on a's grid; where the gap between solids apart lies
    beyond b's grid, its length is a lower bound.
    """
    check_field(a), check_field(b)
    other = resample(b, a, progress)
    total = a.array.astype(np.float32) + other
    # Where they overlap both are on their own grids, where distances are more than bounds.
    overlap = np.maximum(a.array, other) < 0
    if overlap.any():
        total[~overlap] = np.inf
    depth = -float(total.min())
    # Along the way from surface to surface the sum is the same but for the sampling.
    among = np.flatnonzero(total <= -depth + 0.02 * float(a.spacing.min()))
    uneven = np.abs(a.array.ravel()[among] - other.ravel()[among])
    k, j, i = (
        min(max(int(c), 1), n - 2) for c, n in zip(np.unravel_index(among[int(uneven.argmin())], a.shape), a.shape, strict=True)
    )
    around = (slice(max(k - 1, 0), k + 2), slice(max(j - 1, 0), j + 2), slice(max(i - 1, 0), i + 2))
    z, y, x = np.mgrid[around]
    offsets = np.stack([(x - i).ravel(), (y - j).ravel(), (z - k).ravel()], axis=1) @ a.world_from_index[:3, :3].T
    of_a, of_b = (field[around].ravel().astype(np.float64) for field in (a.array, other))
    depth, off, direction = _refined(of_a, of_b, offsets, float(a.spacing.min()))
    return Penetration(depth, (a.world_from_index @ (i, j, k, 1.0))[:3] + off, direction)
