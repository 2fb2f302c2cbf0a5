"""Geometry of scans: LPS, which files speak, to RAS+, which we do."""

from __future__ import annotations

from collections.abc import Sequence

import numpy as np
from numpy.typing import NDArray

Matrix = NDArray[np.float64]

NO_ORIENTATION = "no orientation stored: x taken to run to the patient's left, y posterior, z superior"


def ras_from_lps(matrix: Matrix) -> Matrix:
    """A 4x4 transform to LPS mm, turned into one to RAS+ mm."""
    return np.diag([-1.0, -1.0, 1.0, 1.0]) @ matrix


def world_from_index(
    spacing: Sequence[float],
    origin: Sequence[float] = (0.0, 0.0, 0.0),
    direction: Sequence[float] = (1.0, 0.0, 0.0, 0.0, 1.0, 0.0, 0.0, 0.0, 1.0),
) -> Matrix:
    """RAS+ transform from spacing, origin and direction cosines (row-major) in LPS; axes beyond three are left out."""
    size = round(len(direction) ** 0.5)
    matrix = np.eye(4)
    matrix[:3, :3] = np.reshape(direction, (size, size))[:3, :3] * np.asarray(spacing[:3])
    matrix[:3, 3] = origin[:3]
    return ras_from_lps(matrix)
