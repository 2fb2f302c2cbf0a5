"""Parts of a plate: which surface of which volume, and how it is drawn."""

# M. Gerl, "Volume Hatching for Illustrative Visualization", diploma thesis, 2006: surfaces from the maxima of a transfer
# function's opacity, drawn the sparser and fainter the more transparent they are.

from __future__ import annotations

import math
from collections.abc import Sequence
from dataclasses import dataclass, field, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from intaglio.drawing import Layer, check_colour
from intaglio.errors import InputError
from intaglio.ink.styles import Hatching, style as named_style
from intaglio.rendering.isovalue import body_side, body_surface
from intaglio.rendering.skipping import SURFACE, Inside, surface_blocks, surface_corners
from intaglio.selection import Selection
from intaglio.solid.bodies import between, has_matter
from intaglio.solid.labels import label_distance
from intaglio.transfer_function import OpacityPeak, TransferFunction
from intaglio.volume import Volume, check_volume

# Pieces smaller than this part of the largest one are dust, cables or a corner of the table.
ISLANDS = 0.01
# Strokes of a veil come this much farther apart at most.
SPARSEST = 4.0
# Brightness (0..1) above which a colour is too light to draw with on white paper.
LIGHTEST = 0.26


@dataclass(frozen=True, eq=False, kw_only=True)
class Part:
    """A surface of a volume, and how it is drawn.

    volume      a scan, or a label volume if `label` is given
    iso         value at the surface, or (low, high): matter of values between these two, seen from outside or from within
                denser matter; (-math.inf, high) is cavities. Default: the surface of the body, see `body_surface`
    inside      on which side of iso the body is, "above" or "below"; default: above, but below in distances
    label       number of a label, or several that make one body
    style       a name from `styles()`, or a Hatching
    opacity     1 hides what lies behind. Less lets it show, and makes strokes fewer and fainter
    lines_only  contours and feature lines without hatching
    colour      "#rrggbb", instead of the style's ink
    name        of its layers; needed only to tell parts apart
    selections  tools that cut it open
    islands     pieces smaller than this part of the largest one are left out; default: 0.01, and none of a label
    """

    volume: Volume
    iso: float | tuple[float, float] | None = None
    inside: Inside | None = None
    label: int | tuple[int, ...] | None = None
    style: str | Hatching = "pencil"
    opacity: float = 1.0
    lines_only: bool = False
    colour: str | None = None
    name: str = ""
    selections: Sequence[Selection] = field(default=())
    islands: float | None = None

    def __post_init__(self) -> None:
        check_volume(self.volume)
        if not 0 < self.opacity <= 1:
            raise InputError(f"opacity of a part must be above 0, up to 1, not {self.opacity!r}; leave out what is not seen")
        if self.iso is not None and self.label is not None:
            raise InputError(f"a part must have an iso or a label, not both ({self.iso!r} and {self.label!r})")
        body_side(self.volume, self.inside)
        if self.colour is not None:
            check_colour(self.colour)
        named_style(self.style)

    @cached_property
    def body(self) -> tuple[Volume, float, Inside]:
        """The volume that holds the surface, its isovalue there, and on which side of it the body is."""
        if self.label is not None:
            labels = (self.label,) if isinstance(self.label, int) else self.label
            return label_distance(self.volume, labels), 0.0, "below"
        if isinstance(self.iso, tuple) and self.iso[1] == math.inf:
            return self.volume, self.iso[0], "above"
        if isinstance(self.iso, tuple):
            return between(self.volume, *self.iso), 0.0, "below"
        iso = body_surface(self.volume)[0] if self.iso is None else self.iso
        return self.volume, iso, body_side(self.volume, self.inside)

    @property
    def title(self) -> str:
        """The part's name, or where its surface is."""
        if self.name:
            return self.name
        if self.label is not None:
            return f"label {self.label}"
        if isinstance(self.iso, tuple):
            low, high = self.iso
            return f"cavities to {high:g}" if low == -math.inf else f"{low:g} to {high:g}"
        return f"iso {self.body[1]:g}"

    @property
    def smallest(self) -> float:
        """What pieces are left out, as a part of the largest one."""
        if self.islands is None:
            return ISLANDS if self.label is None else 0.0
        return self.islands

    @property
    def corners(self) -> NDArray[np.float64]:
        """(n, 3) world points around the surface; the whole volume where there is none."""
        volume, iso, inside = self.body
        blocks = surface_blocks(volume, iso, self.smallest, inside)
        return surface_corners(volume, blocks) if (blocks == SURFACE).any() else volume.corners

    @property
    def hatching(self) -> Hatching:
        """The style, sparser by the part's transparency and in its colour."""
        style = named_style(self.style)
        style = style if self.colour is None else replace(style, ink=self.colour)
        if self.opacity == 1:
            return style
        return replace(
            style,
            separation=min(style.separation * min(1 / self.opacity, SPARSEST), 50.0),
            layers=max(1, round(style.layers * self.opacity)),
            crosshatch=round(style.crosshatch * self.opacity),
            thickest=max(style.thickest * math.sqrt(self.opacity), style.thinnest),
        )


def faded(layer: Layer, opacity: float) -> Layer:
    """A layer of a part of this opacity: strokes lose half as much as the part does on a logarithmic scale."""
    if opacity == 1:
        return layer
    strokes = replace(layer.strokes, opacity=layer.strokes.opacity * np.float32(math.sqrt(opacity)))
    return replace(layer, strokes=strokes)


def parts_of(
    volume: Volume,
    transfer_function: TransferFunction,
    *,
    style: str | Hatching = "pencil",
    islands: float = ISLANDS,
    selections: Sequence[Selection] = (),
) -> list[Part]:
    """The surfaces that a transfer function shows of a volume, by ascending value.

    Every local maximum of opacity is one; it begins at the minimum before and ends at the one behind. The first begins at an
    isovalue, whatever is denser being inside it; others are the matter between their two minima if there is any, so that
    they are found beneath denser matter, too. Of the lowest values only cavities are matter. The most opaque surface hides
    what is behind it; opacities of others are relative to it. The outermost shows contours alone if there are others.
    Colours are darkened to be legible on light paper.
    InputError if the function shows no surface.
    """
    low, high = volume.range
    found: list[tuple[OpacityPeak, float | tuple[float, float]]] = []
    for peak in transfer_function.surfaces():
        begin = peak.threshold if peak.threshold > low else -math.inf
        end = peak.ceiling if peak.ceiling < high else math.inf
        first = all(isinstance(iso, tuple) for _, iso in found)
        if peak.opacity == 0 or peak.threshold >= high or peak.ceiling <= low or (begin == -math.inf and end == math.inf):
            continue
        if end < math.inf and (begin == -math.inf or not first) and has_matter(volume, begin, end):
            found.append((peak, (begin, end)))
        elif begin > -math.inf:
            found.append((peak, begin))
    if not found:
        raise InputError(
            f"{transfer_function.name}: its opacity has no maximum that begins between {low:g} and {high:g}, the values of "
            f"{volume.name}; is it made for a scan of another kind? say where a surface is with iso="
        )
    most = max(peak.opacity for peak, _ in found)
    paper = named_style(style).paper
    parts = [
        Part(
            volume=volume, iso=iso, style=style, opacity=peak.opacity / most, colour=ink_colour(peak.colour, paper),
            islands=islands, selections=selections,
        )
        for peak, iso in found
    ]  # fmt: skip
    if len(parts) == 1:
        return [replace(parts[0], opacity=1.0)]
    size = [np.ptp(part.corners, axis=0).prod() for part in parts]
    outer = int(np.argmax(size))
    parts[outer] = replace(parts[outer], lines_only=True, opacity=min(parts[outer].opacity, 0.5))
    return parts


def ink_colour(colour: tuple[float, float, float], paper: str = "#ffffff") -> str:
    """A transfer function's colour as ink: its hue, dark enough to be read on light paper."""
    rgb = np.array(colour)
    weights = np.array([0.2126, 0.7152, 0.0722])
    light = np.array([int(paper[i : i + 2], 16) / 255 for i in (1, 3, 5)]) @ weights
    if light > 0.5:
        # A power deepens what hue a light colour has; what that leaves too light is darkened alike.
        deeper = [rgb**power for power in np.linspace(1.0, 3.0, 9)]
        rgb = next((c for c in deeper if c @ weights <= LIGHTEST), deeper[-1])
        rgb = rgb * min(1.0, LIGHTEST / max(float(rgb @ weights), 1e-6))
    r, g, b = np.rint(255 * rgb).astype(int)
    return f"#{r:02x}{g:02x}{b:02x}"
