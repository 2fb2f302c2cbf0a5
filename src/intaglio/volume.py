"""Volume: a scan, a distance field or a label map on a regular grid."""

from __future__ import annotations

from dataclasses import dataclass
from functools import cached_property
from typing import Any

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.errors import InputError


@dataclass(frozen=True, eq=False)
class Volume:
    """Samples at voxel centres of a regular grid, placed in the patient.

    array             (z, y, x), any integer, float or bool type, native byte order; kept as it is
    world_from_index  4x4 float64; takes the index (x, y, z) of a voxel centre to RAS+ millimetres
    name              what messages and plates call it
    notes             what the reader had to assume or choose, one sentence each
    distances         whether the values are a solid's signed distances in mm, negative inside: its surface is at 0
    """

    array: NDArray[Any]
    world_from_index: NDArray[np.float64]
    name: str = "volume"
    notes: tuple[str, ...] = ()
    distances: bool = False

    def __post_init__(self) -> None:
        if not isinstance(self.array, np.ndarray) or self.array.ndim != 3:
            raise InputError(f"{self.name}: array must have three dimensions (z, y, x), not {np.shape(self.array)}")
        if min(self.array.shape) < 2:
            raise InputError(f"{self.name}: needs at least 2 voxels along each axis, not {self.array.shape} (z, y, x)")
        if self.array.dtype.kind not in "biuf" or not self.array.dtype.isnative:
            raise InputError(f"{self.name}: voxels must be bool, integer or float in native byte order, not {self.array.dtype}")
        if self.distances and self.array.dtype.kind != "f":
            raise InputError(f"{self.name}: distances must be floats, not {self.array.dtype}")
        matrix = np.asarray(self.world_from_index, dtype=np.float64)
        if not _is_placement(matrix):
            raise InputError(f"{self.name}: world_from_index must be an invertible affine 4x4 matrix, not {matrix.tolist()}")
        object.__setattr__(self, "world_from_index", matrix)

    @classmethod
    def from_array(
        cls,
        array: NDArray[Any],
        spacing: ArrayLike = (1.0, 1.0, 1.0),
        origin: ArrayLike = (0.0, 0.0, 0.0),
        name: str = "volume",
    ) -> Volume:
        """A volume whose axes x, y, z run to the right, anterior and superior.

        array (z, y, x); spacing and origin (x, y, z) in mm, origin being the centre of the first voxel.
        """
        step, first = np.asarray(spacing, dtype=np.float64), np.asarray(origin, dtype=np.float64)
        if step.shape not in ((), (3,)) or not (np.isfinite(step).all() and (step > 0).all()):
            raise InputError(f"{name}: spacing must be three positive numbers in mm, not {step.tolist()}")
        if first.shape != (3,) or not np.isfinite(first).all():
            raise InputError(f"{name}: origin must be three numbers in mm, not {first.tolist()}")
        matrix = np.diag([*np.broadcast_to(step, (3,)), 1.0])
        matrix[:3, 3] = first
        return cls(array, matrix, name)

    @property
    def shape(self) -> tuple[int, int, int]:
        """Voxels along (z, y, x)."""
        z, y, x = self.array.shape
        return z, y, x

    @cached_property
    def samples(self) -> NDArray[Any]:
        """The array as kernels take it: bool as uint8, the rare half and long floats as float32 and float64."""
        kind = self.array.dtype
        if kind == np.bool_:
            return self.array.view(np.uint8)
        if kind == np.float16:
            return self.array.astype(np.float32)
        return self.array.astype(np.float64) if kind.kind == "f" and kind.itemsize > 8 else self.array

    @cached_property
    def index_from_world(self) -> NDArray[np.float64]:
        """4x4, from RAS+ millimetres to the index (x, y, z)."""
        return np.asarray(np.linalg.inv(self.world_from_index), dtype=np.float64)

    @cached_property
    def spacing(self) -> NDArray[np.float64]:
        """Distance in mm of neighbouring voxels along the array's x, y and z."""
        return np.linalg.norm(self.world_from_index[:3, :3], axis=0)

    @cached_property
    def range(self) -> tuple[float, float]:
        """Smallest and largest value."""
        return float(self.array.min()), float(self.array.max())

    @cached_property
    def corners(self) -> NDArray[np.float64]:
        """(8, 3) world positions of the outermost voxel centres."""
        z, y, x = self.shape
        index = np.array([(i, j, k, 1.0) for k in (0, z - 1) for j in (0, y - 1) for i in (0, x - 1)])
        return (index @ self.world_from_index.T)[:, :3]


def check_volume(volume: object) -> None:
    """InputError for what is not a Volume, at the doors of functions that want one."""
    if not isinstance(volume, Volume):
        what = "a mesh: voxelize or distance_field makes a volume of it" if hasattr(volume, "triangles") else repr(volume)[:60]
        raise InputError(f"volume must be a Volume, such as read_volume gives, not {what}")


def _is_placement(matrix: NDArray[np.float64]) -> bool:
    """4x4, affine, and its axes, made unit, span space: voxels of a nanometre are as good as voxels of a metre."""
    if matrix.shape != (4, 4) or not np.isfinite(matrix).all() or matrix[3].tolist() != [0.0, 0.0, 0.0, 1.0]:
        return False
    length = np.linalg.norm(matrix[:3, :3], axis=0)
    return bool((length > 0).all() and abs(np.linalg.det(matrix[:3, :3] / length)) > 1e-6)
