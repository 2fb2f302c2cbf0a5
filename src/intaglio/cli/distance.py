"""`intaglio distance`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated

from typer import Option

from intaglio.cli.console import running
from intaglio.cli.options import check_written
from intaglio.cli.solids import Like, Mesh, Output, Resolution, Step, read_mesh_and_grid, report

DEFAULT = Path("distance.nii.gz")
BAND = "How far from the surface: a part of the mesh's extent such as 0.05, mm such as 5mm, or full."


def distance(
    mesh: Mesh,
    output: Output = DEFAULT,
    band: Annotated[str, Option("--band", metavar="WIDTH", help=BAND)] = "0.05",
    resolution: Resolution = None,
    spacing: Step = None,
    like: Like = None,
) -> None:
    """Turn a mesh into its signed distance field: mm from the surface, negative inside.

    `intaglio distance skull.stl --band full -o skull.nii.gz`

    `intaglio distance liver.obj --like abdomen.nii.gz --band 20mm -o liver.nrrd`
    """
    from intaglio.io.volume_files import KINDS, write_volume
    from intaglio.solid.mesh_distance import distance_field

    check_written(output, KINDS)
    with running() as steps:
        model, grid = read_mesh_and_grid(steps, mesh, resolution, spacing, like)
        with steps.step("distances") as progress:
            volume = distance_field(model, **grid, band=band, progress=progress)
        with steps.step("writing") as progress:
            write_volume(volume, output, progress=progress)
    low, high = volume.range
    report(output, volume, f"{low:.4g} to {high:.4g} mm", steps)
