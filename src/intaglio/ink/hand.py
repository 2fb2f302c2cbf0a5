"""Contours drawn by hand: overlapping strokes, none of which follows its line exactly."""

# M. Gerl, "Volume hatching", 2006: contour image, filter, line following, overlapping curves, randomness.
# P. de Casteljau, "Outillages méthodes calcul", 1959 (Bézier curves by repeated division).

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter, minimum_filter

from intaglio.camera import Camera
from intaglio.drawing import Strokes
from intaglio.gbuffer import GBuffer
from intaglio.ink.beginnings import Beginnings, Lines, begun, found_again, surface_on_the_left, unbent
from intaglio.ink.contours import contour_image
from intaglio.ink.following import follow
from intaglio.ink.options import check_bounds, option
from intaglio.ink.strokes import arc_length, line_of, pack, runs, sample, taper, weight_by_light

Floats = NDArray[np.float32]
Floats64 = NDArray[np.float64]

# One pass of the filter: a Gaussian as wide as three pixels of a picture 512 pixels wide, on paper 160 mm wide.
FILTER = 0.22  # mm
# In the contour image a jump of depth counts more than the band beside it. Filtered once, a straight contour has more than
# 0.7, a pixel of the band alone 0.1; less than this is no line.
JUMP = 3.0
LEAST = 0.2
# Beside a jump of depth, its image is above this when filtered more.
SURE = 0.03
SCAN = 1.5  # mm between scanlines
FINE = 0.25  # mm between the points of a finished stroke


@dataclass(frozen=True, kw_only=True)
class Hand:
    """How contours are drawn by hand; lengths in mm on paper, where 0.31 mm are a pixel of a picture 512 pixels wide.

    A line is followed and marked every `interval`. A stroke takes up to `points` marks, and the next one begins `increment`
    marks after it, so that strokes overlap. Then chance moves them.
    """

    interval: float = option(0.6, "distance of a stroke's control points, mm", 0.1, 20)  # type: ignore[assignment]
    points: int = option(16, "control points of a stroke at most", 2, 16)  # type: ignore[assignment]
    increment: int = option(6, "control points after which the next stroke begins", 1, 16)  # type: ignore[assignment]
    gap: float = option(0.35, "a stroke ends where its line is interrupted for longer than this, mm", 0, 5)  # type: ignore[assignment]
    turn: float = option(50.0, "a stroke ends where its line turns by more than this from point to point, degrees", 1, 180)  # type: ignore[assignment]
    deviation: float = option(0.5, "how far a stroke's end may leave the line, mm", 0, 20)  # type: ignore[assignment]
    perturbation: float = option(0.2, "how far each control point may leave the line, mm", 0, 20)  # type: ignore[assignment]
    lengthening: float = option(0.8, "length by which strokes overshoot, mm", 0, 20)  # type: ignore[assignment]
    translation: float = option(0.12, "how far a stroke may be moved, mm", 0, 20)  # type: ignore[assignment]
    rotation: float = option(1.0, "angle by which a stroke may be turned about its beginning, degrees", 0, 90)  # type: ignore[assignment]
    thickness: float = option(0.5, "width of the band in which contours are looked for, mm", 0.05, 5)  # type: ignore[assignment]
    passes: int = option(1, "passes of the filter that closes gaps and drops specks", 0, 10)  # type: ignore[assignment]
    shortest: float = option(2.0, "lines shorter than this are not drawn, mm", 0, 100)  # type: ignore[assignment]
    taper: float = option(3.0, "length over which strokes begin and end, mm", 0, 100)  # type: ignore[assignment]

    def __post_init__(self) -> None:
        check_bounds(self, "hand's ")


def hand_strokes(
    gb: GBuffer, hand: Hand, mm_per_pixel: float, *, width: float, opacity: float = 1.0, bright: bool = False, seed: int = 0
) -> Strokes:
    """Strokes over the contours of a G-buffer, in mm on paper; equal for an equal seed.

    width   in mm of a stroke where it is widest
    bright  whether strokes are heavier where the surface is bright, not where it is dark
    """
    return drawn_by_hand(gb, hand, mm_per_pixel, width=width, opacity=opacity, bright=bright, seed=seed)[0]


def drawn_by_hand(
    gb: GBuffer,
    hand: Hand,
    mm_per_pixel: float,
    *,
    width: float,
    opacity: float = 1.0,
    bright: bool = False,
    seed: int = 0,
    kept: Beginnings | None = None,
) -> tuple[Strokes, Beginnings]:
    """The strokes, and where they begin; `kept` are a former picture's beginnings, which are to be found again in this one."""
    # Where depth jumps there is a contour, however the surface is turned; beside it, noise widens the band and narrows it.
    jumps = _jumps(gb)
    image = np.where(jumps, np.float32(JUMP), contour_image(gb, hand.thickness / mm_per_pixel))
    sigma = max(FILTER * np.sqrt(hand.passes) / mm_per_pixel, 0.6)
    blurred = gaussian_filter(image, sigma)
    scan, reach = (max(2, round(mm / mm_per_pixel)) for mm in (SCAN, hand.gap))
    points, offsets, _ = follow(blurred, least=LEAST, scan=scan, reach=reach)
    sure = sample(gaussian_filter(jumps.astype(np.float32), 1.5 * sigma), points) > SURE
    points, offsets = _lasting(points, offsets, sure, hand.shortest / mm_per_pixel)
    interval = hand.interval / mm_per_pixel
    lines = unbent(surface_on_the_left(points, offsets, gb), offsets, hand.turn, interval)
    if len(lines) == 0:
        return Strokes.none(), Beginnings.none()
    near = minimum_filter(gb.depth, 5)
    old = found_again(kept, lines, gb, _at(near, lines.points), mm_per_pixel) if kept else ()
    line, along, number = begun(lines, hand.increment * interval, (hand.points - 1) * interval, interval, old)
    control, heading, offsets = _marks(lines, line, along, hand.points, interval)
    first = offsets[:-1]
    beginnings = Beginnings(_unprojected(gb.camera, control[first], _at(near, control[first])), heading[first], number)
    light = sample(gb.brightness, control)
    moved = _moved(control * mm_per_pixel, heading, offsets, number, hand, np.random.default_rng(seed))
    curve, light, offsets = _curves(moved, light, offsets)
    ends = taper(curve, offsets, hand.taper, hand.taper)
    return pack(curve, width * weight_by_light(light, bright) * ends, opacity * (0.4 + 0.6 * ends), offsets), beginnings


def _jumps(gb: GBuffer) -> NDArray[np.bool_]:
    """(h, w) pixels of the near surface beside a jump of depth."""
    out = np.zeros(gb.depth.shape, dtype=np.bool_)
    for side, (dy, dx) in enumerate(((0, 1), (1, 0))):
        h, w = gb.depth.shape
        jump = gb.edge[: h - dy, : w - dx, side] >= 0.0
        here, there = gb.depth[: h - dy, : w - dx], gb.depth[dy:, dx:]
        out[: h - dy, : w - dx] |= jump & (here < there)
        out[dy:, dx:] |= jump & (there < here)
    return out


def _lasting(
    points: Floats, offsets: NDArray[np.int64], sure: NDArray[np.bool_], shortest: float
) -> tuple[Floats, NDArray[np.int64]]:
    """Chains that are long enough: `shortest` pixels where depth jumps along them; noise must be four times as long."""
    if len(points) == 0:
        return points, offsets
    length = arc_length(points, offsets)[offsets[1:] - 1]
    share = np.add.reduceat(sure.astype(np.float32), offsets[:-1]) / np.diff(offsets)
    index, offsets = runs(np.repeat(length >= shortest * (4.0 - 3.0 * share), np.diff(offsets)), offsets)
    return points[index], offsets


def _marks(
    lines: Lines, line: NDArray[np.int64], along: Floats64, points: int, interval: float
) -> tuple[Floats, Floats64, NDArray[np.int64]]:
    """Control points (n, 2) of each stroke in pixels, `interval` apart up to the end of its line, unit directions, offsets."""
    left = np.where(lines.loop[line], lines.length[line], lines.length[line] - along)
    # A mark that would lie on the end but for rounding is the last.
    count = np.clip(np.ceil(left / interval - 1e-3).astype(np.int64) + 1, 2, points)
    offsets = np.concatenate([[0], np.cumsum(count)]).astype(np.int64)
    stroke = line_of(offsets)
    at = along[stroke] + np.minimum((np.arange(offsets[-1]) - offsets[stroke]) * interval, left[stroke])
    return lines.at(line[stroke], at).astype(np.float32), lines.way(line[stroke], at, interval), offsets


def _moved(
    control: Floats,
    heading: Floats64,
    offsets: NDArray[np.int64],
    number: NDArray[np.int64],
    hand: Hand,
    rng: np.random.Generator,
) -> Floats:
    """Control points where a hand puts them; one draw a stroke's number."""
    line = line_of(offsets)
    first, last = offsets[:-1], offsets[1:] - 1
    chance = rng.random((int(number.max()) + 1, 6 + 2 * hand.points))[number]
    mark = np.arange(len(control)) - first[line]
    # The end is moved, and the points before it by as much less as they are before it.
    part = mark / (last - first)[line]
    out = control + (part[:, None] * _within(hand.deviation, chance[:, 0:2])[line])
    out += hand.perturbation * (2.0 * chance[:, 6:].reshape(len(first), -1, 2)[line, mark] - 1.0)
    out[last] += heading[last] * (0.5 + 0.5 * chance[:, 4:5]) * hand.lengthening
    angle = np.radians(hand.rotation * (2.0 * chance[:, 5] - 1.0))[line]
    arm = out - out[first][line]
    turned = np.stack(
        [np.cos(angle) * arm[:, 0] - np.sin(angle) * arm[:, 1], np.sin(angle) * arm[:, 0] + np.cos(angle) * arm[:, 1]], axis=1
    )
    return (out[first][line] + turned + _within(hand.translation, chance[:, 2:4])[line]).astype(np.float32)


def _within(radius: float, chance: Floats64) -> Floats64:
    """(n, 2) places spread evenly over a disc, from (n, 2) numbers spread evenly between 0 and 1."""
    angle, r = 2 * np.pi * chance[:, 0], radius * np.sqrt(chance[:, 1])
    return np.stack([r * np.cos(angle), r * np.sin(angle)], axis=1)


def _at(depth: Floats, points: Floats) -> Floats:
    """(n,) depth at the pixels that points lie in; where there is none, the mean of the others."""
    h, w = depth.shape
    x, y = np.clip(points, 0, (w - 1, h - 1)).astype(np.int64).T
    found = depth[y, x]
    known = np.isfinite(found)
    return np.where(known, found, found[known].mean() if known.any() else 0.0)


def _unprojected(camera: Camera, points: Floats, depth: Floats) -> Floats64:
    """(n, 3) world places seen at points (n, 2) of the picture."""
    ray = camera.rays()
    x, y = points.astype(np.float64).T[:, :, None]
    return np.asarray(ray[0] + x * ray[1] + y * ray[2] + depth[:, None] * (ray[3] + x * ray[4] + y * ray[5]))


def bezier(control: NDArray[np.floating], t: NDArray[np.floating]) -> NDArray[np.float64]:
    """(m, len(t), k) places on m Bézier curves of control points (m, n, k), by De Casteljau's repeated division."""
    # The divisions are the same for all curves: their weights come from unit control points.
    n = control.shape[1]
    weight = np.broadcast_to(np.eye(n), (len(t), n, n))
    for _ in range(n - 1):
        weight = weight[:, :-1] + t[:, None, None] * (weight[:, 1:] - weight[:, :-1])
    return np.einsum("tn,mnk->mtk", weight[:, 0], control)


def _curves(control: Floats, light: Floats, offsets: NDArray[np.int64]) -> tuple[Floats, Floats, NDArray[np.int64]]:
    """Bézier curves through the beginnings and ends of strokes, with the light along them."""
    count = np.diff(offsets)
    length = np.add.reduceat(np.append(np.linalg.norm(np.diff(control, axis=0), axis=1), 0.0), offsets[:-1])
    # As many points on each as the longest of its kind needs.
    fine = np.zeros(len(count), dtype=np.int64)
    for n in np.unique(count):
        fine[count == n] = int(np.clip(length[count == n].max() / FINE, 4, 200)) + 1
    ends = np.concatenate([[0], np.cumsum(fine)]).astype(np.int64)
    out = np.empty((ends[-1], 3), dtype=np.float32)
    values = np.concatenate([control, light[:, None]], axis=1)
    for n in np.unique(count):
        these = np.flatnonzero(count == n)
        m = fine[these[0]]
        places = bezier(values[offsets[these][:, None] + np.arange(n)], np.linspace(0.0, 1.0, m))
        out[(ends[these][:, None] + np.arange(m)).ravel()] = places.reshape(-1, 3)
    return out[:, :2].copy(), out[:, 2].copy(), ends
