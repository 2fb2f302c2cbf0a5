"""What the commands that turn a mesh into a volume share."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import Argument, BadParameter, Option

from intaglio.cli.console import Steps, out, say
from intaglio.cli.options import number
from intaglio.errors import InputError

RESOLUTION = 256
GRID: Any = {"rich_help_panel": "Grid"}

Mesh = Annotated[
    Path, Argument(metavar="MESH", help="STL, PLY, OBJ, OFF, glTF or glb file, mm.", show_default=False, readable=False)
]
Resolution = Annotated[
    int | None,
    number("--resolution", "Voxels along the longest side", 4, 4096, kind=int, show_default=str(RESOLUTION), **GRID),
]
Step = Annotated[float | None, number("--spacing", "Or the distance of voxels", 0, unit="MM", **GRID)]
Like = Annotated[
    Path | None, Option("--like", metavar="SCAN", help="Or the voxels of this scan.", show_default=False, readable=False, **GRID)
]


Output = Annotated[
    Path, Option("--output", "-o", metavar="FILE", help="Volume to write: .nii, .nii.gz, .nrrd or .mha.", readable=False)
]


def read_mesh_and_grid(
    steps: Steps, mesh: Path, resolution: int | None, spacing: float | None, like: Path | None
) -> tuple[Any, dict[str, Any]]:
    """The mesh, with the reader's notes said, and the one of resolution=, spacing= and like= that was given."""
    from intaglio.io.meshes import KINDS, read_mesh
    from intaglio.io.volumes import read_volume

    given = [name for name, value in (("resolution", resolution), ("spacing", spacing), ("like", like)) if value is not None]
    if len(given) > 1:
        raise BadParameter(f"only one of --{' and --'.join(given)} can be given", param_hint=f"'--{given[1]}'")
    if mesh.suffix.lower() not in KINDS:
        raise InputError(f"{mesh.name}: must be a mesh, one of {' '.join(KINDS)}; `intaglio info` tells about scans")
    with steps.step("reading") as progress:
        model = read_mesh(mesh, progress=progress)
        grid = (
            {"like": read_volume(like)}
            if like
            else {"spacing": spacing}
            if spacing is not None
            else {"resolution": resolution or RESOLUTION}
        )
    for text in model.notes:
        say(f"note: {text}")
    return model, grid


def report(path: Path, volume: Any, what: str, steps: Steps) -> None:
    """One line about the volume that was written, after what had to be assumed."""
    for text in volume.notes:
        say(f"note: {text}")
    z, y, x = volume.shape
    step = " x ".join(f"{s:.3g}" for s in volume.spacing)
    out.print(f"{path}  {x} x {y} x {z} voxels of {step} mm, {what}, {steps.summary()}", markup=False)
