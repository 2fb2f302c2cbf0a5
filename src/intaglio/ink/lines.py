"""Contours and feature lines as strokes."""

from __future__ import annotations

from typing import Literal

import numpy as np

from intaglio.drawing import Layer, Strokes
from intaglio.gbuffer import GBuffer
from intaglio.ink.beginnings import Beginnings
from intaglio.ink.contours import occluding_contours
from intaglio.ink.features import feature_lines
from intaglio.ink.hand import drawn_by_hand
from intaglio.ink.section import rim_layer
from intaglio.ink.strokes import arc_length, pack, runs, smoothed, taper, weight_by_light
from intaglio.ink.styles import Hatching
from intaglio.ink.suggestive import suggestive_contours


def line_layers(gb: GBuffer, hatching: Hatching, mm_per_pixel: float, *, seed: int = 0) -> list[Layer]:
    """Ridges, valleys, suggestive and occluding contours, as a style asks for them; 0 means no such layer."""
    return lined(gb, hatching, mm_per_pixel, seed=seed)[0]


def lined(
    gb: GBuffer, hatching: Hatching, mm_per_pixel: float, *, seed: int = 0, kept: Beginnings | None = None
) -> tuple[list[Layer], Beginnings]:
    """The layers, and where contours drawn by hand begin; `kept` are a former picture's."""
    beginnings = Beginnings.none()
    thin = 0.8 * (hatching.contour or hatching.thickest)
    layers = []
    if hatching.ridge > 0:
        layers.append(feature_layer(gb, mm_per_pixel, "ridge", radius=hatching.ridge, width=thin, colour=hatching.ink))
    if hatching.valley > 0:
        layers.append(feature_layer(gb, mm_per_pixel, "valley", radius=hatching.valley, width=thin, colour=hatching.ink))
    if hatching.suggestive > 0:
        radius = hatching.suggestive
        layers.append(feature_layer(gb, mm_per_pixel, "suggestive", radius=radius, width=thin, shortest=4.0, colour=hatching.ink))
    if hatching.contour > 0:
        width, opacity = hatching.contour, hatching.contour_opacity
        if gb.cut.any():
            shortest = hatching.contour_shortest
            layers.append(rim_layer(gb, mm_per_pixel, width=0.8 * width, shortest=shortest, colour=hatching.ink, opacity=opacity))
        if hatching.hand:
            drawn, beginnings = drawn_by_hand(
                gb, hatching.hand, mm_per_pixel, width=width, opacity=opacity, bright=hatching.bright, seed=seed, kept=kept
            )
            layers.append(Layer("contour", drawn, colour=hatching.ink))
        else:
            shortest = hatching.contour_shortest
            layers.append(
                contour_layer(
                    gb, mm_per_pixel, width=width, shortest=shortest, colour=hatching.ink, opacity=opacity, bright=hatching.bright
                )
            )
    return layers, beginnings


def contour_layer(
    gb: GBuffer,
    mm_per_pixel: float,
    *,
    width: float = 0.42,
    shortest: float = 1.2,
    colour: str = "#000000",
    opacity: float = 1.0,
    bright: bool = False,
) -> Layer:
    """The occluding contours: heavier where more lies behind them, and away from the light; lengths in mm on paper.

    bright  heavier towards the light instead
    """
    contours = occluding_contours(gb)
    points, offsets = contours.points, contours.offsets
    if len(points) == 0:
        return Layer("contour", Strokes.none(), colour=colour)
    # A jump as deep as a tenth of the subject counts like the background.
    depth = gb.depth[gb.mask]
    reach = 0.1 * float(depth.max() - depth.min()) + 1e-6
    strength = np.sqrt(np.clip(contours.jump / reach, 0.0, 1.0))

    # Faint contours must be longer to stay: noise makes short ones.
    length = arc_length(points, offsets)[offsets[1:] - 1] * mm_per_pixel
    mean = np.add.reduceat(strength, offsets[:-1]) / np.diff(offsets)
    index, offsets = runs(np.repeat(length >= shortest * (3.0 - 2.0 * mean), np.diff(offsets)), offsets)
    if len(index) == 0:
        return Layer("contour", Strokes.none(), colour=colour)
    points, strength, light = points[index], strength[index], contours.light[index]
    weight = smoothed((0.5 + 0.5 * strength) * weight_by_light(light, bright), offsets, 12)
    points = smoothed(points, offsets, 2) * np.float32(mm_per_pixel)

    # An end that fades into the surface is drawn out; one that meets another contour is not.
    first, last = offsets[:-1], offsets[1:] - 1
    closed = (points[first] == points[last]).all(axis=1)
    begin = np.where(closed | (strength[first] > 0.6), 0.0, 8 * width)
    end = np.where(closed | (strength[last] > 0.6), 0.0, 8 * width)
    thickness = width * weight * taper(points, offsets, begin, end)
    return Layer("contour", pack(points, thickness, np.full(len(points), opacity), offsets), colour=colour)


def feature_layer(
    gb: GBuffer,
    mm_per_pixel: float,
    kind: Literal["valley", "ridge", "suggestive"],
    *,
    radius: float,
    width: float,
    shortest: float = 2.5,
    colour: str = "#000000",
    opacity: float = 1.0,
) -> Layer:
    """Valleys or ridges bent tighter than `radius`: from nothing at twice the radius to full width at half of it.

    Or suggestive contours, where radial curvature rises by 1 / radius2 in a mm. radius, width and shortest in mm on paper.
    A line must reach the radius somewhere and be longer than `shortest`.
    """
    if not gb.mask.any():
        return Layer(kind, Strokes.none(), colour=colour)
    world = float(np.median(gb.pixel_mm[gb.mask])) / mm_per_pixel
    if kind == "suggestive":
        needed, least = 3.0, 1.0 / (3.0 * (radius * world) ** 2)
        points, strength, offsets = suggestive_contours(gb, sigma=1.3 / mm_per_pixel, least=least)
    else:
        needed, least = 2.0, 1.0 / (2.0 * radius * world)
        points, strength, offsets = feature_lines(gb, kind, sigma=0.35 / mm_per_pixel, least=least)
    if len(points) == 0:
        return Layer(kind, Strokes.none(), colour=colour)
    length = arc_length(points, offsets)[offsets[1:] - 1] * mm_per_pixel
    most = np.maximum.reduceat(strength, offsets[:-1])
    index, offsets = runs(np.repeat((length >= shortest) & (most > needed * least), np.diff(offsets)), offsets)
    if len(index) == 0:
        return Layer(kind, Strokes.none(), colour=colour)
    points = smoothed(points[index], offsets, 6) * np.float32(mm_per_pixel)
    weight = smoothed(np.clip((strength[index] - least) / (3.0 * least), 0.0, 1.0), offsets, 8)
    thickness = width * (0.25 + 0.75 * weight) * taper(points, offsets, 1.2, 1.2)
    return Layer(kind, pack(points, thickness, np.full(len(points), opacity), offsets), colour=colour)
