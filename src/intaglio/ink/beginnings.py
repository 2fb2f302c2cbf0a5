"""Where a hand sets its strokes along lines, and how it finds the places of a former picture again."""

# R. Kalnins, P. Davidson, L. Markosian, A. Finkelstein, "Coherent stylized silhouettes", 2003: what was drawn along contours
# is carried to the next picture and laid along its contours. Here single strokes are carried, not a parameter of the line.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass
from functools import cached_property
from itertools import pairwise

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import maximum_filter1d
from scipy.spatial import cKDTree

from intaglio.gbuffer import GBuffer
from intaglio.ink.strokes import arc_length, line_of, reversed_where, sideways

Floats = NDArray[np.float32]
Ints = NDArray[np.int64]

# How far a beginning may be carried past its line, mm on paper; what 45 degrees of turn and what a mm of depth count there.
REACH = 3.0
TURNED = 2.5
DEEPER = 0.1
# Pixels beside a line at which its two sides are told apart.
BESIDE = 3.0
# Strokes that come nearer to one another than this part of their distance become one.
CLOSE = 0.5


@dataclass(frozen=True, eq=False)
class Lines:
    """Lines without sharp turns, packed: points (n, 2) in pixels, offsets (m + 1,), and which of them are loops (m,)."""

    points: Floats
    offsets: Ints
    loop: NDArray[np.bool_]

    def __len__(self) -> int:
        return len(self.loop)

    @cached_property
    def along(self) -> NDArray[np.float64]:
        """(n,) pixels from each line's beginning."""
        return arc_length(self.points, self.offsets).astype(np.float64)

    @cached_property
    def length(self) -> NDArray[np.float64]:
        """(m,) in pixels."""
        return self.along[self.offsets[1:] - 1]

    def at(self, line: Ints, along: NDArray[np.float64]) -> NDArray[np.float64]:
        """(k, 2) places `along` pixels from the beginnings of lines; round again on loops, not beyond the ends of others."""
        length = self.length[line]
        along = np.where(self.loop[line], np.mod(along, length), np.clip(along, 0.0, length))
        # All lines one behind the other on one axis, so that one interpolation serves them all.
        begin = np.concatenate([[0.0], np.cumsum(self.length + 1.0)])[:-1]
        axis = self.along + begin[line_of(self.offsets)]
        return np.stack([np.interp(along + begin[line], axis, self.points[:, k]) for k in (0, 1)], axis=1)

    def way(self, line: Ints, along: NDArray[np.float64], span: float) -> NDArray[np.float64]:
        """(k, 2) unit directions there, from `span` before to `span` behind."""
        chord = self.at(line, along + span) - self.at(line, along - span)
        return np.asarray(chord / np.maximum(np.linalg.norm(chord, axis=1, keepdims=True), 1e-9))


@dataclass(frozen=True, eq=False)
class Beginnings:
    """Where strokes begin: world place (n, 3), direction in the picture (n, 2), and the number (n,) their chance goes by."""

    place: NDArray[np.float64]
    way: NDArray[np.float64]
    number: Ints

    @classmethod
    def none(cls) -> Beginnings:
        return cls(np.zeros((0, 3)), np.zeros((0, 2)), np.zeros(0, dtype=np.int64))


def unbent(points: Floats, offsets: Ints, turn: float, interval: float) -> Lines:
    """Chains cut where they turn by more than `turn` degrees in `interval` pixels; a closed one that does so begins there."""
    if len(points) == 0:
        return Lines(points, offsets, np.zeros(0, dtype=np.bool_))
    closed = (points[offsets[:-1]] == points[offsets[1:] - 1]).all(axis=1)
    whole = Lines(points, offsets, closed)
    line = line_of(offsets)
    before, after = (whole.way(line, whole.along + side * interval, interval) for side in (-0.5, 0.5))
    bend = np.arccos(np.clip(np.einsum("nc,nc->n", before, after), -1.0, 1.0))
    corner = (bend > math.radians(turn)) & (bend == maximum_filter1d(bend, 2 * max(1, round(interval)) + 1))
    pieces: list[Floats] = []
    loop: list[bool] = []
    for k, (begin, end) in enumerate(pairwise(offsets)):
        chain, cut = points[begin:end], np.flatnonzero(corner[begin:end])
        loop.append(bool(closed[k] and len(cut) == 0))
        if closed[k] and len(cut):
            chain, cut = np.concatenate([chain[cut[0] : -1], chain[: cut[0] + 1]]), cut - cut[0]
        ends = [0, *cut[(cut > 0) & (cut < len(chain) - 1)], len(chain) - 1]
        pieces += [chain[a : b + 1] for a, b in pairwise(ends)]
        loop += [False] * (len(ends) - 2)
    return Lines(np.concatenate(pieces), np.cumsum([0] + [len(p) for p in pieces]), np.array(loop))


def surface_on_the_left(points: Floats, offsets: Ints, gb: GBuffer) -> Floats:
    """Chains along contours turned so that the nearer side is on their left, whichever way they were followed."""
    if len(points) == 0:
        return points
    h, w = gb.depth.shape
    aside = np.float32(BESIDE) * sideways(points, offsets).astype(np.float32)
    # y runs down: these normals point to the right.
    right, left = (
        gb.depth[y, x] for x, y in (np.clip(points + side * aside, 0, (w - 1, h - 1)).astype(np.int64).T for side in (1, -1))
    )
    nearer = (right < left).astype(np.int64) - (left < right)
    return points[reversed_where(np.add.reduceat(nearer, offsets[:-1]) > 0, offsets)]


def begun(
    lines: Lines, step: float, reach: float, interval: float, kept: Sequence[tuple[int, float, int]] = ()
) -> tuple[Ints, NDArray[np.float64], Ints]:
    """Where strokes begin: line, place along it, and number.

    step   pixels from a stroke's beginning to the next one's
    reach  how far a stroke goes
    kept   (line, place, number) of strokes that are to stay: where two come too near to one another, one goes; where there
           is a gap, new ones begin. All numbers are as small as can be
    """
    old: list[list[tuple[float, int]]] = [[] for _ in range(len(lines))]
    for line, along, number in sorted(kept):
        if not old[line] or along - old[line][-1][0] >= CLOSE * step:
            old[line].append((along, number))
    found: list[tuple[int, float, int]] = []
    for line, begin in enumerate(old):
        length = float(lines.length[line])
        if lines.loop[line]:
            if len(begin) > 1 and begin[0][0] + length - begin[-1][0] < CLOSE * step:
                begin.pop()
            begin = begin or [(0.0, -1)]
            until = begin[0][0] + length
        else:
            # What began at the end of a line does so again, where that now is.
            first = begin.pop(0)[1] if begin and begin[0][0] < CLOSE * step else -1
            begin.insert(0, (0.0, first))
            while len(begin) > 1 and length - begin[-1][0] < max(interval, CLOSE * (reach - step)):
                begin.pop()
            until = begin[-1][0] + step * (1 + max(0, math.ceil((length - begin[-1][0] - reach) / step - 1e-6)))
        for (along, number), (following, _) in zip(begin, [*begin[1:], (until, -1)], strict=True):
            many = max(1, round((following - along) / step))
            found.append((line, along, number))
            found += [(line, along + k * (following - along) / many, -1) for k in range(1, many)]
    if not found:
        return np.zeros(0, dtype=np.int64), np.zeros(0), np.zeros(0, dtype=np.int64)
    line_, along_, number_ = (np.array(column) for column in zip(*found, strict=True))
    free = np.setdiff1d(np.arange(len(found)), number_)
    number_[number_ < 0] = free[: (number_ < 0).sum()]
    return line_, along_, number_


def found_again(kept: Beginnings, lines: Lines, gb: GBuffer, depth: Floats, mm_per_pixel: float) -> list[tuple[int, float, int]]:
    """Where the strokes of a former picture begin on the lines of this one: (line, place along it, number).

    depth  (n,) mm of the lines' points. A beginning goes to the nearest point, those that run another way or lie deeper
           counting as farther off; none that is out of reach.
    """
    if len(lines) == 0 or len(kept.number) == 0:
        return []
    place = gb.camera.project(kept.place)
    scale = float(np.median(gb.pixel_mm[gb.mask])) if gb.mask.any() else 1.0
    line = line_of(lines.offsets)
    here = (lines.points, lines.way(line, lines.along, 0.5 * REACH / mm_per_pixel), depth)
    there = (place[:, :2], kept.way, place[:, 2])

    def features(points: NDArray[np.floating], way: NDArray[np.floating], depth: NDArray[np.floating]) -> NDArray[np.float64]:
        return np.column_stack([points * mm_per_pixel, TURNED / math.radians(45) * way, DEEPER / scale * mm_per_pixel * depth])

    distance, nearest = cKDTree(features(*here)).query(features(*there), distance_upper_bound=REACH)
    near = np.flatnonzero(np.isfinite(distance))
    at = nearest[near]
    return list(zip(line[at].tolist(), lines.along[at].tolist(), kept.number[near].tolist(), strict=True))
