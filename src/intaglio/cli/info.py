"""`intaglio info`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from intaglio.cli.console import Steps, out, running, say
from intaglio.cli.options import (
    Reading,
    read,
    with_groups,
)
from intaglio.errors import InputError


@with_groups
def info(
    path: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A scan, or a mesh: STL, PLY, OBJ, OFF, glTF.", show_default=False, readable=False),
    ],
    *,
    reading: Reading,
) -> None:
    """Say what is in a scan or a mesh: size, spacing, values, orientation; whether a surface is closed.

    `intaglio info head.nii.gz`

    `intaglio info dicom-folder --series 2`

    `intaglio info bone.stl`
    """
    from intaglio.io.meshes import KINDS
    from intaglio.rendering.isovalue import body_surface

    with running() as steps:
        if path.suffix.lower() in KINDS and reading.raw is None:
            if reading != Reading():
                raise InputError(f"{path.name}: is a mesh; --spacing, --fill, --series and --index are for scans")
            _mesh_info(steps, path)
            return
        volume = read(steps, path, reading)
    z, y, x = volume.shape
    low, high = volume.range
    corners = volume.corners
    rows = {
        "voxels": f"{x} x {y} x {z} (x, y, z), {volume.array.dtype}, {volume.array.nbytes / 2**20:.1f} MiB",
        "spacing": " x ".join(f"{s:g}" for s in volume.spacing) + " mm",
        "axes": "x to the {}, y {}, z {}".format(*_axes(volume)),
        "extent": ", ".join(
            f"{name} {a:.1f} to {b:.1f}"
            for name, a, b in zip(("right", "anterior", "superior"), corners.min(axis=0), corners.max(axis=0), strict=True)
        )
        + " mm",
        "values": f"{low:g} to {high:g}",
    }
    if low < high:
        iso, what = body_surface(volume)
        rows["surface"] = f"{iso:g}, {what} (what `hatch` draws without --iso)"
    _table(path.name, rows)


def _axes(volume: Any) -> list[str]:
    names = (("left", "right"), ("posterior", "anterior"), ("inferior", "superior"))
    columns = volume.world_from_index[:3, :3].T
    strongest = [int(abs(c).argmax()) for c in columns]
    return [names[k][int(c[k] > 0)] for k, c in zip(strongest, columns, strict=True)]


def _mesh_info(steps: Steps, path: Path) -> None:
    from intaglio.io.meshes import read_mesh

    with steps.step("reading") as progress:
        mesh = read_mesh(path, progress)
        report = mesh.report
    for text in mesh.notes:
        if text not in report.caveats:
            say(f"note: {text}")
    low, high = mesh.corners.min(axis=0), mesh.corners.max(axis=0)
    rows = {
        "triangles": f"{len(mesh.triangles)}, {len(mesh.vertices)} vertices, components: {report.components}",
        "extent": " x ".join(f"{s:.4g}" for s in high - low) + " mm (meshes store no unit: mm assumed)",
        "surface": "closed, manifold, oriented" if not report.caveats else "; ".join(report.caveats),
    }
    _table(path.name, rows)


def _table(title: str, rows: dict[str, str]) -> None:
    out.print(title, style="bold", markup=False)
    for name, text in rows.items():
        out.print(f"  {name:<10}{text}", markup=False)
