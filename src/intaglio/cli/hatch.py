"""`intaglio hatch`."""

from __future__ import annotations

from pathlib import Path
from typing import Annotated, Any

from typer import BadParameter, Option

from intaglio.cli.console import out, running, say
from intaglio.cli.cuts import Cut, check_cuts, selections_of
from intaglio.cli.options import (
    Dpi,
    Islands,
    Iso,
    Lens,
    MainLight,
    Plate,
    Plotter,
    Reading,
    Scan,
    Seed,
    Size,
    View,
    Width,
    camera_options,
    lamps,
    read,
    styled,
    with_groups,
    with_options,
)
from intaglio.cli.surfaces import Function, Halo, LabelFile, Labels, Surfaces, function_of, label_of, present, surface_of
from intaglio.errors import InputError
from intaglio.ink.hand import Hand
from intaglio.ink.styles import STYLES, Hatching

DEFAULT = Path("plate.svg")


@with_options(Hatching, hand=Hand)
@with_groups
def hatch(
    scan: Scan,
    output: Plate = DEFAULT,
    view: View = "anterior",
    iso: Iso = None,
    islands: Islands = None,
    style: Annotated[str, Option("--style", metavar="NAME", help=f"One of {', '.join(STYLES)}.")] = "pencil",
    surface: Surfaces = None,
    labels: LabelFile = None,
    label: Labels = None,
    tf: Function = None,
    halo: Halo = 0.5,
    cut: Cut = None,
    seed: Seed = 0,
    width: Width = 160,
    dpi: Dpi = 300,
    plotter: Plotter = False,
    size: Size = None,
    light: MainLight = None,
    *,
    lens: Lens,
    reading: Reading,
    **parameters: Any,
) -> None:
    """Draw surfaces of a scan with hatching and contours.

    `intaglio hatch head.nii.gz -o head.svg`

    `intaglio hatch head.nii.gz --iso 300 --view anterior-left -o skull.pdf`

    `intaglio hatch head.nii.gz --cut plane:superior,20 --view superior-left`

    `intaglio hatch engine.raw --raw 256x256x128,uint8 --view 1,1,1 -o engine.png`

    `intaglio hatch head.nii.gz --surface 0.2:contour --surface 0.55:pencil`

    `intaglio hatch ct.nii.gz --labels organs.nii.gz --label 5:engraving:#8a2b1a`

    `intaglio hatch ct.nii.gz --tf ct-tissues`

    `intaglio info SCAN` tells which values surfaces can have. What is not 100% opaque, such as a contour, shows what is behind.

    Styles: **pencil** is soft, layers of short strokes; **graphite** finer and smoother, **charcoal** broad and rough;
    **pen-and-ink** bold, one layer of lines that swell; **engraving** fine and even, crossed in the dark; **woodcut** few and
    heavy; **chalk** bright strokes on dark paper. A PNG shows brush and paper, an SVG or PDF the strokes' outlines.
    """  # fmt: skip
    from intaglio.camera import view_direction
    from intaglio.io.plates import check_output
    from intaglio.io.volumes import read_volume
    from intaglio.parts import ISLANDS, Part, parts_of
    from intaglio.plate import PLATE_MATERIAL, illustrate, parts_camera
    from intaglio.rendering.isovalue import body_surface
    from intaglio.transfer_function import TransferFunction

    check_output(output)
    if plotter and output.suffix.lower() != ".svg":
        raise InputError(f"--plotter needs an .svg output, not {output.name!r}")

    def of_style(name: str | None) -> Hatching:
        return styled(name or style, parameters)

    hatching = of_style(None)
    surfaces = [surface_of(text, of_style) for text in surface or ()]
    bodies = [label_of(text, of_style) for text in label or ()]
    if (labels is None) != (not bodies):
        raise BadParameter("needs --labels FILE" if bodies else "needs --label NUMBERS", param_hint="'--label'")
    function = function_of(tf)
    if sum(map(bool, (iso is not None, tf, surfaces or bodies))) > 1:
        raise BadParameter("cannot be given together; --surface alone says it all", param_hint="'--iso', '--tf', '--surface'")
    view_direction(view)
    lights = lamps(light)
    pieces = ISLANDS if islands is None else islands
    check_cuts(cut)
    looking = camera_options(lens)
    with running() as steps:
        volume = read(steps, scan, reading)
        tools = tuple(selections_of(cut, volume))
        with steps.step("surfaces"):
            if function is not None:
                function = TransferFunction.preset(function, volume.range) if isinstance(function, str) else function
                parts = parts_of(volume, function, style=hatching, islands=pieces, selections=tools)
            elif surfaces or bodies:
                common: dict[str, Any] = {"islands": islands, "selections": tools}
                parts = [Part(volume=volume, **part, **common) for part in surfaces]
                of = read_volume(labels) if labels is not None else volume
                for text in of.notes if labels is not None else ():
                    say(f"note: {text}")
                parts += [Part(volume=of, **part | {"label": present(part["label"], of)}, **common) for part in bodies]
            else:
                if iso is None:
                    iso, what = body_surface(volume)
                    say(f"note: no --iso given; drawing {iso:g}, {what}")
                parts = [Part(volume=volume, iso=iso, style=hatching, islands=pieces, selections=tools)]
            camera = parts_camera(parts, view, size, width_mm=width, **looking)
        with steps.step("strokes") as progress:
            title = f"{volume.name}, {', '.join(part.title for part in parts)}, {view}"
            plate = illustrate(
                parts, camera=camera, seed=seed, width_mm=width, halo=halo, lights=lights, material=PLATE_MATERIAL,
                title=title, progress=progress,
            )  # fmt: skip
        with steps.step("writing"):
            plate.save(output, dpi=dpi, plotter=plotter)
    strokes = sum(len(layer.strokes) for layer in plate.layers)
    if strokes == 0:
        say("note: the plate is empty; is the surface in view and darker than --white?")
    out.print(f"{output}  {plate.width_mm:.0f} x {plate.height_mm:.0f} mm, {strokes} strokes, {steps.summary()}", markup=False)
