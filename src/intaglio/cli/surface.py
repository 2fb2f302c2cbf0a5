"""`intaglio surface`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.console import out, running, say
from intaglio.cli.options import Inside, Reading, Scan, check_written, number, read
from intaglio.cli.parameters import with_groups
from intaglio.cli.surfaces import label_ranges, present

DEFAULT = Path("surface.stl")


@with_groups
def surface(
    scan: Scan,
    output: Annotated[
        Path, Option("--output", "-o", metavar="FILE", help="Mesh to write: .stl, .ply, .obj or .glb.", readable=False)
    ] = DEFAULT,
    iso: Annotated[float | None, number("--iso", "Isovalue; without it, that of the body", show_default=False)] = None,
    label: Annotated[
        str | None, Option("--label", metavar="NUMBERS", help="Voxels of these values: 5, 2,3 or 26-33.", show_default=False)
    ] = None,
    smooth: Annotated[bool, Option("--smooth/--no-smooth", help="Labels without the steps of their voxels.")] = True,
    inside: Inside = None,
    open_: Annotated[bool, Option("--open", help="Leave the mesh open where the body leaves the scan.")] = False,
    *,
    reading: Reading,
) -> None:
    """Make a mesh of the surface of a body in a scan: closed, manifold, facing outwards; of labels a smooth one.

    `intaglio surface ct.nii.gz --iso 300 -o bone.stl`

    `intaglio surface labels.nii.gz --label 5 -o liver.ply`

    `intaglio surface distance.nii.gz -o solid.glb`
    """
    from intaglio.io.mesh_files import SAVED
    from intaglio.rendering.isovalue import body_surface, is_label_map
    from intaglio.solid.surface import surface as surface_of

    check_written(output, SAVED)
    if iso is not None and label is not None:
        raise BadParameter("cannot be given together with --iso", param_hint="'--label'")
    if inside is not None and label is not None:
        raise BadParameter("is for isovalues, not for --label", param_hint="'--inside'")
    ranges = label_ranges(label) if label is not None else []
    with running() as steps:
        volume = read(steps, scan, reading)
        if not ranges and iso is None and inside is None and is_label_map(volume):
            say(f"note: {volume.name} holds labels; taking all of them as one body, --label picks one")
            ranges = [range(1, int(volume.array.max()) + 1)]
        body: dict[str, Any] = {"iso": iso, "inside": inside}
        if ranges:
            body = {"label": present(ranges, volume), "smooth": smooth}
        elif iso is None:
            body["iso"], what = body_surface(volume)
            say(f"note: no --iso given; taking {body['iso']:g}, {what}")
        with steps.step("extracting") as progress:
            mesh = surface_of(volume, **body, cap=not open_, progress=progress)
        with steps.step("writing"):
            mesh.save(output)
    out.print(f"{output}  {len(mesh.triangles)} triangles, {len(mesh.vertices)} vertices, {steps.summary()}", markup=False)
