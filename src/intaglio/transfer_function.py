"""TransferFunction: which value has which colour and how much of it shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from itertools import pairwise
from os import PathLike
from typing import TYPE_CHECKING, Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.drawing import check_colour
from intaglio.errors import InputError
from intaglio.piecewise import Floats, interpolated, peaks, zero_intervals
from intaglio.transfer_presets import CT_PRESETS, MR_PRESETS

if TYPE_CHECKING:
    from intaglio.volume import Volume

Interpolation = Literal["linear", "constant"]
Colour = tuple[float, float, float]


class ControlPoint(NamedTuple):
    """A scalar value, its display colour (red, green, blue) 0..1 and its opacity 0..1."""

    value: float
    colour: Colour
    opacity: float


class OpacityPeak(NamedTuple):
    """A local maximum of opacity: matter that a transfer function shows as a surface.

    value      where the maximum begins; opacity (of the reference length) and colour are those there
    threshold  the preceding minimum, from which opacity rises; -inf where it does not
    ceiling    the following minimum, down to which opacity falls; inf where it does not
    """

    value: float
    opacity: float
    colour: Colour
    threshold: float
    ceiling: float


@dataclass(frozen=True)
class TransferFunction:
    """Scalar to colour and opacity.

    points            by ascending value; the first and the last hold outwards. Colours are display
                      colours, not multiplied by opacity.
    interpolation     "linear": straight lines between points; two points of one value make a step.
                      "constant": each point holds from its value to the next one's.
    reference_length  mm of matter that have the opacity given
    """

    points: tuple[ControlPoint, ...]
    interpolation: Interpolation = "linear"
    reference_length: float = 1.0
    name: str = "transfer function"

    def __post_init__(self) -> None:
        if self.interpolation not in ("linear", "constant"):
            raise InputError(f"{self.name}: interpolation must be linear or constant, not {self.interpolation!r}")
        if not 0 < self.reference_length < math.inf:
            raise InputError(f"{self.name}: reference_length must be a positive number of mm, not {self.reference_length!r}")
        points = tuple(_control_point(p, self.name) for p in self.points)
        if not points:
            raise InputError(f"{self.name}: points must hold at least one (value, colour, opacity), not none")
        values = [p.value for p in points]
        for a, b in pairwise(values):
            if a > b:
                raise InputError(f"{self.name}: points must be sorted by value, not {a:g} before {b:g}")
            if a == b and self.interpolation == "constant":
                raise InputError(f"{self.name}: points of a constant transfer function must differ in value, not be {a:g} twice")
        for a, b in zip(values, values[2:], strict=False):
            if a == b:
                raise InputError(f"{self.name}: at most two points may share a value (a step), not three at {a:g}")
        if not math.isfinite(values[-1] - values[0]):
            raise InputError(f"{self.name}: points must be a finite distance apart, not run from {values[0]:g} to {values[-1]:g}")
        object.__setattr__(self, "points", points)

    @classmethod
    def from_points(
        cls,
        points: Iterable[tuple[float, str | Sequence[float], float]],
        *,
        interpolation: Interpolation = "linear",
        reference_length: float = 1.0,
        name: str = "transfer function",
    ) -> TransferFunction:
        """From (value, colour, opacity), the colour being "#rrggbb" or (red, green, blue) 0..1."""
        return cls(tuple(_control_point(p, name) for p in points), interpolation, reference_length, name)

    @classmethod
    def window(
        cls,
        centre: float,
        width: float,
        *,
        colours: Sequence[str | Sequence[float]] = ("#000000", "#ffffff"),
        opacities: tuple[float, float] = (0.0, 1.0),
        reference_length: float = 1.0,
        name: str = "window",
    ) -> TransferFunction:
        """Window and level: colours, evenly spaced, and opacity run from centre - width / 2 to centre + width / 2."""
        if not (math.isfinite(centre) and 0 < width < math.inf):
            raise InputError(f"{name}: window must be a number and a positive width, not {centre!r} and {width!r}")
        if len(colours) < 2:
            raise InputError(f"{name}: colours must be two or more, not {len(colours)}")
        part = np.linspace(0.0, 1.0, len(colours))
        points = [
            (centre + (t - 0.5) * width, colour, (1.0 - t) * opacities[0] + t * opacities[1])
            for t, colour in zip(part.tolist(), colours, strict=True)
        ]
        return cls.from_points(points, reference_length=reference_length, name=name)

    @classmethod
    def preset(cls, name: str, range: tuple[float, float] | None = None) -> TransferFunction:
        """A transfer function by name, see `presets`.

        range  smallest and largest value of the data; MR presets are relative to it and need it, CT presets
               are in Hounsfield units and do not use it
        """
        if name in CT_PRESETS:
            return cls.from_points(CT_PRESETS[name], name=name)
        if name not in MR_PRESETS:
            raise InputError(f"preset must be one of {', '.join(cls.presets())}, not {name!r}")
        if range is None:
            raise InputError(f"preset {name} is relative to the data: give range=(smallest, largest value)")
        low, high = _checked_range(*range, what=f"preset {name}: range")
        return cls.from_points([(low + v * (high - low), colour, a) for v, colour, a in MR_PRESETS[name]], name=name)

    @staticmethod
    def presets() -> tuple[str, ...]:
        """Names that `preset` knows."""
        return (*CT_PRESETS, *MR_PRESETS)

    @classmethod
    def read(cls, path: str | PathLike[str], *, name: str | None = None) -> TransferFunction:
        """From a file of 3D Slicer or ParaView; see `intaglio.io.transfer_functions.read_transfer_function`."""
        from intaglio.io.transfer_functions import read_transfer_function

        return read_transfer_function(path, name=name)

    def write(self, path: str | PathLike[str]) -> None:
        """To .vp.json (3D Slicer) or .json (ParaView); see `intaglio.io.transfer_functions.write_transfer_function`."""
        from intaglio.io.transfer_functions import write_transfer_function

        write_transfer_function(self, path)

    @cached_property
    def knots(self) -> tuple[Floats, Floats]:
        """Values (n,) and red, green, blue, opacity (n, 4) there, linear between: as `intaglio.piecewise` takes them."""
        x = np.array([p.value for p in self.points])
        rgba = np.array([(*p.colour, p.opacity) for p in self.points])
        if self.interpolation == "constant":
            return np.repeat(x, 2)[1:], np.repeat(rgba, 2, axis=0)[:-1]
        return x, rgba

    def __call__(self, values: ArrayLike) -> NDArray[np.float32]:
        """(..., 4) float32 red, green, blue, opacity of values of any shape; straight alpha; NaN is nothing at all."""
        v = np.asarray(values, dtype=np.float64)
        return np.where(np.isnan(v)[..., None], 0.0, interpolated(*self.knots, v)).astype(np.float32)

    def table(self, low: float, high: float, size: int = 1024, *, step: float | None = None) -> NDArray[np.float32]:
        """(size, 4) float32 red, green, blue, opacity at `size` values from low to high, both included; straight alpha.

        step  mm; corrects opacity from the reference length to this one, see `corrected_opacity`
        """
        low, high = _checked_range(low, high, what=f"{self.name}: table")
        if size < 2:
            raise InputError(f"{self.name}: table size must be 2 or more, not {size!r}")
        table = self(np.linspace(low, high, size))
        if step is not None:
            table[:, 3] = corrected_opacity(table[:, 3], step, self.reference_length)
        return table

    def visible(self, low: ArrayLike, high: ArrayLike) -> NDArray[np.bool_]:
        """Whether any value from low to high, both included, has an opacity above 0; for arrays of blocks' extremes.

        Exact, however narrow a peak is. A block with NaN may hold anything and counts as visible.
        """
        x, rgba = self.knots
        lowest, highest = np.asarray(low, dtype=np.float64), np.asarray(high, dtype=np.float64)
        result = np.ones(np.broadcast_shapes(lowest.shape, highest.shape), dtype=bool)
        for first, last in zip(*zero_intervals(x, rgba[:, 3]), strict=True):
            result &= ~((lowest >= first) & (highest <= last))
        return result

    def surfaces(self) -> list[OpacityPeak]:
        """The local maxima of opacity by ascending value: the surfaces that are seen, their isovalues and how opaque they are.

        A level run counts once; opacity that nowhere changes is no surface.
        M. Gerl, "Volume Hatching for Illustrative Visualization", diploma thesis, 2006: the threshold is the isovalue.
        """
        x, rgba = self.knots
        found = []
        for knot, threshold, ceiling in peaks(x, rgba[:, 3]):
            r, g, b, opacity = rgba[knot].tolist()
            found.append(OpacityPeak(float(x[knot]), opacity, (r, g, b), threshold, ceiling))
        return found

    def mapped(self, from_values: Sequence[float], to_values: Sequence[float]) -> TransferFunction:
        """The same function on another scale: what held at from_values holds at to_values, both ascending.

        Linear between these landmarks and, as between the nearest two, beyond them. It brings a preset in Hounsfield
        units to a scan without them, by air, skin and bone: `preset("ct-tissues").mapped((-1000, -200, 300), (0, 0.2, 0.5))`.
        """
        start, stop = (_landmarks(v, self.name) for v in (from_values, to_values))
        if len(start) != len(stop):
            raise InputError(f"{self.name}: mapped needs as many from_values as to_values, not {len(start)} and {len(stop)}")
        x = np.array([p.value for p in self.points])
        points = list(self.points)
        if self.interpolation == "linear":
            # A straight line bends where the scale does.
            bends = start[(start > x[0]) & (start < x[-1]) & ~np.isin(start, x)]
            points += [
                ControlPoint(v, (r, g, b), a) for v, (r, g, b, a) in zip(bends, interpolated(*self.knots, bends), strict=True)
            ]
            points.sort(key=lambda p: p.value)
        values = np.array([p.value for p in points])
        at = np.clip(np.searchsorted(start, values, side="right") - 1, 0, len(start) - 2)
        with np.errstate(over="ignore", invalid="ignore"):  # a point that becomes infinite is refused as such
            moved = stop[at] + (values - start[at]) * (np.diff(stop) / np.diff(start))[at]
        moved = np.maximum.accumulate(moved)  # rounding must not turn the order
        return replace(self, points=tuple(p._replace(value=float(v)) for p, v in zip(points, moved, strict=True)))

    def rescaled(self, low: float, high: float) -> TransferFunction:
        """The same function with its first point at low and its last at high."""
        return self.mapped((self.points[0].value, self.points[-1].value), (low, high))

    def picture(self, volume: Volume | None = None, *, width: int = 480, height: int = 200) -> str:
        """SVG of the opacity curve in its colours, over the volume's histogram; see `intaglio.rendering.histogram.picture`."""
        from intaglio.rendering.histogram import picture

        return picture(self, volume, width=width, height=height)

    def _repr_svg_(self) -> str:
        return self.picture()


def corrected_opacity(opacity: ArrayLike, step: float, reference_length: float) -> NDArray[np.float32]:
    """Opacity of `step` mm of matter of which `reference_length` mm have the opacity given: 1 - (1 - a)^(step / reference)."""
    if not 0 < step < math.inf:
        raise InputError(f"step must be a positive number of mm, not {step!r}")
    clear = 1.0 - np.asarray(opacity, dtype=np.float64)
    return (1.0 - clear ** (step / reference_length)).astype(np.float32)


def _control_point(point: Any, name: str) -> ControlPoint:
    try:
        value, colour, opacity = point
        value, opacity = float(value), float(opacity)
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name}: a point must be (value, colour, opacity), not {point!r}") from None
    if not math.isfinite(value):
        raise InputError(f"{name}: a point's value must be finite, not {value!r}")
    if not 0 <= opacity <= 1:
        raise InputError(f"{name}: opacity must be between 0 and 1, not {opacity!r}")
    return ControlPoint(value, _rgb(colour, name), opacity)


def _rgb(colour: Any, name: str) -> Colour:
    if isinstance(colour, str):
        check_colour(colour)
        return int(colour[1:3], 16) / 255, int(colour[3:5], 16) / 255, int(colour[5:7], 16) / 255
    try:
        r, g, b = (float(c) for c in colour)
    except (TypeError, ValueError):
        raise InputError(f'{name}: colour must be "#rrggbb" or three numbers, not {colour!r}') from None
    if not all(0 <= c <= 1 for c in (r, g, b)):
        raise InputError(f"{name}: colour must be three numbers between 0 and 1, not {colour!r}")
    return r, g, b


def _landmarks(values: Sequence[float], name: str) -> Floats:
    try:
        result = [float(v) for v in values]
    except (TypeError, ValueError, OverflowError):
        raise InputError(f"{name}: mapped needs numbers, not {values!r}") from None
    if len(result) < 2 or not all(a < b for a, b in pairwise(result)) or not math.isfinite(result[-1] - result[0]):
        raise InputError(f"{name}: mapped needs two or more ascending values, not {values!r}")
    return np.array(result)


def _checked_range(low: float, high: float, *, what: str) -> tuple[float, float]:
    if not (math.isfinite(low) and math.isfinite(high) and low < high and math.isfinite(high - low)):
        raise InputError(f"{what} must run from a smaller to a larger number, not from {low!r} to {high!r}")
    return float(low), float(high)
