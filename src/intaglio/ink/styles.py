"""Styles: named presets over the parameters of hatching."""

from __future__ import annotations

from dataclasses import replace
from typing import Any

from intaglio.errors import InputError
from intaglio.ink.hatching import Hatching

STYLES: dict[str, Hatching] = {
    "pen-and-ink": Hatching(layers=1, separation=0.75, thinnest=0.06, thickest=0.5, white=0.8, black=0.1, contrast=1.15, taper=0.8),
    "engraving": Hatching(
        layers=2, crosshatch=1, separation=0.8, thinnest=0.05, thickest=0.26, smoothing=7.0, contour=0.3, taper=1.0, angle=60.0,
    ),
    "pencil": Hatching(
        layers=2, crosshatch=1, separation=0.8, thinnest=0.1, thickest=0.26, opacity=0.6, pressure=0.6, white=0.85, black=0.1,
        wobble=0.05, ragged=0.06, taper=2.0, contour=0.36, ink="#2b2b2e", paper="#fbfaf6", angle=50.0,
    ),
}  # fmt: skip


def styles() -> tuple[str, ...]:
    """Names of the styles."""
    return tuple(STYLES)


def style(name: str, **changes: Any) -> Hatching:
    """A named style with single parameters changed."""
    if name not in STYLES:
        raise InputError(f"style must be one of {', '.join(STYLES)}, not {name!r}")
    unknown = sorted(set(changes) - set(Hatching.__dataclass_fields__))
    if unknown:
        raise InputError(f"{unknown[0]!r} is not a parameter of hatching; those are {', '.join(Hatching.__dataclass_fields__)}")
    return replace(STYLES[name], **changes)
