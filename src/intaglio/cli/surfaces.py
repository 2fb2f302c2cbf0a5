"""`--surface`, `--label` and `--tf`: the parts of a plate, from their texts on the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.options import number
from intaglio.ink.styles import STYLES, Hatching

if TYPE_CHECKING:
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
    ranges = [re.fullmatch(r"(\d+)(?:-(\d+))?", part.strip()) for part in where.split(",")]
    if not all(ranges):
        raise BadParameter(f"must begin with numbers of labels such as 5, 2,3 or 26-33,77, not {text!r}", param_hint="'--label'")
    return {"label": [range(int(r[1]), int(r[2] or r[1]) + 1) for r in ranges if r], "name": f"label {where}", **look}


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
