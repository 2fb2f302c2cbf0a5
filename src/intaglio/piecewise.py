"""Piecewise linear functions of one value: knots x (n,), ascending; y there; two knots at one x make a step.

The first and the last knot hold outwards. At a step the function has the later knot's value.
"""

from __future__ import annotations

import math
from typing import Literal, NamedTuple

import numpy as np
from numpy.typing import ArrayLike, NDArray

Floats = NDArray[np.float64]


class Peak(NamedTuple):
    """A local maximum: the knot where it begins, the minima from which it rises and to which it falls (-inf, inf: none)."""

    knot: int
    rise: float
    fall: float


def interpolated(x: Floats, y: Floats, at: ArrayLike, side: Literal["left", "right"] = "right") -> Floats:
    """Rows of y (n, m) at values of any shape.

    side  from which a step is approached: the limit from the right is the function's value
    """
    v = np.asarray(at, dtype=np.float64)
    behind = np.searchsorted(x, v, side=side)
    v = np.clip(v, x[0], x[-1])
    a, b = np.maximum(behind - 1, 0), np.minimum(behind, len(x) - 1)
    gap = x[b] - x[a]
    t = np.where(gap > 0, v - x[a], 0.0) / np.where(gap > 0, gap, 1.0)
    before, after = y[a], y[b]
    result = np.clip(before + t[..., None] * (after - before), np.minimum(before, after), np.maximum(before, after))
    return np.where((v == x[b])[..., None], after, result) if side == "left" else result


def zero_intervals(x: Floats, y: Floats) -> tuple[Floats, Floats]:
    """First and last values, both included, of the intervals on which y (n,) is zero; float64 is dense enough to close them."""
    zero = np.concatenate([[False], y == 0, [False]])
    begin = np.flatnonzero(zero[1:-1] & ~zero[:-2])
    end = np.flatnonzero(zero[1:-1] & ~zero[2:])
    step = np.append(x[1:] == x[:-1], False)
    first = np.where(begin == 0, -np.inf, x[begin])
    last = np.where(end == len(x) - 1, np.inf, np.where(step[end], np.nextafter(x[end], -np.inf), x[end]))
    return first, last


def peaks(x: Floats, y: Floats) -> list[Peak]:
    """The local maxima of y (n,); a level run counts once, and a function that nowhere changes has none."""
    begin = np.flatnonzero(np.diff(y, prepend=np.nan) != 0)
    end = np.append(begin[1:], len(x)) - 1
    level = y[begin]
    found = []
    for top in range(len(level)):
        before = after = top
        while before > 0 and level[before - 1] < level[before]:
            before -= 1
        while after < len(level) - 1 and level[after + 1] < level[after]:
            after += 1
        rises, falls = before < top, after > top
        if (rises or top == 0) and (falls or top == len(level) - 1) and (rises or falls):
            rise = float(x[end[before]]) if rises else -math.inf
            found.append(Peak(int(begin[top]), rise, float(x[begin[after]]) if falls else math.inf))
    return found
