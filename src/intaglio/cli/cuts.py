"""`--cut`: a tool that opens a scan, from its text on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from intaglio.camera import VIEWS, view_direction
from intaglio.errors import InputError

CUT = "Remove a side, counted from the middle: plane:anterior, plane:left,20, plane:1,0,1; or what a mask FILE covers."
Cut = Annotated[list[str] | None, Option("--cut", metavar="TOOL", help=CUT, show_default=False)]
FORMS = "plane:SIDE, plane:SIDE,MM, plane:X,Y,Z, plane:X,Y,Z,MM, or a mask or distance volume"


def check_cuts(cuts: list[str] | None) -> None:
    """InputError for a cut that cannot be read, before anything else is."""
    for text in cuts or ():
        if text.startswith("plane:"):
            _plane(text)
        elif not Path(text).exists():
            raise InputError(f"--cut must be {FORMS}, not {text!r}")


def selections_of(cuts: list[str] | None, volume: Any) -> list[Any]:
    """Selections in the order they were given; planes count from the middle of the scan."""
    from intaglio.io.volumes import read_volume
    from intaglio.selection import Selection

    found = []
    for text in cuts or ():
        if text.startswith("plane:"):
            normal, out = _plane(text)
            found.append(Selection.plane(volume.corners.mean(axis=0) + out * normal, normal))
        else:
            found.append(Selection.of(read_volume(text)))
    return found


def _plane(text: str) -> tuple[Any, float]:
    parts = [part.strip() for part in text.removeprefix("plane:").split(",")]
    try:
        if parts[0].split("-")[0] in VIEWS and len(parts) <= 2:
            return view_direction(parts[0]), float(parts[1]) if len(parts) == 2 else 0.0
        numbers = [float(part) for part in parts]
    except ValueError:
        numbers = []
    if len(numbers) not in (3, 4):
        raise InputError(f"--cut must be {FORMS}, not {text!r}")
    return view_direction(numbers[:3]), numbers[3] if len(numbers) == 4 else 0.0
