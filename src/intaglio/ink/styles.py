"""The parameters of hatching, and styles: named presets over them."""

from __future__ import annotations

from dataclasses import dataclass, field, fields, replace
from typing import Any

from intaglio.drawing import check_colour
from intaglio.errors import InputError


def _option(default: object, help: str, low: float | None = None, high: float | None = None) -> object:
    return field(default=default, metadata={"help": help, "low": low, "high": high})


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
    contour_shortest: float = _option(2.5, "contours shorter than this are left out, mm", 0, 100)  # type: ignore[assignment]
    ink: str = _option("#000000", "colour of strokes, #rrggbb")  # type: ignore[assignment]
    paper: str = _option("#ffffff", "colour of paper, #rrggbb")  # type: ignore[assignment]

    def __post_init__(self) -> None:
        for item in fields(self):
            value, low, high = getattr(self, item.name), item.metadata["low"], item.metadata["high"]
            if low is not None and not low <= value <= high:
                raise InputError(f"{item.name} must be between {low:g} and {high:g}, not {value!r}")
        if self.thinnest > self.thickest:
            raise InputError(f"thinnest must not be above thickest ({self.thickest:g} mm), not {self.thinnest!r}")
        if self.black >= self.white:
            raise InputError(f"black must be below white ({self.white:g}), not {self.black!r}")
        check_colour(self.ink)
        check_colour(self.paper)


STYLES: dict[str, Hatching] = {
    # One layer whose lines swell with darkness, as in textbooks.
    "pen-and-ink": Hatching(
        layers=1, separation=0.75, thinnest=0.06, thickest=0.5, white=0.8, black=0.1, contrast=1.15, taper=0.8, ragged=0.008,
    ),
    # Fine lines, nested, crossed in the shadows: copperplate.
    "engraving": Hatching(
        layers=2, crosshatch=1, separation=0.8, thinnest=0.05, thickest=0.26, smoothing=7.0, contour=0.3, taper=1.0, angle=60.0,
    ),
    # Grey strokes of a hand's length that overlap, press harder in the dark and do not run quite straight.
    "pencil": Hatching(
        layers=2, crosshatch=1, separation=0.75, thinnest=0.1, thickest=0.27, opacity=0.62, pressure=0.6, white=0.75,
        black=0.08, contrast=1.4, longest=16.0, wobble=0.07, ragged=0.06, taper=3.0, contour=0.34, angle=40.0,
        ink="#2b2b2e", paper="#fbfaf6",
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
