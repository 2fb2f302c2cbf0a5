"""The parameters of hatching, and styles: named presets over them."""

from __future__ import annotations

from dataclasses import dataclass, field, replace
from typing import Any

from intaglio.brush import BRUSHES, PEN, brush_named
from intaglio.drawing import check_colour
from intaglio.errors import InputError
from intaglio.ink.hand import Hand
from intaglio.ink.options import check_bounds, option as _option

HAND = "contours drawn by hand in overlapping strokes, not exactly"


@dataclass(frozen=True, kw_only=True)
class Hatching:
    """Parameters of a hatched tone; lengths in mm on paper. Layers come in the order of rising darkness."""

    separation: float = _option(0.9, "distance of lines in the lightest layer, mm", 0.1, 50)  # type: ignore[assignment]
    layers: int = _option(2, "layers along the form; each one halves the distance", 1, 4)  # type: ignore[assignment]
    crosshatch: int = _option(0, "further layers across, for the darkest tones", 0, 4)  # type: ignore[assignment]
    angle: float = _option(90.0, "angle of crosshatching to hatching, degrees", 1, 179)  # type: ignore[assignment]
    thinnest: float = _option(0.08, "width of a line where tone begins, mm", 0.005, 10)  # type: ignore[assignment]
    thickest: float = _option(0.34, "width of a line at its darkest, mm", 0.01, 10)  # type: ignore[assignment]
    opacity: float = _option(1.0, "opacity of a line at its darkest", 0.02, 1)  # type: ignore[assignment]
    pressure: float = _option(0.0, "part of the tone made by opacity, not width", 0, 1)  # type: ignore[assignment]
    white: float = _option(0.8, "brightness above which paper stays blank", 0.02, 1.5)  # type: ignore[assignment]
    black: float = _option(0.12, "brightness below which tone is darkest", 0, 1)  # type: ignore[assignment]
    contrast: float = _option(1.3, "exponent of darkness: more keeps middle tones lighter", 0.2, 5)  # type: ignore[assignment]
    smoothing: float = _option(6.0, "distance over which stroke directions are averaged, mm", 0, 100)  # type: ignore[assignment]
    passes: int = _option(3, "passes of the averaging of directions", 1, 20)  # type: ignore[assignment]
    evenness: float = _option(0.45, "how near lines may come, as a part of their distance", 0.1, 1)  # type: ignore[assignment]
    blur: float = _option(0.7, "distance over which light is averaged, mm", 0, 100)  # type: ignore[assignment]
    shortest: float = _option(1.5, "strokes shorter than this are left out, mm", 0, 100)  # type: ignore[assignment]
    longest: float = _option(0.0, "strokes longer than this are lifted and set again, mm; 0 for never", 0, 10000)  # type: ignore[assignment]
    taper: float = _option(1.0, "length over which strokes thin out, mm", 0, 100)  # type: ignore[assignment]
    wobble: float = _option(0.0, "unsteadiness of the hand, mm", 0, 5)  # type: ignore[assignment]
    ragged: float = _option(0.02, "spread of the darkness at which strokes end", 0, 0.5)  # type: ignore[assignment]
    contour: float = _option(0.42, "width of contours, mm; 0 for none", 0, 10)  # type: ignore[assignment]
    valley: float = _option(2.5, "hollows bent tighter than this radius get a line, mm; 0 for none", 0, 100)  # type: ignore[assignment]
    ridge: float = _option(0.9, "edges bent tighter than this radius get a line, mm; 0 for none", 0, 100)  # type: ignore[assignment]
    suggestive: float = _option(0.0, "lines where slopes nearly turn away; more from 3 to 8 mm, 0 for none", 0, 100)  # type: ignore[assignment]
    hollows: float = _option(0.3, "darkness added in hollows", 0, 1)  # type: ignore[assignment]
    contour_opacity: float = _option(1.0, "opacity of contours", 0.02, 1)  # type: ignore[assignment]
    contour_shortest: float = _option(2.5, "contours shorter than this are left out, mm", 0, 100)  # type: ignore[assignment]
    ink: str = _option("#000000", "colour of strokes, #rrggbb")  # type: ignore[assignment]
    paper: str = _option("#ffffff", "colour of paper, #rrggbb")  # type: ignore[assignment]
    brush: str = _option(PEN, f"what strokes are drawn with in a PNG: {PEN}, {', '.join(BRUSHES)}, or an image of a tip")  # type: ignore[assignment]
    grain: float = _option(0.0, "roughness of the paper, on which brushes catch in a PNG", 0, 1)  # type: ignore[assignment]
    hand: Hand | None = field(default=None, metadata={"help": HAND, "low": None, "high": None})

    def __post_init__(self) -> None:
        check_bounds(self)
        if self.thinnest > self.thickest:
            raise InputError(f"thinnest must not be above thickest ({self.thickest:g} mm), not {self.thinnest!r}")
        if self.black >= self.white:
            raise InputError(f"black must be below white ({self.white:g}), not {self.black!r}")
        check_colour(self.ink)
        check_colour(self.paper)
        brush_named(self.brush)

    @property
    def bright(self) -> bool:
        """Whether strokes are light on dark paper: they then lie where it is bright, from `black` up to `white`."""
        return _luminance(self.ink) > _luminance(self.paper)


def _luminance(colour: str) -> float:
    """Display brightness of "#rrggbb", 0..1 (Rec. 709)."""
    r, g, b = (int(colour[i : i + 2], 16) / 255 for i in (1, 3, 5))
    return 0.2126 * r + 0.7152 * g + 0.0722 * b


# Those that matter where there is no tone.
LINE_PARAMETERS = (
    "contour", "contour_opacity", "contour_shortest", "valley", "ridge", "suggestive", "ink", "paper", "brush", "grain", "hand",
)  # fmt: skip

STYLES: dict[str, Hatching] = {
    # One layer whose lines swell with darkness, as in textbooks.
    "pen-and-ink": Hatching(
        layers=1, separation=0.75, thinnest=0.06, thickest=0.5, white=0.8, black=0.1, contrast=1.15, taper=0.8, ragged=0.008,
    ),
    # Fine lines, nested, crossed in the shadows: copperplate.
    "engraving": Hatching(
        layers=2, crosshatch=1, separation=0.8, thinnest=0.05, thickest=0.29, smoothing=7.0, contour=0.3, taper=1.0, angle=60.0,
    ),
    # Grey strokes of a hand's length that overlap, press harder in the dark and do not run quite straight.
    "pencil": Hatching(
        layers=2, crosshatch=1, separation=0.75, thinnest=0.1, thickest=0.31, opacity=0.62, pressure=0.6, white=0.75,
        black=0.08, contrast=1.4, longest=16.0, wobble=0.07, ragged=0.06, taper=3.0, contour=0.32, contour_opacity=0.75,
        angle=40.0,
        ink="#2b2b2e", paper="#fbfaf6", brush="pencil", grain=0.55, hand=Hand(),
    ),
    # Soft lead laid flat and close, almost without lines in the light; hardly any grain.
    "graphite": Hatching(
        layers=1, crosshatch=1, separation=0.5, thinnest=0.2, thickest=0.5, opacity=0.6, pressure=0.85, white=0.82,
        black=0.06, contrast=1.3, longest=13.0, wobble=0.1, ragged=0.05, taper=4.0, contour=0.4, contour_opacity=0.8,
        angle=30.0, valley=1.5, ink="#26272b", paper="#fdfdfb", brush="graphite", grain=0.6, hand=Hand(increment=5, taper=5.0),
    ),
    # Broad, crumbling strokes that sit on the tops of rough paper.
    "charcoal": Hatching(
        layers=1, crosshatch=1, separation=1.3, thinnest=0.5, thickest=1.2, opacity=0.75, pressure=0.8, white=0.8,
        black=0.1, contrast=1.5, longest=24.0, wobble=0.25, ragged=0.03, taper=5.0, contour=0.75, contour_opacity=0.85,
        angle=55.0, valley=1.5, ridge=0.0, shortest=2.5, ink="#1c1a19", paper="#f4efe4", brush="charcoal", grain=0.75,
        hand=Hand(interval=1.0, increment=5, deviation=0.6, perturbation=0.3, translation=0.15, thickness=0.7, shortest=5.0),
    ),
    # What the knife leaves standing: few lines, wedges that close up to black.
    "woodcut": Hatching(
        layers=1, separation=1.9, thinnest=0.12, thickest=1.8, white=0.72, black=0.16, contrast=1.2, smoothing=12.0,
        blur=1.4, taper=3.0, shortest=4.0, ragged=0.01, hollows=0.4, contour=1.1, contour_shortest=5.0, valley=2.0,
        ink="#17120e", paper="#f6eedd", brush="ink", grain=0.5,
    ),
    # Light strokes on dark paper, where it is bright.
    "chalk": Hatching(
        layers=1, crosshatch=1, separation=1.2, thinnest=0.4, thickest=1.1, opacity=0.8, pressure=0.7, white=0.86,
        black=0.16, contrast=1.9, longest=20.0, wobble=0.2, ragged=0.03, taper=3.0, contour=0.55, contour_opacity=0.8,
        angle=60.0, valley=0.0, ridge=0.0, shortest=2.0, ink="#f3efe2", paper="#2a3330", brush="chalk", grain=0.65,
        hand=Hand(interval=0.8, increment=5, deviation=0.4, thickness=0.6, shortest=4.0),
    ),
}  # fmt: skip


def styles() -> tuple[str, ...]:
    """Names of the styles."""
    return tuple(STYLES)


def style(name: str | Hatching, **changes: Any) -> Hatching:
    """A style, by name or as it is, with single parameters changed."""
    if isinstance(name, str) and name not in STYLES:
        raise InputError(f"style must be one of {', '.join(STYLES)}, not {name!r}")
    unknown = sorted(set(changes) - set(Hatching.__dataclass_fields__))
    if unknown:
        raise InputError(f"{unknown[0]!r} is not a parameter of hatching; those are {', '.join(Hatching.__dataclass_fields__)}")
    return replace(STYLES[name] if isinstance(name, str) else name, **changes)
