"""Direct volume rendering: what the transfer function, or a projection, makes of a volume."""

from __future__ import annotations

import math
from collections.abc import Sequence
from typing import Any, Literal

import numpy as np
from numpy.typing import NDArray

from intaglio.camera import Camera
from intaglio.compute import Progress, frozen, tiles
from intaglio.drawing import Image
from intaglio.errors import InputError
from intaglio.lighting import DEFAULT_LIGHTS, Light, Material, packed_lights
from intaglio.rendering.culling import tile_depths
from intaglio.rendering.cutting import cut_blocks
from intaglio.rendering.emission import BOUNDARIES, POST, PRE, PREINTEGRATED, integrate
from intaglio.rendering.ghost import ghosts
from intaglio.rendering.packets import CELL, CENTRAL, SPLINE, flat
from intaglio.rendering.pieces import shown_pieces, surface_pieces
from intaglio.rendering.projection import projection
from intaglio.rendering.skipping import check_islands, min_max_blocks
from intaglio.rendering.translucent import trace_surfaces
from intaglio.selection import Selection, packed_selections
from intaglio.transfer_function import TransferFunction
from intaglio.transfer_function_2d import TransferFunction2D
from intaglio.volume import Volume, check_volume

Classify = Literal["pre", "post", "preintegrated"]
Mode = Literal["emission-absorption", "mip", "minip", "average", "isosurface"]
MODES: tuple[Mode, ...] = ("emission-absorption", "mip", "minip", "average", "isosurface")
CLASSIFY: dict[Classify, int] = {"pre": PRE, "post": POST, "preintegrated": PREINTEGRATED}
Interpolation = Literal["trilinear", "tricubic"]
Gradient = Literal["central", "cell", "tricubic"]
INTERPOLATION: tuple[Interpolation, ...] = ("trilinear", "tricubic")
GRADIENT: dict[Gradient, int] = {"central": CENTRAL, "cell": CELL, "tricubic": SPLINE}
Surface = tuple[float, tuple[float, float, float], float]
# A transfer function no opaquer than this over half a voxel makes fog, for whose light the slopes of single cells will do.
FOG = 0.04
# Entries of a transfer function's table, and along each side of a pre-integrated one.
TABLE = 4096
TABLE_2D = 256


def render(
    volume: Volume,
    transfer_function: TransferFunction | TransferFunction2D | None,
    camera: Camera,
    *,
    mode: Mode = "emission-absorption",
    classify: Classify = "post",
    surfaces: Sequence[Surface] = (),
    step: float = 0.5,
    interpolation: Interpolation = "trilinear",
    gradient: Gradient | None = None,
    reach: float = 1.0,
    lit: bool = True,
    lights: Sequence[Light] = DEFAULT_LIGHTS,
    material: Material | None = None,
    fade: float | None = None,
    islands: float = 0.0,
    selections: Sequence[Selection] = (),
    ghost: float = 0.0,
    background: tuple[float, float, float, float] = (1.0, 1.0, 1.0, 1.0),
    progress: Progress | None = None,
) -> Image:
    """A picture of the volume, integrated along its rays in float32.

    transfer_function  colours, by value or by value and slope; None for isosurfaces, and for a projection in greys
    mode        "emission-absorption"; "mip", "minip" or "average": the largest, smallest or mean value of each ray,
                coloured by the transfer function; "isosurface": the `surfaces`, semi-transparent
    classify    "post": interpolate values, then look up; "pre": look up voxels, then interpolate colours;
                "preintegrated": a table over the values at both ends of each step (Engel et al. 2001)
    surfaces    (isovalue, (red, green, blue), opacity) of each isosurface
    step        distance of samples, in the smallest voxel spacing; exact for a constant medium, the last sample
                standing for what is left of the ray
    interpolation  of values; "tricubic" smooths: the B-spline, many times slower
    gradient    for light and slopes: "central" differences, `reach` voxels to either side (1 is what differences taken at the
                voxels beforehand, and interpolated, would give); "cell", the slope of the trilinear field itself, which jumps
                from cell to cell; "tricubic", the B-spline's. Default: central, but cell for fog, and tricubic with such values
    lit         Blinn-Phong light of each sample's gradient; unlit, the transfer function's colour is emitted as it is
    fade        slope, in values per mm, below which a sample has no normal; default 2 % of the range per smallest spacing
    islands     pieces that show less than this part of what the largest one shows are left out, such as a board that is
                seen as a veil; not in projections
    selections  tools that cut the volume open; cut faces are lit with the tools' normals
    ghost       opacity of the rim of tools, shown as glass; 0 for not at all
    background  straight RGBA behind the volume
    Blocks in which nothing is visible are skipped; rays end when opaque. InputError for what cannot be rendered.
    """
    check_volume(volume)
    low, high = _checked(volume, transfer_function, mode, classify, surfaces, step, fade, background)
    _check_sampling(transfer_function, mode, classify, interpolation, gradient, reach, ghost)
    check_islands(islands)
    if islands and mode in ("mip", "minip", "average"):
        raise InputError(f"islands can be left out only of what is shown in parts, not in mode {mode!r}")
    material = material or Material()
    if mode in ("mip", "minip", "average"):
        assert not isinstance(transfer_function, TransferFunction2D)
        value = projection(volume, camera, mode, step=step, selections=selections, progress=progress)
        return Image(_over(_coloured(value, transfer_function, low, high), background))

    world_rays = camera.rays()
    index_rays = world_rays @ volume.index_from_world[:3, :3].T
    index_rays[0] += volume.index_from_world[:3, 3]
    z, y, x = volume.shape
    w, h = camera.size
    out = np.zeros((h, w, 4), dtype=np.float32)
    block_low, block_high = min_max_blocks(volume)
    grid = np.array([x, x * y, x - 1, y - 1, z - 1], dtype=np.float64)
    field: tuple[Any, ...] = (flat(volume), grid, volume.shape)
    heads, data = packed_selections(selections, volume)
    rays = (index_rays, world_rays, volume.index_from_world[:3, :3].copy())
    shading = np.array([material.ambient, material.diffuse, material.specular, material.shininess, material.two_sided])
    lamps = packed_lights(lights, camera)
    shine = (np.linspace(0.0, 1.0, 1024) ** material.shininess).astype(np.float32)

    if mode == "isosurface":
        levels = np.array([s[0] for s in surfaces], dtype=np.float32)
        colours = np.array([(*s[1], s[2]) for s in surfaces], dtype=np.float32)
        visible = np.any([(block_low < v) & (block_high >= v) for v in levels], axis=0)
        visible = surface_pieces(volume, levels, visible, islands)
        tiles(
            trace_surfaces, (h, w), *field, frozen(visible), heads, data, *rays, levels, colours, lit, lamps, shading, shine,
            out, progress=progress,
        )  # fmt: skip
        return Image(_over(out, background))

    assert transfer_function is not None
    spacing = float(volume.spacing.min())
    mm = step * spacing
    columns, steep, when = 1, 0.0, CLASSIFY[classify]
    if isinstance(transfer_function, TransferFunction2D):
        table = transfer_function.table(mm)
        rows, columns = table.shape[:2]
        low, high = transfer_function.low, transfer_function.high
        steep, when = (columns - 1) / transfer_function.steepest, BOUNDARIES
        scale = (rows - 1) / (high - low)
        fog = False
    elif classify == "preintegrated":
        from intaglio.rendering.preintegration import preintegrated_table

        table = preintegrated_table(transfer_function, low, high, size=TABLE_2D, step=mm)
        columns, scale = TABLE_2D, (TABLE_2D - 1) / (high - low)
    else:
        table = transfer_function.table(low, high, TABLE, step=mm)
        scale = (TABLE - 1) / (high - low)
    if isinstance(transfer_function, TransferFunction):
        fog = bool(transfer_function.table(low, high, TABLE, step=0.5 * spacing)[:, 3].max() <= FOG)
    if gradient is None:
        gradient = "tricubic" if interpolation == "tricubic" else "cell" if fog else "central"
    if gradient == "central" and min(volume.shape) < 4:
        gradient = "cell"
    visible = shown_pieces(volume, transfer_function, transfer_function.visible(block_low, block_high), islands) & (
        cut_blocks(volume, np.ones_like(block_low, np.uint8), heads) > 0
    )
    fade = 0.02 * (high - low) / spacing if fade is None else fade
    paper = np.array(background, dtype=np.float32)
    out[:] = paper
    veil = ghosts(selections, camera, ghost, lights) if ghost and selections else np.zeros((0, 0, 5), dtype=np.float32)
    depths = tile_depths(volume, visible, camera)
    tiles(
        integrate, (h, w), *field, frozen(visible), heads, data, *rays, frozen(table).reshape(-1), low, scale, columns,
        steep, when, interpolation == "tricubic", GRADIENT[gradient], float(reach), lit, float(fade), lamps, shading, shine, mm,
        *depths, veil, paper, out, tile=64, progress=progress,
    )  # fmt: skip
    return Image(out)


def _checked(
    volume: Volume,
    transfer_function: TransferFunction | TransferFunction2D | None,
    mode: str,
    classify: str,
    surfaces: Sequence[Surface],
    step: float,
    fade: float | None,
    background: tuple[float, float, float, float],
) -> tuple[float, float]:
    """The range of values, or InputError."""
    low, high = volume.range
    if not (math.isfinite(low) and math.isfinite(high)):
        raise InputError(f"{volume.name}: voxels are NaN or infinite; replace them with fill=VALUE when reading")
    if mode not in MODES:
        raise InputError(f"mode must be one of {', '.join(MODES)}, not {mode!r}")
    if classify not in CLASSIFY:
        raise InputError(f"classify must be one of {', '.join(CLASSIFY)}, not {classify!r}")
    if mode == "emission-absorption" and transfer_function is None:
        raise InputError("transfer_function must be given for emission-absorption; see TransferFunction.presets()")
    if mode == "isosurface" and not surfaces:
        raise InputError('surfaces must be given for mode "isosurface": (isovalue, (red, green, blue), opacity) of each')
    for iso, colour, opacity in surfaces:
        if not low < iso <= high:
            raise InputError(f"{volume.name}: iso must be within the volume's values, above {low:g} up to {high:g}, not {iso!r}")
        if len(colour) != 3 or not all(0 <= c <= 1 for c in (*colour, opacity)):
            raise InputError(f"colour and opacity of a surface must be within 0..1, not {colour!r}, {opacity!r}")
    if not 0.01 <= step <= 16:
        raise InputError(f"step must be between 0.01 and 16 voxels, not {step!r}")
    if fade is not None and not 0 <= fade < math.inf:
        raise InputError(f"fade must be a slope of 0 or more, not {fade!r}")
    if len(background) != 4 or not all(0 <= c <= 1 for c in background):
        raise InputError(f"background must be four numbers within 0..1, not {background!r}")
    return low, max(high, low + 1e-6 * max(1.0, abs(low)))


def _check_sampling(
    transfer_function: TransferFunction | TransferFunction2D | None,
    mode: str,
    classify: str,
    interpolation: str,
    gradient: str | None,
    reach: float,
    ghost: float,
) -> None:
    if interpolation not in INTERPOLATION:
        raise InputError(f"interpolation must be one of {', '.join(INTERPOLATION)}, not {interpolation!r}")
    if interpolation == "tricubic" and (mode != "emission-absorption" or classify != "post"):
        raise InputError('interpolation can be tricubic only in mode "emission-absorption" with classify="post"')
    if gradient is not None and gradient not in GRADIENT:
        raise InputError(f"gradient must be one of {', '.join(GRADIENT)}, not {gradient!r}")
    if not 0.01 <= reach <= 16:
        raise InputError(f"reach must be between 0.01 and 16 voxels, not {reach!r}")
    if not 0 <= ghost <= 1:
        raise InputError(f"ghost must be an opacity between 0 and 1, not {ghost!r}")
    if isinstance(transfer_function, TransferFunction2D) and (mode != "emission-absorption" or classify != "post"):
        raise InputError('a 2-D transfer function needs mode "emission-absorption" and classify="post"')


def _coloured(
    value: NDArray[np.float32], transfer_function: TransferFunction | None, low: float, high: float
) -> NDArray[np.float32]:
    """Premultiplied colours of projected values; greys without a transfer function; nothing where the ray missed."""
    if transfer_function is None:
        grey = (value - low) / (high - low)
        rgba = np.stack([grey, grey, grey, np.ones_like(grey)], axis=2)
    else:
        rgba = transfer_function(value)
        rgba[..., :3] *= rgba[..., 3:]
    return np.where(np.isnan(value)[..., None], 0.0, rgba).astype(np.float32)


def _over(front: NDArray[np.float32], background: tuple[float, float, float, float]) -> NDArray[np.float32]:
    """Premultiplied RGBA over a straight background, straight."""
    red, green, blue, alpha = background
    free = 1.0 - front[..., 3:]
    out = front + free * np.array([red * alpha, green * alpha, blue * alpha, alpha], dtype=np.float32)
    out[..., :3] /= np.maximum(out[..., 3:], 1e-6)
    return np.clip(out, 0.0, 1.0, out=out)
