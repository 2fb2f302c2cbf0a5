"""`--iso`, `--surface`, `--label`, `--tf`, `--cut`: the parts of a plate, from their texts on the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.console import say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.options import Islands, Iso, number
from intaglio.ink.styles import STYLES, Hatching

if TYPE_CHECKING:
    from intaglio.parts import Part
    from intaglio.transfer_function import TransferFunction
    from intaglio.volume import Volume

# How opaque `contour` is without a percentage: what is behind shows.
VEIL = 0.4

SEVERAL: Any = {"rich_help_panel": "Several surfaces", "show_default": False}
HOW = "style, #rrggbb, percent opaque, or contour for lines alone"
SURFACE = f"Surface at a value, or matter from LOW..HIGH, cavities ..HIGH; then {HOW}. May be repeated."
LABEL = f"Body of labels such as 5 or 26-33,77; then {HOW}. May be repeated."
TF = "The surfaces a transfer function shows: its name, or a file of 3D Slicer or ParaView."

Surfaces = Annotated[list[str] | None, Option("--surface", metavar="VALUE[:HOW]...", help=SURFACE, **SEVERAL)]
LabelFile = Annotated[
    Path | None, Option("--labels", metavar="FILE", help="Label volume that --label picks from.", readable=False, **SEVERAL)
]
Labels = Annotated[list[str] | None, Option("--label", metavar="NUMBERS[:HOW]...", help=LABEL, **SEVERAL)]
Function = Annotated[str | None, Option("--tf", metavar="NAME|FILE", help=TF, **SEVERAL)]
Halo = Annotated[
    float, number("--halo", "Paper left free beside contours in what lies behind them", 0, 20, unit="MM", rich_help_panel="Paper")
]


@dataclass(frozen=True)
class Subject:
    """What of a scan is drawn."""

    iso: Iso = None
    islands: Islands = None
    surface: Surfaces = None
    labels: LabelFile = None
    label: Labels = None
    tf: Function = None
    cut: Cut = None
    halo: Halo = 0.5


def parts_named(subject: Subject, styled: Callable[[str | None], Hatching]) -> Callable[[Volume], list[Part]]:
    """Check all texts; what is returned makes the parts of them once the scan is read."""
    from intaglio.io.volumes import read_volume
    from intaglio.parts import ISLANDS, Part, parts_of
    from intaglio.rendering.isovalue import body_surface
    from intaglio.transfer_function import TransferFunction

    surfaces = [surface_of(text, styled) for text in subject.surface or ()]
    bodies = [label_of(text, styled) for text in subject.label or ()]
    if (subject.labels is None) != (not bodies):
        raise BadParameter("needs --labels FILE" if bodies else "needs --label NUMBERS", param_hint="'--label'")
    function = function_of(subject.tf)
    if sum(map(bool, (subject.iso is not None, subject.tf, surfaces or bodies))) > 1:
        raise BadParameter("cannot be given together; --surface alone says it all", param_hint="'--iso', '--tf', '--surface'")
    check_cuts(subject.cut)
    hatching = styled(None)
    pieces = ISLANDS if subject.islands is None else subject.islands

    def parts(volume: Volume) -> list[Part]:
        tools = tuple(selections_of(subject.cut, volume))
        if function is not None:
            shown = TransferFunction.preset(function, volume.range) if isinstance(function, str) else function
            return parts_of(volume, shown, style=hatching, islands=pieces, selections=tools)
        if surfaces or bodies:
            common: dict[str, Any] = {"islands": subject.islands, "selections": tools}
            of = read_volume(subject.labels) if subject.labels is not None else volume
            for text in of.notes if subject.labels is not None else ():
                say(f"note: {text}")
            found = [Part(volume=volume, **part, **common) for part in surfaces]
            return found + [Part(volume=of, **part | {"label": present(part["label"], of)}, **common) for part in bodies]
        iso = subject.iso
        if iso is None:
            iso, what = body_surface(volume)
            say(f"note: no --iso given; drawing {iso:g}, {what}")
        return [Part(volume=volume, iso=iso, style=hatching, islands=pieces, selections=tools)]

    return parts


def function_of(text: str | None) -> TransferFunction | str | None:
    """A transfer function from its file, or the name of one, checked; MR presets wait for the scan."""
    from intaglio.transfer_function import TransferFunction

    if text is None or text in TransferFunction.presets():
        return text
    if not Path(text).exists():
        known = ", ".join(TransferFunction.presets())
        raise BadParameter(f"must be one of {known}, or a file, not {text!r}", param_hint="'--tf'")
    return TransferFunction.read(text)


def surface_of(text: str, styled: Callable[[str | None], Hatching]) -> dict[str, Any]:
    """What a `--surface` says, as keywords of a Part."""
    where, look = _look(text, "--surface", styled)
    low, dots, high = where.rpartition("..")
    try:
        below = float(low) if low else -math.inf
        above = float(high) if high else math.inf
    except ValueError:
        below = above = math.nan
    if not below < above or not (high or dots) or (not low and not high):
        raise BadParameter(
            f"must begin with a value, LOW..HIGH or ..HIGH such as 0.55:pencil or 450..800:engraving:#8a2b1a, not {text!r}",
            param_hint="'--surface'",
        )
    return {"iso": (below, above) if dots else above, "name": where, **look}


def label_of(text: str, styled: Callable[[str | None], Hatching]) -> dict[str, Any]:
    """What a `--label` says, as keywords of a Part; a range of labels as one, to be resolved by `present`."""
    where, look = _look(text, "--label", styled)
    return {"label": label_ranges(where), "name": f"label {where}", **look}


def label_ranges(text: str) -> list[range]:
    """What 26-33,77 says."""
    ranges = [re.fullmatch(r"(\d+)(?:-(\d+))?", part.strip()) for part in text.split(",")]
    if not all(ranges):
        raise BadParameter(f"must begin with numbers of labels such as 5, 2,3 or 26-33,77, not {text!r}", param_hint="'--label'")
    return [range(int(r[1]), int(r[2] or r[1]) + 1) for r in ranges if r]


def present(ranges: list[range], volume: Volume) -> tuple[int, ...]:
    """Single labels as they are; of ranges those that the volume has."""
    import numpy as np

    known = set(np.unique(volume.array).tolist())
    return tuple(label for r in ranges for label in r if len(r) == 1 or label in known)


def _look(text: str, option: str, styled: Callable[[str | None], Hatching]) -> tuple[str, dict[str, Any]]:
    where, *words = (word.strip() for word in text.split(":"))
    look: dict[str, Any] = {"style": styled(None)}
    for word in words:
        if word in STYLES:
            look["style"] = styled(word)
        elif word == "contour":
            look = {"opacity": VEIL, **look, "lines_only": True}
        elif re.fullmatch(r"#[0-9a-fA-F]{6}", word):
            look["colour"] = word
        elif (percent := re.fullmatch(r"(\d+(?:\.\d+)?)%", word)) and 0 < float(percent[1]) <= 100:
            look["opacity"] = float(percent[1]) / 100
        else:
            known = f"{', '.join(STYLES)}, contour, #rrggbb, or a percentage above 0% up to 100%"
            raise BadParameter(f"{text!r} has {word!r} where it must have {known}", param_hint=f"'{option}'")
    return where, look
