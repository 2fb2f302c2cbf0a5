"""`--cut`: a tool that opens a scan, from its text on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Option

from intaglio.camera import VIEWS, view_direction
from intaglio.cli.console import say
from intaglio.errors import InputError
from intaglio.io.meshes import KINDS

CUT = (
    "Remove a side, counted from the middle: plane:anterior, plane:left,20, plane:1,0,1; "
    "or what a mask FILE covers; or what is inside a mesh, mesh:FILE."
)
Cut = Annotated[list[str] | None, Option("--cut", metavar="TOOL", help=CUT, show_default=False)]
FORMS = "plane:SIDE, plane:SIDE,MM, plane:X,Y,Z, plane:X,Y,Z,MM, mesh:FILE, or a mask or distance volume"
# Voxels along the longest side of a mesh's distance field, which cuts smoothly.
RESOLUTION = 192


def check_cuts(cuts: list[str] | None) -> None:
    """InputError for a cut that cannot be read, before anything else is."""
    for text in cuts or ():
        if text.startswith("plane:"):
            _plane(text)
        elif text.startswith("mesh:"):
            file = Path(text.removeprefix("mesh:"))
            if not file.exists():
                raise InputError(f"--cut {text}: no such file")
            if file.suffix.lower() not in KINDS:
                raise InputError(f"--cut mesh: must name a mesh file, one of {' '.join(KINDS)}, not {str(file)!r}")
        elif Path(text).suffix.lower() in KINDS:
            raise InputError(f"--cut must be mesh:{text} to cut with a mesh, not {text!r}")
        elif not Path(text).exists():
            raise InputError(f"--cut must be {FORMS}, not {text!r}, which is no file")


def selections_of(cuts: list[str] | None, volume: Any) -> list[Any]:
    """Selections in the order they were given; planes count from the middle of the scan, meshes stand in world millimetres."""
    from intaglio.io.meshes import read_mesh
    from intaglio.io.volumes import read_volume
    from intaglio.selection import Selection
    from intaglio.solid.mesh_distance import distance_field

    found = []
    for text in cuts or ():
        if text.startswith("plane:"):
            normal, out = _plane(text)
            found.append(Selection.plane(volume.corners.mean(axis=0) + out * normal, normal))
        elif text.startswith("mesh:"):
            field = distance_field(read_mesh(text.removeprefix("mesh:")), resolution=RESOLUTION)
            for note in field.notes:
                say(f"note: {note}")
            found.append(Selection.of(field))
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
