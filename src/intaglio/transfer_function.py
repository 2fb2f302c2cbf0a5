"""TransferFunction: which value has which colour and how much of it shows."""

from __future__ import annotations

import math
from collections.abc import Iterable, Sequence
from dataclasses import dataclass
from itertools import pairwise
from typing import Any, Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

from intaglio.drawing import check_colour
from intaglio.errors import InputError

Interpolation = Literal["linear", "constant"]
Colour = tuple[float, float, float]


class ControlPoint(NamedTuple):
    """A scalar value, its display colour (red, green, blue) 0..1 and its opacity 0..1."""

    value: float
    colour: Colour
    opacity: float


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
        if name in _CT_PRESETS:
            return cls.from_points(_CT_PRESETS[name], name=name)
        if name not in _MR_PRESETS:
            raise InputError(f"preset must be one of {', '.join(cls.presets())}, not {name!r}")
        if range is None:
            raise InputError(f"preset {name} is relative to the data: give range=(smallest, largest value)")
        low, high = _checked_range(*range, what=f"preset {name}: range")
        return cls.from_points([(low + v * (high - low), colour, a) for v, colour, a in _MR_PRESETS[name]], name=name)

    @staticmethod
    def presets() -> tuple[str, ...]:
        """Names that `preset` knows."""
        return (*_CT_PRESETS, *_MR_PRESETS)

    def __call__(self, values: ArrayLike) -> NDArray[np.float32]:
        """(..., 4) float32 red, green, blue, opacity of values of any shape; straight alpha; NaN is nothing at all."""
        v = np.asarray(values, dtype=np.float64)
        x = np.array([p.value for p in self.points])
        rgba = np.array([(*p.colour, p.opacity) for p in self.points])
        after = np.searchsorted(x, v, side="right")
        a, b = np.maximum(after - 1, 0), np.minimum(after, len(x) - 1)
        if self.interpolation == "constant":
            result = rgba[a]
        else:
            gap = x[b] - x[a]
            inside = gap > 0
            t = np.where(inside, v - x[a], 0.0) / np.where(inside, gap, 1.0)
            result = rgba[a] + t[..., None] * (rgba[b] - rgba[a])
        return np.where(np.isnan(v)[..., None], 0.0, result).astype(np.float32)

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
    except (TypeError, ValueError):
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


def _checked_range(low: float, high: float, *, what: str) -> tuple[float, float]:
    if not (math.isfinite(low) and math.isfinite(high) and low < high and math.isfinite(high - low)):
        raise InputError(f"{what} must run from a smaller to a larger number, not from {low!r} to {high!r}")
    return float(low), float(high)


# Hounsfield units: air -1000, fat -100..-50, water 0, muscle 40..60, vessels with contrast 150..400, cortical bone from 600.
_CT_PRESETS: dict[str, list[tuple[float, str, float]]] = {
    "ct-skin": [
        (-600, "#c98f72", 0.0),
        (-300, "#dba988", 0.45),
        (-100, "#ecc3a3", 0.85),
        (200, "#f3d7bf", 0.95),
    ],
    "ct-muscle": [
        (-200, "#e8cf97", 0.0),
        (-90, "#e8cf97", 0.04),
        (-20, "#b8574a", 0.02),
        (50, "#a53a32", 0.5),
        (90, "#b4483b", 0.45),
        (160, "#dcb592", 0.3),
        (350, "#f1e3c6", 0.85),
        (1500, "#fffaf0", 0.95),
    ],
    "ct-bone": [
        (120, "#9c5a3c", 0.0),
        (220, "#cf9d72", 0.2),
        (400, "#ead8b4", 0.75),
        (1200, "#fbf5e6", 0.95),
    ],
    "ct-vessel": [
        (110, "#7a1512", 0.0),
        (180, "#b0241c", 0.35),
        (320, "#d94f3d", 0.7),
        (480, "#ead2ab", 0.75),
        (1500, "#fffaf0", 0.9),
    ],
}

# Parts of the data's range: MR has no unit.
_MR_PRESETS: dict[str, list[tuple[float, str, float]]] = {
    "mr-default": [
        (0.0, "#000000", 0.0),
        (0.08, "#3b2620", 0.0),
        (0.2, "#a06a55", 0.15),
        (0.45, "#d9b59d", 0.4),
        (1.0, "#fff8ee", 0.9),
    ],
    "mr-angiography": [
        (0.0, "#300505", 0.0),
        (0.3, "#7a1512", 0.0),
        (0.55, "#cf3d2f", 0.5),
        (1.0, "#ffe9d6", 0.95),
    ],
}
