"""Sections: what a cut shows is ruled evenly, the darker the less dense, and nothing of the surface's hatching is in it."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from scipy import ndimage

from intaglio import Camera, Drawing, GBuffer, Part, Selection, Volume, draw, hatch, illustrate, isosurface, read_volume, styles
from intaglio.ink.hatching import darkness, hatching_layers
from intaglio.ink.lines import line_layers
from intaglio.ink.strokes import sample
from intaglio.ink.styles import Hatching, style
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL

PIXELS, MM = 300, 0.3
each_style = pytest.mark.parametrize("name", styles())
FRONT = Selection.plane((0, 0, 0), (0, 1, 0))


def ball(core: float = 0.0) -> Volume:
    """Radius 20 mm; twice as dense within the core."""

    def density(p: np.ndarray) -> np.ndarray:
        r = np.linalg.norm(p, axis=-1)
        return np.clip(20.5 - r, 0, 1) + np.clip(core + 0.5 - r, 0, 1)

    return oracle.sampled(density, (48, 48, 48))


def opened(core: float = 0.0, view: object = "anterior", *tools: Selection) -> GBuffer:
    volume = ball(core)
    camera = Camera.looking(view, volume, (PIXELS, PIXELS))
    return isosurface(volume, 0.5, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL, selections=tools or (FRONT,))


def plain(name: str, **changes: object) -> Hatching:
    return style(
        name, **{"ink": "#000000", "paper": "#ffffff", "contour": 0.0, "valley": 0.0, "ridge": 0.0, "brush": "pen"} | changes
    )


def printed(gb: GBuffer, hatching: Hatching) -> np.ndarray:
    return 1.0 - draw(gb, hatching, width_mm=PIXELS * MM).image(25.4 / MM).array[:PIXELS, :PIXELS, 0]


def test_a_cut_face_is_a_section_and_the_surface_is_not():
    gb = opened()
    assert gb.cut.sum() * gb.camera.pixel**2 == pytest.approx(np.pi * 20**2, rel=0.02)
    assert (gb.cut == gb.mask).mean() > 0.99
    whole = isosurface(ball(), 0.5, gb.camera)
    assert np.isnan(whole.section).all()
    assert whole.border is whole.edge


def test_where_the_scan_ends_inside_the_body_is_a_section():
    full = Volume.from_array(np.ones((20, 20, 20), np.float32) + np.arange(20, dtype=np.float32) / 20)
    gb = isosurface(full, 1.001, Camera.looking("superior", full, 60))
    assert gb.cut[gb.mask].mean() > 0.9


def test_denser_is_nearer_to_one():
    gb = opened(core=8.0)
    y, x = np.mgrid[:PIXELS, :PIXELS] + 0.5
    r = np.hypot(x - PIXELS / 2, y - PIXELS / 2) * gb.camera.pixel
    assert gb.section[r < 7].min() > 0.9
    assert gb.section[(r > 9.5) & (r < 19)].max() < 0.35
    # Even matter is in the middle.
    assert opened().section[r < 17] == pytest.approx(0.5, abs=0.01)


def test_distances_have_even_sections():
    volume = oracle.sampled(lambda p: -oracle.Sphere(18.0).field(p), (48, 48, 48))
    gb = isosurface(volume, 0.0, Camera.looking("anterior", volume, 100), inside="below", selections=[FRONT])
    assert gb.cut.any()
    assert (gb.section[gb.cut] == 0.5).all()


@each_style
def test_sections_are_never_blank_and_print_what_is_asked(name):
    for core in (0.0, 8.0):
        gb = opened(core)
        hatching = plain(name)
        asked, tone = darkness(gb, hatching, MM), printed(gb, hatching)
        inner = ndimage.binary_erosion(gb.cut, iterations=20)
        assert tone[inner].mean() > 0.08
        assert tone[inner].mean() == pytest.approx(asked[inner].mean(), abs=0.03)


@each_style
def test_dense_matter_is_lighter(name):
    gb = opened(core=10.0)
    y, x = np.mgrid[:PIXELS, :PIXELS] + 0.5
    r = np.hypot(x - PIXELS / 2, y - PIXELS / 2) * gb.camera.pixel
    tone = printed(gb, plain(name))
    assert 0.02 < tone[r < 8].mean() < 0.6 * tone[(r > 12) & (r < 17)].mean()


def test_on_dark_paper_dense_matter_has_more_of_the_light_ink():
    gb = opened(core=10.0)
    asked = darkness(gb, style("chalk"), MM)
    assert asked[PIXELS // 2, PIXELS // 2] > 1.5 * asked[PIXELS // 2, round(PIXELS * 0.2)] > 0


def test_lines_of_a_plane_section_are_straight_and_parallel():
    hatching = plain("pen-and-ink")
    layers = {layer.name: layer.strokes for layer in hatching_layers(opened(), hatching, MM)}
    long = [s for s in layers["section"] if np.linalg.norm(s.points[-1] - s.points[0]) > 10]
    turn = [np.arctan2(*(s.points[-1] - s.points[0])[::-1]) for s in long]
    assert np.ptp(np.degrees(turn) % 180) < 1.0
    assert np.degrees(turn[0]) % 180 == pytest.approx(135, abs=1)
    # Distances of neighbours across the lines are all the same.
    across = np.sort([s.points.mean(axis=0) @ [np.sqrt(0.5), np.sqrt(0.5)] for s in long])
    np.testing.assert_allclose(np.diff(across), hatching.separation, rtol=0.15)


def test_faces_are_told_apart_by_the_direction_of_their_lines():
    tools = [Selection.plane((-5, 0, 0), (-1, 0, 0)), Selection.plane((0, 0, 5), (0, 0, 1))]
    gb = opened(0.0, (-1, 0.8, 1), *tools)
    up = gb.normal[..., 2] > 0.9
    lines = next(s.strokes for s in hatching_layers(gb, plain("pen-and-ink"), MM) if s.name == "section")
    turns: dict[bool, list[float]] = {True: [], False: []}
    for stroke in lines:
        x, y = (stroke.points[len(stroke.points) // 2] / MM).astype(int)
        turns[bool(up[y, x])].append(np.degrees(np.arctan2(*(stroke.points[-1] - stroke.points[0])[::-1])) % 180)
    assert min(map(len, turns.values())) > 5
    a, b = (np.median(t) for t in turns.values())
    assert 20 < abs(a - b) < 160


def test_surface_hatching_stays_out_of_sections_and_lines_do_not_cross_the_rim():
    gb = opened(0.0, (0.5, 1, 0.8))
    for layer in hatching_layers(gb, plain("engraving"), MM):
        x, y = (layer.strokes.points / np.float32(MM)).astype(int).T
        assert len(x) > 30 or layer.name == "crosshatching 1"  # of which a cut ball may have none
        assert (gb.cut[y, x] == (layer.name == "section")).all()


def test_the_rim_is_drawn_where_a_section_meets_the_surface():
    gb = opened(0.0, (0.5, 1, 0.8))
    rim = next(layer.strokes for layer in line_layers(gb, Hatching(), MM) if layer.name == "rim")
    edge = ndimage.distance_transform_edt(~(ndimage.binary_dilation(gb.cut) & ~gb.cut & gb.mask))
    assert len(rim) >= 1
    assert sample(edge.astype(np.float32), rim.points / np.float32(MM)).max() < 3
    assert not [layer for layer in line_layers(isosurface(ball(), 0.5, gb.camera), Hatching(), MM) if layer.name == "rim"]


def test_the_rim_where_the_scan_ends_lies_where_it_does():
    volume = oracle.sampled(oracle.Cylinder(15.0, (0.0, 0.0, 1.0)).field, (30, 48, 48))
    camera = Camera.looking((0.0, 1.0, 1.0), volume, 120)
    lines = line_layers(isosurface(volume, 0.0, camera), Hatching(), MM)
    points = next(layer.strokes.points for layer in lines if layer.name == "rim") / MM
    angle = np.radians(np.arange(20, 161))
    rim = camera.project(np.stack([15 * np.cos(angle), 15 * np.sin(angle), np.full(len(angle), 14.5)], axis=1))[:, :2]
    # Half way between two pixels, and smoothed.
    assert np.linalg.norm(points[:, None] - rim[None], axis=2).min(axis=0).max() < 1.2


def test_a_cut_scan_in_every_style(shared):
    volume = read_volume(shared("volumes/ct_head.nii.gz"))
    middle = volume.corners.mean(axis=0)
    tool = Selection.plane(middle, (-1, 0, 0))
    camera = Camera.looking("left", volume, 300)
    for name in styles():
        plate = hatch(volume, iso=0.2, camera=camera, style=name, selections=[tool], width_mm=60)
        assert isinstance(plate, Drawing)
        assert len(next(layer.strokes for layer in plate.layers if layer.name == "section")) > 20
    both = [Part(volume=volume, iso=iso, selections=[tool], opacity=o, name=str(iso)) for iso, o in ((0.2, 0.4), (0.55, 1.0))]
    assert {"0.2: section", "0.55: section"} <= {layer.name for layer in illustrate(both, camera=camera, width_mm=60).layers}
