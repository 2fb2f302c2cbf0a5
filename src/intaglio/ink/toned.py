"""Streamlines cut to strokes whose ink covers as much of the paper as is asked for."""

from __future__ import annotations

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.drawing import Strokes
from intaglio.ink.density import Ground, LineDensity
from intaglio.ink.streamlines import Streamlines
from intaglio.ink.strokes import arc_length, lifted, line_of, pack, reversed_where, runs, sample, sideways, taper, wander
from intaglio.ink.styles import Hatching

Floats = NDArray[np.float32]
Offsets = NDArray[np.int64]

# By how much a stroke's taper is shorter where it ends in a layer's full tone.
BLUNT = 0.8
# A stroke is drawn from this part of the tone of the thinnest line on, and where a layer has next to nothing to add it must be
# longer than others by this many times the shortest.
EARLY = 0.75
FAINT = 4.0
# Ink may reach so far beyond the border of a surface, as a part of the contour's width: it covers that, if it is exact.
UNDER = 0.25


@dataclass(frozen=True)
class Tone:
    """One layer: `lines` mm for each mm2, turned by `angle`, `separation` mm apart, for the darkness from `begin` to `end`."""

    name: str
    angle: float
    separation: float
    lines: float
    begin: float
    end: float


@dataclass(frozen=True, eq=False)
class Printed:
    """What share of the paper the lines of one layer cover where."""

    angle: float
    cover: LineDensity


@dataclass(frozen=True, eq=False)
class _Pieces:
    """Lines in pixels, the tone asked for at each point, and the number of the streamline that each point is from."""

    points: Floats
    asked: Floats
    number: NDArray[np.int64]
    offsets: Offsets

    def part(self, index: NDArray[np.int64], offsets: Offsets) -> _Pieces:
        return _Pieces(self.points[index], self.asked[index], self.number[index], offsets)


def toned(
    lines: Streamlines,
    dark: Floats,
    room: Floats,
    tone: Tone,
    printed: list[Printed],
    hatching: Hatching,
    mm_per_pixel: float,
    seed: Sequence[int],
    after: Tone | None = None,
) -> Strokes:
    """Cut streamlines where it is too bright for them; width and opacity from how dark it is and how many lines share that.

    dark     (h, w) requested tone
    room     (h, w) pixels to the border of the surface
    printed  the layers before, which this one makes up to what is asked for; it is added to them
    after    the layer that comes next
    """
    rng = np.random.default_rng(seed)
    # The load, 0..1, of the thinnest line, and that from which on lines are drawn.
    least = (hatching.thinnest / hatching.thickest) ** (1.0 / (1.0 - hatching.pressure)) if hatching.pressure < 1.0 else 0.0
    early = EARLY * least
    cut = _cut(lines, dark, tone, early, hatching, mm_per_pixel, rng)
    if len(cut.points) == 0:
        return Strokes.none()
    points, offsets = cut.points, cut.offsets
    first, last = offsets[:-1], offsets[1:] - 1
    # Lines fade out where tone does. In the dark, where others stop them, they would leave white flecks, and at a contour gaps.
    border = sample(room, points) * np.float32(mm_per_pixel)
    fade = hatching.taper * (1.0 - BLUNT * np.clip((cut.asked - tone.begin) / (tone.end - tone.begin), 0.0, 1.0))
    fade *= np.clip(2.0 * (border - 1.5 * mm_per_pixel) / hatching.thickest, 0.0, 1.0)
    ends = taper(points, offsets, fade[first] / mm_per_pixel, fade[last] / mm_per_pixel)
    points = points * np.float32(mm_per_pixel)
    if hatching.wobble > 0:
        aside = wander(offsets, arc_length(points, offsets), hatching.wobble, 9.0, rng, cut.number[first])
        aside = np.clip(aside, -border, border)
        points = points + sideways(points, offsets) * aside[:, None]
        border = border - np.abs(aside)
    widest = 2.0 * (border + (0.0 if hatching.hand else UNDER * hatching.contour))

    # More than 1 where the layers before lack tone, or the next ones are to add some: lines that lie densely can carry it.
    # To the next one is left what its thinnest lines print.
    thin = least * (after.end - after.begin) if after else 0.0
    target = np.minimum(cut.asked, np.maximum(tone.end, cut.asked - thin))
    load = np.maximum(_owed(cut.points, target, tone, printed, hatching), least)
    free = ends * np.minimum(widest / (hatching.thickest * np.minimum(load, 1.0) ** (1.0 - hatching.pressure)), 1.0)
    ground = Ground.of(dark > tone.begin + early * (tone.end - tone.begin), tone.separation / mm_per_pixel)
    density = ground.lines(cut.points, free, offsets).at(cut.points)
    # Where lines lie less densely than planned, they are heavier, and the other way round.
    planned = np.float32(tone.lines * mm_per_pixel)
    load = np.clip(load * planned / np.maximum(density, 0.6 * planned), least, 1.0)
    width = np.minimum(hatching.thickest * load ** (1.0 - hatching.pressure) * ends, widest)
    opacity = hatching.opacity * load**hatching.pressure
    cover = (width * opacity / mm_per_pixel).astype(np.float32)
    printed.append(Printed(tone.angle, ground.lines(cut.points, cover, offsets)))
    return pack(points, width, np.asarray(opacity, dtype=np.float32), offsets)


def _cut(
    lines: Streamlines, dark: Floats, tone: Tone, early: float, hatching: Hatching, mm_per_pixel: float, rng: np.random.Generator
) -> _Pieces:
    """The parts of lines where a layer has something to add, as long as a hand draws them, dark ends first."""
    # One draw a number, so that a line that is kept from picture to picture keeps its chance.
    ragged = rng.normal(0.0, hatching.ragged, lines.number.max(initial=-1) + 1).astype(np.float32)
    span = tone.end - tone.begin
    number = lines.number[line_of(lines.offsets)]
    asked = sample(dark, lines.points)
    asked = asked + ragged[number] * np.clip((tone.end - asked) / span, 0.0, 1.0)
    load = (asked - tone.begin) / span
    cut = _Pieces(lines.points, asked, number, lines.offsets).part(*runs((load >= early) & (load > 0.0), lines.offsets))
    if len(cut.points) == 0:
        return cut
    # Faint strokes must be longer to stay, on bare paper or across others: short ones are noise there.
    most = (np.maximum.reduceat(cut.asked, cut.offsets[:-1]) - tone.begin) / span
    faint = 1.0 - np.minimum(most, 1.0) if tone.begin == 0.0 or tone.angle != 0.0 else 0.0
    length = arc_length(cut.points, cut.offsets)[cut.offsets[1:] - 1] * mm_per_pixel
    long_enough = length >= hatching.shortest * (1.0 + FAINT * faint)
    cut = cut.part(*runs(np.repeat(long_enough, np.diff(cut.offsets)), cut.offsets))
    if len(cut.points) == 0:
        return cut
    if hatching.longest > 0:
        along = arc_length(cut.points, cut.offsets) * mm_per_pixel
        cut = cut.part(*lifted(along, cut.offsets, hatching.longest, rng, cut.number[cut.offsets[:-1]]))
    rising = cut.asked[cut.offsets[:-1]] < cut.asked[cut.offsets[1:] - 1]
    return cut.part(reversed_where(rising, cut.offsets), cut.offsets)


def _owed(points: Floats, target: Floats, tone: Tone, printed: Sequence[Printed], hatching: Hatching) -> Floats:
    """(n,) load of a layer's lines that makes up what the layers before have printed to a tone."""
    along = beneath = np.ones(len(points), dtype=np.float32)
    for before in printed:
        # Lines of one direction lie side by side, those of the other one beneath.
        if before.angle == tone.angle:
            along = along - before.cover.at(points)
        else:
            beneath = beneath - before.cover.at(points)
    bare = (1.0 - target) / np.maximum(beneath, 0.02)
    return np.asarray((along - bare) / (hatching.thickest * hatching.opacity * tone.lines), dtype=np.float32)
