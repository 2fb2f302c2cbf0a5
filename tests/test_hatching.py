"""Plates: strokes keep their rules, and a seed decides everything."""

from __future__ import annotations

import dataclasses
from dataclasses import fields, replace

import numpy as np
import oracle
import pytest
from hypothesis import HealthCheck, example, given, settings, strategies as st
from scipy import ndimage

from intaglio import (
    Camera,
    Drawing,
    GBuffer,
    Hand,
    Hatching,
    InputError,
    Volume,
    body_surface,
    draw,
    hatch,
    isosurface,
    read_volume,
    styles,
    surface_camera,
)
from intaglio.datasets import head
from intaglio.ink.hatching import darkness, hatching_layers, tones
from intaglio.ink.lines import line_layers
from intaglio.ink.margin import margin
from intaglio.ink.strokes import sample
from intaglio.ink.styles import style
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL

PLATE = 60.0
PIXELS = 300
MM = PLATE / PIXELS
each_style = pytest.mark.parametrize("name", styles())


def plain(name: str, **changes) -> Hatching:
    """A style in black on white, without contours and feature lines."""
    return style(
        name, **{"ink": "#000000", "paper": "#ffffff", "contour": 0.0, "valley": 0.0, "ridge": 0.0, "brush": "pen"} | changes
    )


def grey(drawing: Drawing, mm: float) -> np.ndarray:
    """Share of each pixel of `mm` that is inked."""
    return 1.0 - drawing.image(dpi=25.4 / mm).array[..., 0].astype(np.float64)


def strokes_of(drawing: Drawing):
    """Points in mm of every stroke, and its layer's name."""
    for layer in drawing.layers:
        for stroke in layer.strokes:
            yield layer.name, stroke


@pytest.fixture(scope="module")
def torus() -> GBuffer:
    volume = oracle.sampled(oracle.Torus(15.0, 7.0).field, (32, 60, 60))
    camera = Camera.looking((1, 1, 3), volume, (PIXELS, PIXELS), zoom=1.35)
    return isosurface(volume, 0.0, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL)


def sound(drawing: Drawing) -> Drawing:
    """What every drawing must be, whatever it is made of."""
    for layer in drawing.layers:
        s = layer.strokes
        assert np.isfinite(s.points).all()
        assert ((s.width >= 0) & np.isfinite(s.width)).all()
        assert ((s.opacity >= 0) & (s.opacity <= 1 + 1e-6)).all()
    drawing.image(dpi=50)
    assert drawing._repr_svg_().startswith("<")
    return drawing


@each_style
def test_strokes_begin_in_the_dark(name, torus):
    hatching = plain(name, wobble=0.0, ragged=0.0)
    dark = darkness(torus, hatching, MM)
    falling = total = 0
    for _, stroke in strokes_of(draw(torus, hatching, width_mm=PLATE)):
        first, last = sample(dark, (stroke.points[[0, -1]] / MM).astype(np.float32))
        # Where tone is beyond what a layer adds, both ends are as dark as it gets.
        assert first > last - 1e-4 or min(first, last) >= min(t.end for t in tones(hatching)) - 1e-3
        falling += first > last
        total += 1
    assert total > 20
    assert falling > 0.6 * total


@each_style
@pytest.mark.parametrize("shortest", [1.0, 4.0])
def test_no_stroke_is_shorter_than_the_shortest(name, shortest, torus):
    hatching = plain(name, shortest=shortest, longest=0.0, wobble=0.0)
    lengths = [
        np.linalg.norm(np.diff(s.points.astype(float), axis=0), axis=1).sum()
        for _, s in strokes_of(draw(torus, hatching, width_mm=PLATE))
    ]
    assert len(lengths) > 20
    # float32 millimetres.
    assert min(lengths) >= shortest - 1e-3


@each_style
def test_strokes_stay_on_the_surface(name, torus):
    hatching = plain(name)
    mask = ndimage.binary_dilation(torus.mask)
    # The hand is unsteady by some amplitudes at most.
    reach = round(1.5 * hatching.wobble / MM)
    mask = ndimage.binary_dilation(mask, iterations=reach) if reach else mask
    h, w = mask.shape
    for _, stroke in strokes_of(draw(torus, hatching, width_mm=PLATE)):
        x, y = (stroke.points / MM).T.astype(int)
        assert mask[np.clip(y, 0, h - 1), np.clip(x, 0, w - 1)].all()


@each_style
def test_width_and_opacity_stay_within_what_is_asked(name, torus):
    hatching = plain(name)
    for _, stroke in strokes_of(draw(torus, hatching, width_mm=PLATE)):
        assert stroke.width.max() <= hatching.thickest + 1e-6
        assert stroke.opacity.max() <= hatching.opacity + 1e-6


@each_style
def test_strokes_thin_out_unless_they_end_at_a_contour(name, torus):
    hatching = plain(name, wobble=0.0)
    room = margin(torus.edge, 50.0)
    blunt = 0
    for _, stroke in strokes_of(draw(torus, hatching, width_mm=PLATE)):
        near = sample(room, (stroke.points[[0, -1]] / MM).astype(np.float32)) * MM < 0.5 * hatching.thickest + 2 * MM
        assert (stroke.width[[0, -1]][~near] == 0).all()
        blunt += (stroke.width[[0, -1]] > 0).any()
    assert blunt > 5


@each_style
@pytest.mark.parametrize("scene", ["torus", "step"])
def test_ink_ends_where_the_surface_does(name, scene, torus):
    """No stroke is wider than there is room for it, beside the body and at a step in its depth."""
    gb = torus if scene == "torus" else step_in_depth()
    hatching = plain(name)
    y, x, side = np.nonzero(gb.edge >= 0)
    part = gb.edge[y, x, side]
    ends = np.stack([x + 0.5 + part * (1 - side), y + 0.5 + part * side], axis=1) * MM
    drawing = draw(gb, hatching, width_mm=PLATE)
    wide = 0
    for _, stroke in strokes_of(drawing):
        distance = np.linalg.norm(stroke.points[:, None].astype(np.float64) - ends[None], axis=2).min(axis=1)
        # Distances between pixels are interpolated.
        assert (0.5 * stroke.width <= distance + 0.75 * MM).all()
        wide += (0.5 * stroke.width > 0.9 * distance).sum()
    assert wide > 20
    # With a contour ink may go on beneath it.
    under = [s.width.max() for _, s in strokes_of(draw(gb, replace(hatching, contour=2.0), width_mm=PLATE))]
    assert len(under) > 20


def step_in_depth() -> GBuffer:
    """A dark sheet whose right part lies farther back, level with the picture."""
    gb = oracle.sheet((PIXELS, PIXELS), light=0.1)
    right = np.broadcast_to(np.arange(PIXELS) > PIXELS // 2, (PIXELS, PIXELS))
    gb.depth[right] += 30.0
    oracle.mark_edges(gb, right)
    return gb


def test_layers_are_nested(torus):
    """Lines of a second layer run between those of the first, not over them."""
    hatching = Hatching(layers=2, separation=2.4, wobble=0.0, longest=0.0)
    first, second = (layer.strokes.points for layer in hatching_layers(torus, hatching, MM))
    distance = np.linalg.norm(second[:, None] - first[None], axis=2).min(axis=1)
    assert distance.min() > 0.9 * hatching.evenness * hatching.separation / 2


@pytest.mark.parametrize("angle", [30.0, 90.0])
def test_crosshatching_crosses_at_its_angle(angle):
    gb = oracle.sheet((150, 150), light=0.0)
    hatching = Hatching(layers=1, crosshatch=1, separation=2.0, angle=angle, wobble=0.0)
    along = []
    for layer in hatching_layers(gb, hatching, MM):
        line = max(layer.strokes, key=lambda s: len(s.points)).points
        along.append(np.degrees(np.arctan2(*(line[-1] - line[0])[::-1])))
    turn = abs(along[1] - along[0]) % 180
    assert min(turn, 180 - turn) == pytest.approx(min(angle, 180 - angle), abs=0.5)


def one_pixel() -> GBuffer:
    gb = oracle.sheet((20, 20), light=0.0)
    gb.depth[:] = np.inf
    gb.depth[10, 10] = 50.0
    oracle.mark_edges(gb, np.isfinite(gb.depth))
    return gb


def noisy() -> GBuffer:
    rng = np.random.default_rng(0)
    volume = Volume.from_array(rng.uniform(0, 1, (16, 20, 24)).astype(np.float32))
    return isosurface(volume, 0.5, Camera.looking((1, 2, 3), volume, 80))


ODD = {
    "empty": lambda: GBuffer.empty(oracle.sheet((30, 40)).camera),
    "one pixel": one_pixel,
    "picture of one pixel": lambda: oracle.sheet((1, 1), light=0.0),
    "one row": lambda: oracle.sheet((1, 60), light=0.0),
    "one column": lambda: oracle.sheet((60, 1), light=0.0),
    "all dark": lambda: oracle.sheet((60, 80), light=0.0),
    "all bright": lambda: oracle.sheet((60, 80), light=1.0),
    "glaring": lambda: oracle.sheet((60, 80), light=9.0),
    "noise": noisy,
}


@each_style
@pytest.mark.parametrize("case", ODD)
def test_odd_pictures_give_a_plate(name, case):
    gb = ODD[case]()
    layers = hatching_layers(gb, style(name), MM) + line_layers(gb, style(name), MM)
    drawing = sound(Drawing(tuple(layers), gb.camera.size[0] * MM, gb.camera.size[1] * MM))
    marks = sum(len(layer.strokes) for layer in drawing.layers)
    blank, full = ("all dark",), ("all bright", "glaring")
    if not style(name).bright:
        blank, full = full, blank
    if case in ("empty", *blank):
        assert marks == 0 or style(name).ragged > 0.03  # whose strokes end raggedly, before or behind where tone begins
    if case in full:
        assert marks > 0


def test_paper_has_the_proportions_of_the_picture():
    drawing = draw(oracle.sheet((30, 80)), Hatching(), width_mm=16.0)
    assert drawing.width_mm == 16.0
    assert drawing.height_mm == pytest.approx(6.0)
    with pytest.raises(InputError, match="width_mm must be between 5 and 5000, not 4"):
        draw(oracle.sheet((30, 80)), Hatching(), width_mm=4)


def test_progress_ends_complete(torus):
    seen: list[tuple[int, int]] = []
    hatching_layers(torus, Hatching(crosshatch=1), MM, progress=lambda done, total: seen.append((done, total)))
    assert seen == [(i, 3) for i in range(4)]


def svg(volume: Volume, camera: Camera, name: str, seed: int, width_mm: float) -> str:
    return hatch(volume, camera=camera, style=name, seed=seed, width_mm=width_mm)._repr_svg_()


def assert_seed_decides(volume: Volume, size: int, name: str, monkeypatch) -> None:
    camera = surface_camera(volume, body_surface(volume)[0], "anterior-left", size)
    plates = []
    for threads in "122":
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        plates.append(svg(volume, camera, name, 3, 0.2 * size))
    assert plates[0] == plates[1] == plates[2]
    hatching = style(name)
    if hatching.ragged or hatching.wobble or hatching.longest:
        assert svg(volume, camera, name, 4, 0.2 * size) != plates[0]


@each_style
def test_a_seed_decides_every_byte_whatever_the_threads(name, monkeypatch):
    assert_seed_decides(head(), 160, name, monkeypatch)


@each_style
def test_a_seed_decides_every_byte_of_a_real_scan(name, shared, monkeypatch):
    assert_seed_decides(read_volume(shared("volumes/ct_head.nii.gz")), 256, name, monkeypatch)


def test_styles_without_chance_do_not_depend_on_the_seed(torus):
    hatching = Hatching(ragged=0.0, wobble=0.0, longest=0.0)
    a, b = (draw(torus, hatching, width_mm=PLATE, seed=seed) for seed in (1, 2))
    assert a._repr_svg_() == b._repr_svg_()


def some(field: dataclasses.Field) -> st.SearchStrategy:
    """Values of a parameter, from its lowest up to where pictures of 60 pixels still differ."""
    low, high = field.metadata["low"], field.metadata["high"]
    if field.name == "hand":
        return st.sampled_from([None, Hand(), Hand(increment=1, points=2, interval=0.1)])
    if field.name == "brush":
        return st.sampled_from(["pen", "chalk"])
    if low is None:
        return st.sampled_from(["#000000", "#12aBf0"])
    if isinstance(field.default, int):
        return st.integers(low, min(high, 6))
    spread = st.floats(low, min(high, 20 * float(field.default) + 1)).map(lambda value: max(low, round(value, 3)))
    return st.one_of(spread, st.just(float(low)), st.just(field.default))


@settings(deadline=None, max_examples=120, suppress_health_check=[HealthCheck.too_slow])
@given(st.fixed_dictionaries({}, optional={f.name: some(f) for f in fields(Hatching)}))
@example({"separation": 0.8, "layers": 2, "crosshatch": 2, "thickest": 1.5})  # the first layer covers the paper
def test_any_parameters_give_a_plate_or_say_what_is_wrong(parameters):
    gb = small_torus()
    try:
        drawing = draw(gb, Hatching(**parameters), width_mm=12.0)
    except InputError:
        return
    sound(drawing)


def small_torus(cache: list[GBuffer] = []) -> GBuffer:  # noqa: B006
    if not cache:
        volume = oracle.sampled(oracle.Torus(15.0, 7.0).field, (32, 60, 60))
        camera = Camera.looking((1, 1, 3), volume, (60, 60), zoom=1.35)
        cache.append(isosurface(volume, 0.0, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL))
    return cache[0]


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"separation": 0.0}, "separation must be between 0.1 and 50, not 0.0"),
        ({"layers": 9}, "layers must be between 1 and 4, not 9"),
        ({"thinnest": 0.5, "thickest": 0.2}, "thinnest must not be above thickest"),
        ({"black": 0.9, "white": 0.5}, "black must be below white"),
        ({"ink": "black"}, 'colour must be "#rrggbb"'),
        ({"opacity": float("nan")}, "opacity must be between 0.02 and 1, not nan"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(parameters, message):
    with pytest.raises(InputError, match=message):
        Hatching(**parameters)


def test_styles_can_be_changed_by_parameter_and_unknown_ones_are_named():
    assert style("pencil", separation=2.0) == replace(style("pencil"), separation=2.0)
    assert style(Hatching(layers=3)).layers == 3
    with pytest.raises(InputError, match="style must be one of pen-and-ink"):
        style("crayon")
    with pytest.raises(InputError, match="'colour' is not a parameter of hatching"):
        style("pencil", colour="#000000")


def test_lines_closer_than_a_pixel_are_refused_with_what_to_do():
    with pytest.raises(InputError, match=r"lines [0-9.]+ mm apart need pixels.*use a larger image"):
        draw(small_torus(), Hatching(separation=0.1), width_mm=160.0)


def test_hatch_needs_nothing_but_a_volume():
    volume = oracle.sampled(oracle.Sphere(12.0).field, (32, 32, 32))
    drawing = sound(hatch(volume, iso=0.0, width_mm=100.0))
    assert drawing.width_mm == 100.0
    assert sum(len(layer.strokes) for layer in drawing.layers) > 20
    assert "iso 0" in drawing.title
    with pytest.raises(InputError, match="every voxel is 1"):
        hatch(Volume.from_array(np.ones((9, 9, 9))))


def test_a_style_may_be_a_name():
    gb = oracle.sheet((60, 60), light=0.3)
    assert draw(gb, "engraving", width_mm=10.0)._repr_svg_() == draw(gb, style("engraving"), width_mm=10.0)._repr_svg_()
    with pytest.raises(InputError, match="style must be one of pen-and-ink"):
        draw(gb, "crayon")
