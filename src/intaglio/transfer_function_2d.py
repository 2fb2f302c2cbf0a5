"""TransferFunction2D: colour and opacity from a value and from how steeply it changes there."""

# M. Levoy, "Display of surfaces from volume data", 1988: shells of even thickness around isovalues.
# J. Kniss, G. Kindlmann, C. Hansen, "Interactive volume rendering using multi-dimensional transfer functions", 2001.

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.errors import InputError
from intaglio.transfer_function import TransferFunction, corrected_opacity

# Values and slopes that the constructors make a table for.
VALUES, SLOPES = 512, 128


@dataclass(frozen=True, eq=False)
class TransferFunction2D:
    """Scalar and gradient magnitude to colour and opacity.

    array             (values, slopes, 4) float32: straight red, green, blue, opacity
    low, high         value of the first and the last row
    steepest          gradient magnitude of the last column, values per mm; that of the first is 0
    reference_length  mm of matter that have the opacity given
    Values and slopes beyond the table are taken as its border.
    """

    array: NDArray[np.float32]
    low: float
    high: float
    steepest: float
    reference_length: float = 1.0
    name: str = "transfer function"

    def __post_init__(self) -> None:
        array = np.ascontiguousarray(self.array, dtype=np.float32)
        if array.ndim != 3 or array.shape[2] != 4 or min(array.shape[:2]) < 2:
            raise InputError(f"{self.name}: array must be (values, slopes, 4), two of each at least, not {array.shape}")
        if not (array >= 0).all() or not (array <= 1).all():
            raise InputError(f"{self.name}: colours and opacities must be between 0 and 1 everywhere")
        if not (math.isfinite(self.low) and math.isfinite(self.high) and self.low < self.high):
            raise InputError(f"{self.name}: low must be below high, both finite, not {self.low!r} and {self.high!r}")
        if not 0 < self.steepest < math.inf:
            raise InputError(f"{self.name}: steepest must be a positive slope in values per mm, not {self.steepest!r}")
        if not 0 < self.reference_length < math.inf:
            raise InputError(f"{self.name}: reference_length must be a positive number of mm, not {self.reference_length!r}")
        object.__setattr__(self, "array", array)

    @classmethod
    def emphasized(
        cls,
        function: TransferFunction,
        range: tuple[float, float],
        slopes: Sequence[tuple[float, float]],
    ) -> TransferFunction2D:
        """A transfer function whose opacity is multiplied by a factor of the slope, as 3D Slicer's gradient opacity does.

        range   smallest and largest value of the data
        slopes  (gradient magnitude in values per mm, factor 0..1) by ascending magnitude, straight lines between
        """
        at, factor = _curve(slopes, function.name)
        steepest = float(at[-1]) if at[-1] > 0 else 1.0
        table = function.table(*range, VALUES)
        factors = np.interp(np.linspace(0.0, steepest, SLOPES), at, factor)
        array = np.repeat(table[:, None], SLOPES, axis=1)
        array[..., 3] *= factors
        return cls(array, *range, steepest, function.reference_length, function.name)

    @classmethod
    def shells(
        cls,
        surfaces: Iterable[tuple[float, Sequence[float], float]],
        range: tuple[float, float],
        *,
        thickness: float,
        steepest: float,
        reference_length: float = 1.0,
        name: str = "shells",
    ) -> TransferFunction2D:
        """Translucent shells around isovalues, equally thick wherever the boundary is sharp or blurred (Levoy 1988).

        surfaces   (isovalue, (red, green, blue), opacity) of each
        range      smallest and largest value of the data
        thickness  mm from a shell's middle, which is opaquest, to either side, where it ends
        steepest   gradient magnitude, in values per mm, of the sharpest boundary
        """
        if not 0 < thickness < math.inf:
            raise InputError(f"{name}: thickness must be a positive number of mm, not {thickness!r}")
        value = np.linspace(*range, VALUES)[:, None]
        slope = np.linspace(0.0, steepest, SLOPES)[None]
        colour = np.zeros((VALUES, SLOPES, 3))
        clear = np.ones((VALUES, SLOPES))
        for iso, rgb, opacity in surfaces:
            near = np.abs(value - iso) / np.maximum(thickness * slope, 1e-30)
            a = np.where(slope > 0, opacity * np.clip(1.0 - near, 0.0, 1.0), 0.0)
            colour += (clear * a)[..., None] * np.asarray(rgb)
            clear *= 1.0 - a
        a = 1.0 - clear
        array = np.concatenate([colour / np.maximum(a, 1e-12)[..., None], a[..., None]], axis=2)
        return cls(np.clip(array, 0.0, 1.0), *range, steepest, reference_length, name)

    def table(self, step: float) -> NDArray[np.float32]:
        """The array with opacities of `step` mm."""
        out = self.array.copy()
        out[..., 3] = corrected_opacity(out[..., 3], step, self.reference_length)
        return out

    def visible(self, low: ArrayLike, high: ArrayLike) -> NDArray[np.bool_]:
        """Whether any value from low to high has an opacity above 0 at any slope; for arrays of blocks' extremes."""
        rows = np.concatenate([[0], np.cumsum(self.array[..., 3].max(axis=1) > 0)])
        scale = (len(rows) - 2) / (self.high - self.low)
        last = len(rows) - 2
        with np.errstate(invalid="ignore"):
            first = np.clip(np.floor((np.asarray(low, dtype=np.float64) - self.low) * scale), 0, last)
            past = np.clip(np.ceil((np.asarray(high, dtype=np.float64) - self.low) * scale), 0, last)
        unknown = np.isnan(first) | np.isnan(past)
        a = np.where(unknown, 0, first).astype(np.int64)
        b = np.where(unknown, last, past).astype(np.int64)
        return np.asarray(rows[b + 1] > rows[a])


def _curve(slopes: Sequence[tuple[float, float]], name: str) -> tuple[NDArray[np.float64], NDArray[np.float64]]:
    curve = np.asarray(slopes, dtype=np.float64)
    if curve.ndim != 2 or curve.shape[1] != 2 or not np.isfinite(curve).all():
        raise InputError(f"{name}: slopes must be (gradient magnitude, factor) pairs, not {slopes!r}")
    if (np.diff(curve[:, 0]) < 0).any() or (curve[:, 0] < 0).any() or not ((curve[:, 1] >= 0) & (curve[:, 1] <= 1)).all():
        raise InputError(f"{name}: slopes must ascend from 0 on, with factors between 0 and 1, not {slopes!r}")
    return curve[:, 0], curve[:, 1]
