"""`intaglio info`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

import typer

from intaglio.cli.console import Steps, out, running, say
from intaglio.cli.options import Reading, read
from intaglio.cli.parameters import with_groups
from intaglio.cli.surfaces import ranges_text

# How many of the largest labels are listed with their sizes.
LARGEST = 8


@with_groups
def info(
    path: Annotated[
        Path,
        typer.Argument(metavar="FILE", help="A scan, or a mesh: STL, PLY, OBJ, OFF, glTF.", show_default=False, readable=False),
    ],
    *,
    reading: Reading,
) -> None:
    """Say what is in a scan or a mesh: size, spacing, values, orientation; labels; whether a surface is closed.

    `intaglio info head.nii.gz`

    `intaglio info dicom-folder --series 2`

    `intaglio info slices --axes LPI`

    `intaglio info bone.stl`
    """
    from intaglio.io.geometry import is_placed
    from intaglio.io.meshes import KINDS

    with running() as steps:
        if path.suffix.lower() in KINDS and reading.raw is None:
            if reading != Reading():
                raise typer.BadParameter("are for scans, and this is a mesh", param_hint="'--spacing', '--axes', '--fill'")
            _mesh_info(steps, path)
            return
        volume = read(steps, path, reading)
    z, y, x = volume.shape
    low, high = volume.range
    corners = volume.corners
    rows = {
        "voxels": f"{x} x {y} x {z} (x, y, z), {volume.array.dtype}, {volume.array.nbytes / 2**20:.1f} MiB",
        "spacing": " x ".join(f"{s:g}" for s in volume.spacing) + " mm",
        "axes": "x to the {}, y {}, z {}".format(*_axes(volume))
        + ("" if is_placed(volume.notes) else ", assumed; say otherwise with --axes"),
        "extent": ", ".join(
            f"{name} {a:.1f} to {b:.1f}"
            for name, a, b in zip(("right", "anterior", "superior"), corners.min(axis=0), corners.max(axis=0), strict=True)
        )
        + " mm",
        "values": f"{low:g} to {high:g}",
    }
    _table(path.name, rows | _body_rows(volume, path.name))


def _body_rows(volume: Any, name: str) -> dict[str, str]:
    """What can be drawn of it, and how."""
    import numpy as np

    from intaglio.rendering.isovalue import body_surface, is_label_map

    low, high = volume.range
    if low == high:
        return {}
    if volume.distances:
        draw = f"`intaglio hatch {name}` draws it, `intaglio surface {name}` makes a mesh"
        return {"holds": "signed distances in mm, inside negative: a solid", "surface": f"0; {draw}"}
    if not is_label_map(volume):
        iso, what = body_surface(volume)
        return {"surface": f"{iso:g}, {what} (what `hatch` draws without --iso)"}
    labels, counts = np.unique(volume.array, return_counts=True)
    labels, counts = labels[labels != 0].astype(int), counts[labels != 0]
    largest = np.argsort(-counts, kind="stable")[:LARGEST]
    ml = counts * abs(np.linalg.det(volume.world_from_index[:3, :3])) / 1000
    return {
        "labels": f"{len(labels)}: {ranges_text(labels.tolist())}",
        "largest": ", ".join(f"{labels[k]} ({ml[k]:{'.0f' if ml[k] >= 10 else '.2g'}} ml)" for k in largest),
        "surface": f"of each label; `intaglio hatch {name} --label {labels[largest[0]]}` draws one",
    }


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
