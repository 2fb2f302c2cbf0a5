"""Geometry of scans: LPS, which files speak, to RAS+, which we do."""

from __future__ import annotations

from collections.abc import Iterable, Sequence

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError

Matrix = NDArray[np.float64]

UNPLACED = "no orientation stored"
NO_ORIENTATION = f"{UNPLACED}: taken as axes=LPS, x to the patient's left, y posterior, z superior"
# The sides to which the axes of an array may run, RAS+.
SIDES = {"R": (1, 0, 0), "L": (-1, 0, 0), "A": (0, 1, 0), "P": (0, -1, 0), "S": (0, 0, 1), "I": (0, 0, -1)}


def directions(axes: str) -> Matrix:
    """3x3, its columns unit vectors to the sides that three letters name, such as LPS: where x, y and z run."""
    columns = [SIDES.get(letter, (0, 0, 0)) for letter in axes.upper()] if isinstance(axes, str) else []
    matrix = np.array(columns, dtype=np.float64).T
    if matrix.shape != (3, 3) or abs(np.linalg.det(matrix)) != 1:
        raise InputError(
            "axes must say to which side columns, rows and slices run, one of R and L, of A and P, of S and I, in any order, "
            f"such as LPS, not {axes!r}"
        )
    return matrix


def is_placed(notes: Iterable[str]) -> bool:
    """Whether nothing in a reader's notes says that it had to guess where the patient's sides are."""
    return not any(note.startswith(UNPLACED) for note in notes)


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
