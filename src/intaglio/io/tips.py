"""What a brush leaves: its tip at several sizes, and the heights of paper that pigment catches on."""

# D. J. Heeger, J. R. Bergen, "Pyramid-based texture analysis/synthesis", 1995 (band-pass noise with a given histogram).

from __future__ import annotations

from dataclasses import dataclass
from functools import cache

import numpy as np
from numpy.typing import NDArray

from intaglio.brush import Brush
from intaglio.errors import InputError

Floats = NDArray[np.float32]

SIDE = 64  # texels of the largest tip
SIZES = 5  # each half as large as the one before
VARIANTS = 4
OPACITIES = np.linspace(0.0, 1.0, 33)
SPAN = 1.5  # tip widths that a stroke is looked at across: more than the diagonal
FULLEST = 0.98  # pigment never covers more in one stroke

STREAK = 8.0  # clumps are so much longer than wide where the tip follows the stroke

PAPER_SIDE = 1024
PAPER_TEXEL = 0.04  # mm
# Where heights are grouped to bumps: cycles per texel.
PAPER_BAND = (0.03, 0.13)


@dataclass(frozen=True, eq=False)
class Tips:
    """A brush's tip, ready to be stamped.

    texture  (sizes, variants, 66, 66) pigment 0..1; size s fills 64 / 2^s from 1 on, with nothing around it
    column   pigment that passes a place in the stroke's densest track while the tip moves on by its own width
    covered  (33,) share of the tip's width that a stroke covers whose densest track has the OPACITIES
    """

    texture: Floats
    column: float
    covered: NDArray[np.float64]


def noise(side: int, low: float, high: float, rng: np.random.Generator, stretch: float = 1.0) -> Floats:
    """(side, side) tileable noise of frequencies low..high, in cycles per texel; its values are spread evenly over 0..1.

    Lower frequencies are stronger, as in what nature makes; `stretch` draws it out along rows.
    """
    f = np.maximum(np.hypot(np.fft.fftfreq(side)[:, None], stretch * np.fft.rfftfreq(side)[None]), 1e-9)
    band = np.exp(-((f / high) ** 4)) * (1.0 - np.exp(-((f / low) ** 4))) / f
    wave = np.fft.irfft2(np.fft.rfft2(rng.standard_normal((side, side))) * band, (side, side))
    rank = np.empty(side * side, dtype=np.float32)
    rank[np.argsort(wave, axis=None, kind="stable")] = (np.arange(side * side) + 0.5) / (side * side)
    return rank.reshape(side, side)


@cache
def paper_heights() -> Floats:
    """(1024, 1024) heights of a rough paper, tileable: any height is as common as any other.

    Pigment that reaches down to height 1 - c therefore covers the share c of it: grain does not change the tone.
    """
    return noise(PAPER_SIDE, *PAPER_BAND, np.random.default_rng(1))


@cache
def tips(brush: Brush) -> Tips:
    """A brush's texture, and its calibration."""
    largest = np.stack([_image(brush.image)] * VARIANTS) if brush.image else _drawn(brush)
    texture = np.zeros((SIZES, VARIANTS, SIDE + 2, SIDE + 2), dtype=np.float32)
    for s in range(SIZES):
        n = SIDE >> s
        texture[s, :, 1 : n + 1, 1 : n + 1] = largest.reshape(VARIANTS, n, SIDE // n, n, SIDE // n).mean(axis=(2, 4))
    profile = _profile(largest, brush.turning)
    column = float(profile.max())
    if column <= 0.0:
        raise InputError(f"brush {brush.image!r} is blank: its tip needs dark or opaque pixels")
    peak = np.minimum(OPACITIES, FULLEST)
    covered = (1.0 - (1.0 - peak[:, None]) ** (profile[None] / column)).mean(axis=1) * SPAN
    return Tips(texture, column, covered)


def _drawn(brush: Brush) -> Floats:
    """(variants, 64, 64) tips from a brush's numbers."""
    at = (np.arange(SIDE) + 0.5) / SIDE * 2.0 - 1.0
    r = np.hypot(at[:, None], at[None])
    inner = 0.96 * (1.0 - brush.softness)
    t = np.clip((0.98 - r) / (0.98 - inner), 0.0, 1.0)
    disc = t * t * (3.0 - 2.0 * t)
    rng = np.random.default_rng(2)
    finest = 1.0 / (brush.clump * SIDE)
    stretch = 1.0 if brush.turning else STREAK
    held = [noise(SIDE, 0.3 * finest, 1.2 * finest, rng, stretch) for _ in range(VARIANTS)]
    out = [disc * (1.0 - brush.clumps * (1.0 - pigment)) for pigment in held]
    return np.stack(out).astype(np.float32)


def _image(path: str) -> Floats:
    """(64, 64) pigment of an image file."""
    from PIL import Image, UnidentifiedImageError

    try:
        with Image.open(path) as file:
            clear = file.has_transparency_data
            picture = file.convert("RGBA" if clear else "L")
    except (OSError, UnidentifiedImageError) as error:
        raise InputError(f"brush {path!r} cannot be read as an image: {error}") from error
    # In the middle of a square, so that no tip is stretched.
    side = max(picture.size)
    square = Image.new(picture.mode, (side, side), (0, 0, 0, 0) if clear else 255)
    square.paste(picture, ((side - picture.width) // 2, (side - picture.height) // 2))
    pixels = np.asarray(square.resize((SIDE, SIDE), Image.Resampling.BOX), dtype=np.float32) / 255.0
    if not clear:
        return 1.0 - pixels
    return pixels[..., 3]


def _profile(tip: Floats, turning: bool) -> NDArray[np.float64]:
    """(256,) pigment that passes at places across a stroke while the tip moves on by its own width; SPAN tip widths."""
    at = (np.arange(SIDE) + 0.5) / SIDE - 0.5
    y, x = np.meshgrid(at, at, indexing="ij")
    pigment = tip.mean(axis=0).astype(np.float64).ravel() / SIDE**2
    angles = np.linspace(0.0, 2 * np.pi, 24, endpoint=False) if turning else np.zeros(1)
    out = np.zeros(256)
    for angle in angles:
        across = (np.cos(angle) * y + np.sin(angle) * x).ravel() / SPAN + 0.5
        out += np.bincount((across * 256).astype(np.int64), weights=pigment, minlength=256)
    # Bins are finer than texels.
    return np.convolve(out / len(angles) * 256 / SPAN, np.ones(5) / 5, mode="same")
