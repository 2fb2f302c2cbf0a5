"""`intaglio combine`."""

from __future__ import annotations

from pathlib import Path
from typing import TYPE_CHECKING, Annotated, Any

from typer import Argument, BadParameter, Option

from intaglio.cli.console import Steps, out, running, say
from intaglio.cli.options import Reading, check_written, number, read
from intaglio.errors import InputError

if TYPE_CHECKING:
    from intaglio.volume import Volume

HOW = "union, intersection, difference"
SOLIDS = "Distance fields (floats, negative inside), masks, labels, or meshes; of a difference the first is what the others cut."
DEFAULT = Path("solid.nii.gz")


def combine(
    how: Annotated[str, Argument(metavar="HOW", help=f"One of {HOW}.", show_default=False)],
    solids: Annotated[list[Path], Argument(metavar="SOLID", help=SOLIDS, show_default=False, readable=False)],
    output: Annotated[
        Path,
        Option("--output", "-o", metavar="FILE", help="Field to write: .nii, .nii.gz, .nrrd or .mha.", readable=False),
    ] = DEFAULT,
    smooth: Annotated[float, number("--smooth", "Round the seams over this length", 0, unit="MM")] = 0.0,
    exact: Annotated[bool, Option("--redistance", help="Make the result a distance field again.")] = False,
) -> None:
    """Combine solids on any grids in any pose; the result is a signed distance in mm on the first one's grid.

    `intaglio combine union a.nii.gz b.nii.gz -o both.nii.gz`

    `intaglio combine difference bone.nii.gz screw.stl -o drilled.nii.gz`
    """
    from intaglio.io.volume_files import KINDS, write_volume
    from intaglio.solid import csg
    from intaglio.solid.redistance import redistance

    combined: Any = {"union": csg.union, "intersection": csg.intersection, "difference": csg.difference}.get(how)
    if combined is None:
        raise BadParameter(f"must be one of {HOW}, not {how!r}", param_hint="'HOW'")
    check_written(output, KINDS)
    if any(path.exists() and output.exists() and path.samefile(output) for path in solids):
        raise BadParameter(f"must be a file of its own, not {output.name!r}, which is one of the solids", param_hint="'--output'")
    with running() as steps:
        fields: list[Volume] = []
        for path in solids:
            fields.append(_field(steps, path, fields[0] if fields else None))
        with steps.step("combining") as progress:
            result = combined(*fields, smooth=smooth, progress=progress)
        if result.range[0] >= 0:
            say("note: nothing is left; the solid is empty")
        if exact and result.range[0] < 0:
            with steps.step("redistancing") as progress:
                result = redistance(result, progress=progress)
        with steps.step("writing"):
            write_volume(result, output)
    z, y, x = result.shape
    out.print(f"{output}  {x} x {y} x {z} voxels, {steps.summary()}", markup=False)


def _field(steps: Steps, path: Path, first: Volume | None) -> Volume:
    """A distance field as it is, of a mask all that is set, of a mesh at the first solid's spacing."""
    from intaglio.io.meshes import KINDS, read_mesh
    from intaglio.solid.edt import signed_distance
    from intaglio.solid.mesh_distance import distance_field

    if path.suffix.lower() in KINDS:
        with steps.step("reading") as progress:
            mesh = read_mesh(path, progress)
        size: Any = {"resolution": 256} if first is None else {"spacing": float(first.spacing.min())}
        with steps.step("measuring") as progress:
            return distance_field(mesh, band="full", progress=progress, **size)
    volume = read(steps, path, Reading())
    if volume.array.dtype.kind == "f":
        if volume.range[0] >= 0:
            raise InputError(
                f"{path.name}: a solid of floats must be a signed distance, negative inside, not {volume.range[0]:g} to "
                f"{volume.range[1]:g}; `intaglio surface {path.name} --iso VALUE -o solid.stl` makes a solid of a scan"
            )
        if not volume.distances:
            say(f"note: {path.name}: its values do not change by 1 per mm; taking what is negative as the solid")
        return volume
    say(f"note: {path.name}: holds {volume.array.dtype}; taking all voxels that are not 0 as the solid")
    with steps.step("measuring") as progress:
        return signed_distance(volume, progress=progress)
