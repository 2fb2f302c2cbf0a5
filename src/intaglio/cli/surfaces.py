"""`--iso`, `--surface`, `--label`, `--tf`, `--cut`: the parts of a plate, from their texts on the command line."""

from __future__ import annotations

import math
import re
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.command import as_written
from intaglio.cli.console import say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.functions import function_of, transfer_function
from intaglio.cli.options import Inside, Islands, Iso, number
from intaglio.cli.placing import read_beside
from intaglio.errors import InputError
from intaglio.ink.styles import STYLES, Hatching

if TYPE_CHECKING:
    from intaglio.parts import Part
    from intaglio.volume import Volume

# How opaque `contour` is without a percentage: what is behind shows.
VEIL = 0.4

SEVERAL: Any = {"rich_help_panel": "Several surfaces", "show_default": False}
HOW = "style, #rrggbb, percent opaque, or contour for lines alone"
SURFACE = f"Surface at a value, or matter from LOW..HIGH, cavities ..HIGH; then {HOW}. May be repeated."
LABEL = f"Body of labels such as 5 or 26-33,77; then {HOW}. May be repeated."
TF = "The surfaces that a transfer function shows"

Surfaces = Annotated[list[str] | None, Option("--surface", metavar="VALUE[:HOW]...", help=SURFACE, **SEVERAL)]
LabelFile = Annotated[
    Path | None, Option("--labels", metavar="FILE", help="Label volume that --label picks from.", readable=False, **SEVERAL)
]
Labels = Annotated[list[str] | None, Option("--label", metavar="NUMBERS[:HOW]...", help=LABEL, **SEVERAL)]
Function = Annotated[str | None, transfer_function(TF, **SEVERAL)]
Halo = Annotated[
    float, number("--halo", "Paper left free beside contours in what lies behind them", 0, 20, unit="MM", rich_help_panel="Paper")
]


@dataclass(frozen=True)
class Subject:
    """What of a scan is drawn."""

    iso: Iso = None
    inside: Inside = None
    islands: Islands = None
    surface: Surfaces = None
    labels: LabelFile = None
    label: Labels = None
    tf: Function = None
    cut: Cut = None
    halo: Halo = 0.5


def parts_named(subject: Subject, styled: Callable[[str | None], Hatching]) -> Callable[[Volume], list[Part]]:
    """Check all texts; what is returned makes the parts of them once the scan is read."""
    from intaglio.parts import ISLANDS, Part, parts_of
    from intaglio.rendering.isovalue import is_label_map

    with as_written():
        hatching = styled(None)
        surfaces = [surface_of(text, styled) for text in subject.surface or ()]
        bodies = [label_of(text, styled) for text in subject.label or ()]
    if subject.labels is not None and not bodies:
        raise BadParameter("needs --label NUMBERS", param_hint="'--labels'")
    if subject.inside is not None and (subject.tf or (bodies and not surfaces)):
        raise BadParameter("is for isovalues, of --iso and --surface", param_hint="'--inside'")
    function = function_of(subject.tf)
    if sum(map(bool, (subject.iso is not None, subject.tf, surfaces or bodies))) > 1:
        raise BadParameter("cannot be given together; --surface alone says it all", param_hint="'--iso', '--tf', '--surface'")
    check_cuts(subject.cut)
    pieces = ISLANDS if subject.islands is None else subject.islands

    def parts(volume: Volume) -> list[Part]:
        tools = tuple(selections_of(subject.cut, volume))
        if function is not None:
            return parts_of(volume, function(volume), style=hatching, islands=pieces, selections=tools)
        if surfaces or bodies:
            common: dict[str, Any] = {"islands": subject.islands, "selections": tools}
            of = volume if subject.labels is None else read_beside(subject.labels, volume)
            if bodies and subject.labels is None and not is_label_map(volume):
                raise InputError(f"{volume.name}: is a scan, not labels; say where --label picks from, with --labels FILE")
            side: Any = subject.inside
            found = [Part(volume=volume, inside=side, **part, **common) for part in surfaces]
            return found + [Part(volume=of, **part | {"label": present(part["label"], of)}, **common) for part in bodies]
        look: dict[str, Any] = {"style": hatching, "islands": subject.islands, "selections": tools}
        return [body_of(volume, subject.iso, subject.inside, "drawing", **look)]

    return parts


def body_of(volume: Volume, iso: float | None, inside: Any, doing: str, **look: Any) -> Part:
    """The surface at an isovalue; without one that of the body, which is said: of all labels, or at `body_surface`."""
    import numpy as np

    from intaglio.parts import Part
    from intaglio.rendering.isovalue import body_surface, is_label_map

    if iso is None and inside is None and is_label_map(volume):
        found = [int(label) for label in np.unique(volume.array) if label]
        say(f"note: {volume.name} holds labels; {doing} all of them as one body, --label picks ({ranges_text(found)})")
        return Part(volume=volume, label=tuple(found), name="labels", **look)
    if iso is None:
        iso, what = body_surface(volume)
        say(f"note: no --iso given; {doing} {iso:g}, {what}")
    return Part(volume=volume, iso=iso, inside=inside, **look)


def ranges_text(labels: Sequence[int]) -> str:
    """1-5,7,9-12, as --label takes them."""
    runs: list[list[int]] = []
    for label in labels:
        if runs and label == runs[-1][-1] + 1:
            runs[-1].append(label)
        else:
            runs.append([label])
    return ",".join(f"{run[0]}-{run[-1]}" if len(run) > 1 else f"{run[0]}" for run in runs)


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
    backwards = next((r[0] for r in ranges if r and r[2] and int(r[2]) < int(r[1])), None)
    if backwards:
        first, last = backwards.split("-")
        raise BadParameter(f"{backwards} runs backwards; it must be {last}-{first}", param_hint="'--label'")
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
