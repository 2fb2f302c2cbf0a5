"""`intaglio voxelize`."""

from __future__ import annotations

from pathlib import Path

from intaglio.cli.console import running
from intaglio.cli.options import check_written
from intaglio.cli.solids import Like, Mesh, Output, Resolution, Step, read_mesh_and_grid, report

DEFAULT = Path("voxels.nii.gz")


def voxelize(
    mesh: Mesh,
    output: Output = DEFAULT,
    resolution: Resolution = None,
    spacing: Step = None,
    like: Like = None,
) -> None:
    """Turn a mesh into a volume: 1 where a voxel's centre lies inside, 0 elsewhere.

    `intaglio voxelize skull.stl --resolution 512 -o skull.nii.gz`

    `intaglio voxelize tumour.ply --like head.nii.gz -o mask.nrrd`
    """
    from intaglio.io.volume_files import KINDS, write_volume
    from intaglio.solid.scan_conversion import voxelize as voxels_of

    check_written(output, KINDS)
    with running() as steps:
        model, grid = read_mesh_and_grid(steps, mesh, resolution, spacing, like)
        with steps.step("voxels") as progress:
            volume = voxels_of(model, **grid, progress=progress)
        with steps.step("writing") as progress:
            write_volume(volume, output, progress=progress)
    report(output, volume, f"{int(volume.array.sum())} inside", steps)
