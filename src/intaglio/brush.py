"""Brush: how the pigment of a stroke lies on paper; vector files know only a stroke's outline."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path

from intaglio.errors import InputError

# A plain stroke of even ink with sharp edges; no brush at all.
PEN = "pen"
IMAGES = (".png", ".jpg", ".jpeg", ".tif", ".tiff", ".bmp")


@dataclass(frozen=True, kw_only=True)
class Brush:
    """A tip that is stamped along the stroke, in parts of its own width.

    softness  0: a disc with a sharp edge, 1: a bell
    clumps    how unevenly the tip holds its pigment, 0..1, in clumps of the size `clump`
    spacing   distance of stamps
    jitter    random change of size and pigment from stamp to stamp, 0..1
    turning   whether every stamp is turned at random; otherwise the tip follows the stroke and leaves streaks
    grain     how much of the pigment only catches on the paper's tops, 0..1
    image     file of a tip to use instead: dark is pigment, or opaque where it has transparency
    """

    softness: float = 0.5
    clumps: float = 0.0
    clump: float = 0.2
    spacing: float = 0.2
    jitter: float = 0.1
    turning: bool = True
    grain: float = 0.5
    image: str = ""


BRUSHES: dict[str, Brush] = {
    "pencil": Brush(softness=0.5, clumps=0.5, clump=0.25, spacing=0.25, grain=0.7, jitter=0.15),
    "graphite": Brush(softness=1.0, clumps=0.2, clump=0.15, spacing=0.25, grain=0.4),
    "charcoal": Brush(softness=0.7, clumps=0.97, clump=0.07, spacing=0.18, jitter=0.3, turning=False, grain=0.85),
    "chalk": Brush(softness=0.1, clumps=0.85, clump=0.2, spacing=0.3, grain=1.0, jitter=0.35),
    "ink": Brush(softness=0.1, spacing=0.15, jitter=0.12, grain=0.12),
}


def brush_named(name: str) -> Brush | None:
    """A brush by its name, or with an image file as its tip; None for the plain pen. InputError for another name."""
    if name == PEN:
        return None
    if name in BRUSHES:
        return BRUSHES[name]
    if Path(name).suffix.lower() in IMAGES:
        if not Path(name).is_file():
            raise InputError(
                f"brush {name!r} does not exist: name an image file, or one of {PEN}, {', '.join(BRUSHES)}"
            ) from FileNotFoundError(name)
        return Brush(image=name)
    raise InputError(f"brush must be {PEN}, {', '.join(BRUSHES)}, or an image file ({', '.join(IMAGES)}), not {name!r}")
