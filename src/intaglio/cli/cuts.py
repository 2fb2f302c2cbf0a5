"""`--cut`: a tool that opens a scan, from its text on the command line."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import BadParameter, Option

from intaglio.camera import VIEWS, view_direction
from intaglio.cli.console import say
from intaglio.cli.placing import check_meets, read_beside
from intaglio.errors import InputError
from intaglio.io.meshes import KINDS

CUT = (
    "Remove a side, counted from the middle: plane:anterior, plane:left,20, plane:1,0,1; "
    "or what a mask FILE covers; or what is inside a mesh, mesh:FILE."
)
Cut = Annotated[list[str] | None, Option("--cut", metavar="TOOL", help=CUT, show_default=False)]
FORMS = "plane:SIDE, plane:SIDE,MM, plane:X,Y,Z, plane:X,Y,Z,MM, mesh:FILE, or a mask or distance volume"
HINT = "'--cut'"
# Voxels along the longest side of a mesh's distance field, which cuts smoothly.
RESOLUTION = 192


def check_cuts(cuts: list[str] | None) -> None:
    """BadParameter for a cut that is none, InputError for a file that is missing, before anything is read."""
    for text in cuts or ():
        if text.startswith("plane:"):
            _plane(text)
        elif text.startswith("mesh:"):
            file = Path(text.removeprefix("mesh:"))
            if not file.exists():
                raise InputError(f"--cut {text}: no such file")
            if file.suffix.lower() not in KINDS:
                raise BadParameter(f"mesh: must name a mesh file, one of {' '.join(KINDS)}, not {str(file)!r}", param_hint=HINT)
        elif Path(text).suffix.lower() in KINDS:
            raise BadParameter(f"must be mesh:{text} to cut with a mesh, not {text!r}", param_hint=HINT)
        elif not Path(text).exists() and not Path(text).suffix:
            raise BadParameter(f"must be {FORMS}, not {text!r}, which is no file", param_hint=HINT)
        elif not Path(text).exists():
            raise InputError(f"--cut {text}: no such file; a tool is {FORMS}")


def selections_of(cuts: list[str] | None, volume: Any) -> list[Any]:
    """Selections in the order they were given; planes count from the middle of the scan, meshes stand in world millimetres."""
    from intaglio.io.meshes import read_mesh
    from intaglio.selection import Selection
    from intaglio.solid.mesh_distance import distance_field

    found = []
    for text in cuts or ():
        if text.startswith("plane:"):
            normal, out = _plane(text)
            found.append(Selection.plane(volume.corners.mean(axis=0) + out * normal, normal))
            ends = (volume.corners - volume.corners.mean(axis=0)) @ normal - out
            if ends.max() <= 0 or ends.min() >= 0:
                part = "nothing" if ends.max() <= 0 else "everything"
                say(f"note: --cut {text} removes {part}: the scan ends {ends.max() + out:.0f} mm from its middle")
        elif text.startswith("mesh:"):
            mesh = read_mesh(text.removeprefix("mesh:"))
            check_meets(mesh.name, mesh.corners, volume)
            field = distance_field(mesh, resolution=RESOLUTION)
            for note in field.notes:
                say(f"note: {note}")
            found.append(Selection.of(field))
        else:
            found.append(Selection.of(read_beside(Path(text), volume)))
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
        raise BadParameter(f"must be {FORMS}, not {text!r}", param_hint=HINT)
    return view_direction(numbers[:3]), numbers[3] if len(numbers) == 4 else 0.0
