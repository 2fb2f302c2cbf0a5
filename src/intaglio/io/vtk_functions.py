"""VTK's functions of one value, which 3D Slicer and ParaView store, as knots between which they are linear."""

# VTK: vtkPiecewiseFunction::GetTable, vtkColorTransferFunction::GetTable.

from __future__ import annotations

import math
import reprlib
from collections.abc import Callable
from itertools import pairwise
from typing import Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.io.colour_spaces import mixed
from intaglio.piecewise import interpolated
from intaglio.transfer_function import ControlPoint, TransferFunction

Floats = NDArray[np.float64]
Knots = tuple[Floats, Floats]

MAX_POINTS = 10_000
# How far apart two values must be to stay apart: VTK knows no steps, only points a rounding from each other.
TINY = float(np.finfo(np.float64).tiny)


def number(what: str, value: Any) -> float:
    """What a file holds, if it is a finite number."""
    if isinstance(value, int | float) and not isinstance(value, bool) and -math.inf < value < math.inf:
        try:
            return float(value)
        except OverflowError:
            pass
    raise InputError(f"{what} must be a finite number, not {reprlib.repr(value)}")


def rows_of(what: str, flat: list[Any], width: int) -> Floats:
    """(n, width), of numbers that stand one after the other."""
    if not flat or len(flat) % width or len(flat) > width * MAX_POINTS:
        raise InputError(f"{what} must be 1 to {MAX_POINTS} points of {width} numbers, not {len(flat)} numbers")
    return np.array([number(what, value) for value in flat]).reshape(-1, width)


def ordered(what: str, rows: Floats) -> Floats:
    """Rows (x, more...) with x ascending and everything else within 0..1, of which no more than two share an x."""
    x, y = rows[:, 0].tolist(), rows[:, 1:]
    for a, b in pairwise(x):
        if a > b:
            raise InputError(f"{what} must be sorted by value, not {a:g} before {b:g}")
    if not math.isfinite(x[-1] - x[0]):
        raise InputError(f"{what} must be a finite distance apart, not run from {x[0]:g} to {x[-1]:g}")
    wrong = y[(y < -1e-6) | (y > 1 + 1e-6)]
    if wrong.size:
        raise InputError(f"{what} must hold numbers between 0 and 1 beside its values, not {wrong[0]:g}")
    np.clip(y, 0.0, 1.0, out=y)
    for i in range(len(x) - 2, -1, -1):
        if x[i + 1] - x[i] <= max(math.ulp(x[i + 1]), math.ulp(x[i]), TINY):
            x[i] = x[i + 1]
    rows[:, 0] = x
    return rows[[not 0 < i < len(x) - 1 or not x[i - 1] == x[i] == x[i + 1] for i in range(len(x))]]


def _refined(knots: Knots, between: Callable[[int, Floats, Floats], Knots]) -> Knots:
    """The knots and, between the i-th and the next, what `between` gives: parts of the way and rows there."""
    x, y = knots
    parts, rows = [x[:1]], [y[:1]]
    for i in range(len(x) - 1):
        t, inner = between(i, y[i], y[i + 1])
        parts += [x[i] + t * (x[i + 1] - x[i]), x[i + 1 : i + 2]]
        rows += [inner, y[i + 1 : i + 2]]
    return np.concatenate(parts), np.concatenate(rows)


def bent(rows: Floats) -> Knots:
    """VTK's curves between nodes (x, y..., midpoint, sharpness): from straight (sharpness 0) by an S to a step (1).

    With u = 1/2 at the midpoint and p = (2 u)^(1 + 10 sharpness) / 2, mirrored beyond it, p^2 (3 - 2 p) +
    (1 - sharpness) p (1 - p) (1 - 2 p) of the way is gone.
    """
    x, y, midpoint, sharpness = rows[:, 0], rows[:, 1:-2], rows[:, -2], rows[:, -1]

    def between(i: int, a: Floats, b: Floats) -> Knots:
        middle, sharp = min(max(midpoint[i], 1e-5), 1 - 1e-5), sharpness[i]
        if (a == b).all() or (middle == 0.5 and sharp < 0.01):
            return np.empty(0), np.empty((0, len(a)))
        if sharp > 0.99 and len(a) == 3:  # of colours only
            return np.array([middle, middle]), np.stack([a, b])
        u = np.linspace(0.0, 1.0, 65)[1:-1] if sharp >= 0.01 else np.array([0.5])
        t = np.where(u < 0.5, 2 * u * middle, middle + (2 * u - 1) * (1 - middle))
        near = 0.5 * (2 * np.minimum(u, 1 - u)) ** (1 + 10 * sharp)
        p = np.where(u < 0.5, near, 1 - near)
        way = np.clip(p * p * (3 - 2 * p) + (1 - sharp) * p * (1 - p) * (1 - 2 * p), 0.0, 1.0)
        return t, a + way[:, None] * (b - a)

    return _refined((x, y), between)


def in_space(what: str, knots: Knots, preset: dict[str, Any]) -> Knots:
    """Colours as ParaView's ColorSpace mixes them."""
    space, wrap = preset.get("ColorSpace", "RGB"), bool(preset.get("HSVWrap", False))
    if space == "RGB":
        return knots
    if space == "Step":
        return np.repeat(knots[0], 2)[:-1], np.repeat(knots[1], 2, axis=0)[1:]
    if space not in ("HSV", "Lab", "Diverging"):
        raise InputError(f"{what}: ColorSpace must be RGB, HSV, Lab, Diverging or Step, not {reprlib.repr(space)}")
    parts = np.arange(1, 32) / 32

    def between(i: int, a: Floats, b: Floats) -> Knots:
        t = parts if np.abs(b - a).max() > 0.02 else parts[:0]
        return t, mixed(a, b, t, space, hsv_wrap=wrap).reshape(-1, 3)

    return _refined(knots, between)


def joined(name: str, colour: Knots, opacity: Knots, reference_length: float) -> TransferFunction:
    """One function with points where either has one."""
    x = np.unique(np.concatenate([colour[0], opacity[0]]))
    before, after = (np.hstack([interpolated(*colour, x, side), interpolated(*opacity, x, side)]) for side in ("left", "right"))
    points = []
    for value, a, b in zip(x.tolist(), before.tolist(), after.tolist(), strict=True):
        points += [ControlPoint(value, (r, g, b), alpha) for r, g, b, alpha in ([a] if a == b else [a, b])]
    return TransferFunction(tuple(points), reference_length=reference_length, name=name)
