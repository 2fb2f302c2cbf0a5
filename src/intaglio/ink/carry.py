"""Lines of one view, carried with the surface into another."""

# D. Kalnins et al., "WYSIWYG NPR: drawing strokes directly on 3D models", 2002: what strokes owe to frames before.

from __future__ import annotations

import math
from dataclasses import replace

import numpy as np
from numpy.typing import NDArray

from intaglio.gbuffer import GBuffer
from intaglio.ink.streamlines import Streamlines
from intaglio.ink.strokes import arc_length, line_of, runs, sample, smoothed

Floats = NDArray[np.float32]

# Angle to the field up to which a line keeps its course, and from which on it does not follow it at all.
NEARLY = math.radians(20.0)
ACROSS = math.radians(45.0)


def _depths(gb: GBuffer, points: Floats) -> tuple[Floats, Floats, Floats]:
    """Bilinear, least and greatest depth (n,) of the four pixels about points (n, 2); inf beside the surface."""
    h, w = gb.depth.shape
    x, y = np.clip(points[:, 0] - 0.5, 0, w - 1), np.clip(points[:, 1] - 0.5, 0, h - 1)
    i, j = np.minimum(x.astype(np.int64), max(w - 2, 0)), np.minimum(y.astype(np.int64), max(h - 2, 0))
    i2, j2 = np.minimum(i + 1, w - 1), np.minimum(j + 1, h - 1)
    four = np.stack([gb.depth[j, i], gb.depth[j, i2], gb.depth[j2, i], gb.depth[j2, i2]])
    u, v = x - i, y - j
    share = np.stack([(1 - u) * (1 - v), u * (1 - v), (1 - u) * v, u * v])
    # Where a neighbour is paper, the surface is taken to go on level.
    solid = np.isfinite(four)
    share = np.where(solid, share, 0.0)
    total = share.sum(axis=0)
    mean = np.where(total > 0, (share * np.where(solid, four, 0.0)).sum(axis=0) / np.maximum(total, 1e-9), np.inf)
    return mean, four.min(axis=0), np.where(solid, four, -np.inf).max(axis=0)


def carried(lines: Streamlines, before: GBuffer, now: GBuffer) -> Streamlines:
    """Lines that lie on the surface in `before`, where `now` shows them, as far as it does; points as far apart as they were."""
    if len(lines) == 0:
        return lines
    ray = before.camera.rays()
    x, y = lines.points.astype(np.float64).T[:, :, None]
    depth, nearest, farthest = _depths(before, lines.points)
    # What lies across a jump in depth has no place.
    pixel = before.camera.pixel * (np.where(np.isfinite(depth), depth, 0.0) if before.camera.projection == "perspective" else 1.0)
    sure = np.isfinite(depth) & (farthest - nearest < 12.0 * pixel)
    depth = np.where(sure, depth, 0.0)[:, None]
    world = ray[0] + x * ray[1] + y * ray[2] + depth * (ray[3] + x * ray[4] + y * ray[5])
    place = now.camera.project(world)
    w, h = now.camera.size
    inside = sure & (place[:, 0] >= 0) & (place[:, 0] < w) & (place[:, 1] >= 0) & (place[:, 1] < h)
    points = np.where(inside[:, None], place[:, :2], 0.0).astype(np.float32)
    _, nearest, farthest = _depths(now, points)
    slack = 1.5 * pixel
    visible = (
        inside
        & now.mask[points[:, 1].astype(np.int64), points[:, 0].astype(np.int64)]
        & (place[:, 2] > nearest - slack)
        & (place[:, 2] < farthest + slack)
    )
    index, offsets = runs(visible, lines.offsets)
    step = float(np.linalg.norm(lines.points[1] - lines.points[0]))
    number = lines.number[line_of(lines.offsets)[index[offsets[:-1]]]]
    return _evenly(replace(lines, points=points[index], offsets=offsets, number=number), step)


def _evenly(lines: Streamlines, step: float) -> Streamlines:
    """The same lines with points a step apart; those that have become shorter than one go."""
    along = arc_length(lines.points, lines.offsets).astype(np.float64)
    if len(along) == 0:
        return lines
    total = along[lines.offsets[1:] - 1]
    long = total >= step
    count = np.floor(total / step).astype(np.int64) + 1
    # All lines one after the other on one axis, so that one interpolation serves them.
    start = np.concatenate([[0.0], np.cumsum(total + step)[:-1]])
    axis = along + start[line_of(lines.offsets)]
    offsets = np.concatenate([[0], np.cumsum(count[long])]).astype(np.int64)
    at = start[long][line_of(offsets)] + step * (np.arange(offsets[-1]) - np.repeat(offsets[:-1], np.diff(offsets)))
    points = np.stack([np.interp(at, axis, lines.points[:, c]) for c in (0, 1)], axis=1).astype(np.float32)
    return Streamlines(points, offsets, lines.number[long])


def bent(lines: Streamlines, field: Floats) -> Streamlines:
    """Lines turned half-way into a field (2, h, w) of double angles, each about its middle.

    From other sides the field runs a little otherwise over the same surface: lines that kept their old course would be met at
    an angle by what grows at their ends.
    """
    if len(lines) == 0:
        return lines
    step = np.diff(lines.points.astype(np.float64), axis=0, append=0)
    step[lines.offsets[1:] - 1] = 0.0
    along = np.arctan2(step[:, 1], step[:, 0])
    turn = 0.5 * np.angle((sample(field[0], lines.points) + 1j * sample(field[1], lines.points)) * np.exp(-2j * along))
    turn = np.where(np.abs(turn) < ACROSS, np.sign(turn) * np.maximum(np.abs(turn) - NEARLY, 0.0), 0.0)
    turn = smoothed(turn, lines.offsets, 12)
    c, s = np.cos(turn), np.sin(turn)
    turned = np.stack([c * step[:, 0] - s * step[:, 1], s * step[:, 0] + c * step[:, 1]], axis=1)
    shift = np.cumsum(turned - step, axis=0)[:-1]
    shift = np.concatenate([[[0.0, 0.0]], shift])
    count = np.diff(lines.offsets)
    shift -= np.repeat(np.add.reduceat(shift, lines.offsets[:-1], axis=0) / count[:, None], count, axis=0)
    # What grew at their ends met them at an angle.
    return replace(lines, points=smoothed((lines.points + shift).astype(np.float32), lines.offsets, 8))
