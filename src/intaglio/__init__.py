"""From scan to plate: illustrative volume visualization."""

from __future__ import annotations

import importlib
from typing import TYPE_CHECKING, Any

__version__ = "0.1.0"

if TYPE_CHECKING:
    from intaglio.animation import turntable as turntable
    from intaglio.camera import Camera as Camera
    from intaglio.drawing import Drawing as Drawing, Image as Image
    from intaglio.errors import InputError as InputError
    from intaglio.gbuffer import GBuffer as GBuffer
    from intaglio.ink.hand import Hand as Hand
    from intaglio.ink.styles import Hatching as Hatching, style as style, styles as styles
    from intaglio.io.meshes import read_mesh as read_mesh
    from intaglio.io.volume_files import write_volume as write_volume
    from intaglio.io.volumes import read_volume as read_volume
    from intaglio.lighting import Light as Light, Material as Material
    from intaglio.mesh import TriangleMesh as TriangleMesh
    from intaglio.parts import Part as Part, parts_of as parts_of
    from intaglio.plate import (
        contour as contour,
        draw as draw,
        draw_lines as draw_lines,
        hatch as hatch,
        illustrate as illustrate,
        parts_camera as parts_camera,
        surface_camera as surface_camera,
    )
    from intaglio.rendering.isosurface import isosurface as isosurface
    from intaglio.rendering.isovalue import body_surface as body_surface
    from intaglio.rendering.progressive import refinements as refinements
    from intaglio.rendering.raycast import render as render
    from intaglio.rendering.shade import shade as shade
    from intaglio.selection import Selection as Selection
    from intaglio.solid.bricks import sparse_field as sparse_field
    from intaglio.solid.csg import difference as difference, intersection as intersection, union as union
    from intaglio.solid.edt import signed_distance as signed_distance
    from intaglio.solid.labels import label_distance as label_distance
    from intaglio.solid.medial import medial_axis as medial_axis
    from intaglio.solid.mesh_distance import distance_field as distance_field
    from intaglio.solid.morph import morph as morph
    from intaglio.solid.offset import offset as offset, shell as shell
    from intaglio.solid.penetration import penetration_depth as penetration_depth
    from intaglio.solid.redistance import redistance as redistance
    from intaglio.solid.scan_conversion import voxelize as voxelize
    from intaglio.solid.sparse import SparseField as SparseField
    from intaglio.solid.surface import surface as surface
    from intaglio.transfer_function import TransferFunction as TransferFunction
    from intaglio.transfer_function_2d import TransferFunction2D as TransferFunction2D
    from intaglio.volume import Volume as Volume

# Public name -> module. Loaded on first use, so that `import intaglio` is quick.
_PUBLIC = {
    "Camera": "camera",
    "Drawing": "drawing",
    "GBuffer": "gbuffer",
    "Hand": "ink.hand",
    "Hatching": "ink.styles",
    "Image": "drawing",
    "InputError": "errors",
    "Light": "lighting",
    "Material": "lighting",
    "Part": "parts",
    "Selection": "selection",
    "SparseField": "solid.sparse",
    "TransferFunction": "transfer_function",
    "TransferFunction2D": "transfer_function_2d",
    "TriangleMesh": "mesh",
    "Volume": "volume",
    "body_surface": "rendering.isovalue",
    "contour": "plate",
    "difference": "solid.csg",
    "distance_field": "solid.mesh_distance",
    "draw": "plate",
    "draw_lines": "plate",
    "hatch": "plate",
    "illustrate": "plate",
    "intersection": "solid.csg",
    "isosurface": "rendering.isosurface",
    "label_distance": "solid.labels",
    "medial_axis": "solid.medial",
    "morph": "solid.morph",
    "offset": "solid.offset",
    "parts_camera": "plate",
    "parts_of": "parts",
    "penetration_depth": "solid.penetration",
    "read_mesh": "io.meshes",
    "read_volume": "io.volumes",
    "redistance": "solid.redistance",
    "refinements": "rendering.progressive",
    "render": "rendering.raycast",
    "shade": "rendering.shade",
    "shell": "solid.offset",
    "signed_distance": "solid.edt",
    "sparse_field": "solid.bricks",
    "style": "ink.styles",
    "styles": "ink.styles",
    "surface": "solid.surface",
    "surface_camera": "plate",
    "turntable": "animation",
    "union": "solid.csg",
    "voxelize": "solid.scan_conversion",
    "write_volume": "io.volume_files",
}

__all__ = sorted(_PUBLIC)  # noqa: PLE0605


def __getattr__(name: str) -> Any:
    if name not in _PUBLIC:
        raise AttributeError(f"module 'intaglio' has no attribute {name!r}")
    value = getattr(importlib.import_module(f"intaglio.{_PUBLIC[name]}"), name)
    globals()[name] = value
    return value


def __dir__() -> list[str]:
    return sorted([*globals(), *_PUBLIC])
