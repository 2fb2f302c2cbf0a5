"""`intaglio surface`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.console import out, running, say
from intaglio.cli.options import (
    Inside,
    Reading,
    Scan,
    check_written,
    number,
    read,
)
from intaglio.cli.parameters import with_groups

DEFAULT = Path("surface.stl")


@with_groups
def surface(
    scan: Scan,
    output: Annotated[
        Path, Option("--output", "-o", metavar="FILE", help="Mesh to write: .stl, .ply, .obj or .glb.", readable=False)
    ] = DEFAULT,
    iso: Annotated[float | None, number("--iso", "Isovalue; without it, that of the body", show_default=False)] = None,
    label: Annotated[int | None, number("--label", "Voxels of this value, of a label map", kind=int, show_default=False)] = None,
    inside: Inside = None,
    open_: Annotated[bool, Option("--open", help="Leave the mesh open where the body leaves the scan.")] = False,
    *,
    reading: Reading,
) -> None:
    """Make a mesh of the surface of a body in a scan: closed, manifold, facing outwards.

    `intaglio surface ct.nii.gz --iso 300 -o bone.stl`

    `intaglio surface labels.nii.gz --label 5 -o liver.ply`

    `intaglio surface distance.nii.gz -o solid.glb`
    """
    from intaglio.io.mesh_files import SAVED
    from intaglio.rendering.isovalue import body_surface, is_label_map
    from intaglio.solid.edt import signed_distance
    from intaglio.solid.surface import surface as surface_of

    check_written(output, SAVED)
    if iso is not None and label is not None:
        raise BadParameter("cannot be given together with --iso", param_hint="'--label'")
    if inside is not None and label is not None:
        raise BadParameter("is for isovalues, not for --label", param_hint="'--inside'")
    side: Any = inside
    with running() as steps:
        volume = read(steps, scan, reading)
        level = iso
        if label is not None or (iso is None and inside is None and is_label_map(volume)):
            if label is None:
                say(f"note: {volume.name} holds labels; taking all of them as one body, --label picks one")
            with steps.step("measuring") as progress:
                volume = signed_distance(volume, label, progress=progress)
            level, side = 0.0, "below"
        elif iso is None:
            level, what = body_surface(volume)
            say(f"note: no --iso given; taking {level:g}, {what}")
        with steps.step("extracting") as progress:
            mesh = surface_of(volume, level, inside=side, cap=not open_, progress=progress)
        with steps.step("writing"):
            mesh.save(output)
    out.print(f"{output}  {len(mesh.triangles)} triangles, {len(mesh.vertices)} vertices, {steps.summary()}", markup=False)
