"""Brushed strokes: they cover what their outlines do, on any paper, and nothing depends on threads or tiles."""

from __future__ import annotations

import numpy as np
import oracle
import PIL.Image
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import Drawing, InputError
from intaglio.brush import BRUSHES, PEN, Brush, brush_named
from intaglio.drawing import Dots, Layer, Stroke, Strokes
from intaglio.io import raster
from intaglio.io.raster import rasterize_drawing
from intaglio.io.stamping import TOOTH, catch, stamp, stamps
from intaglio.io.svg import svg_text
from intaglio.io.tips import PAPER_SIDE, SIDE, SIZES, noise, paper_heights, tips

each_brush = pytest.mark.parametrize("name", BRUSHES)


def line(points, width, opacity) -> Stroke:
    points = np.asarray(points, dtype=np.float32)
    return Stroke(points, *(np.full(len(points), v, dtype=np.float32) for v in (width, opacity)))


def plate(brush: str, *strokes: Stroke, grain=1.0, colour="#000000", paper="#ffffff", size=60.0) -> Drawing:
    return Drawing((Layer("brushed", Strokes.of(strokes), colour=colour, brush=brush),), size, size, paper, grain=grain)


def scribbles(seed: int, count=30, size=60.0) -> list[Stroke]:
    rng = np.random.default_rng(seed)
    walks = [rng.uniform(0, size, 2) + np.cumsum(rng.normal(0, 2.0, (8, 2)), axis=0) for _ in range(count)]
    return [line(walk, rng.uniform(0.05, 4), rng.uniform(0, 1)) for walk in walks]


def ink(drawing: Drawing, dpi=300.0) -> float:
    """mm² of black."""
    return float((1 - rasterize_drawing(drawing, dpi).array[..., 0].astype(float)).sum()) * (25.4 / dpi) ** 2


@each_brush
@pytest.mark.parametrize("grain", [0.0, 1.0])
@pytest.mark.parametrize("width", [0.1, 0.4, 2.0])
@pytest.mark.parametrize("opacity", [0.2, 0.5, 0.9])
def test_a_stroke_has_the_tone_of_its_outline(name, grain, width, opacity):
    """Grain and tip say where pigment lies, not how much. Calibrated without jitter and for paper that is seen as a whole."""
    strokes = [line([[5, 4 + 4 * k], [55, 5.7 + 4 * k]], width, opacity) for k in range(13)]
    asked = 13 * 50 * width * opacity
    assert ink(plate(name, *strokes, grain=grain)) == pytest.approx(asked, rel=0.15 if width < 0.2 else 0.06)


@each_brush
def test_thin_lines_keep_their_tone_at_any_resolution(name):
    strokes = [line([[5, 4 + 2 * k], [55, 5.3 + 2 * k]], 0.15, 0.6) for k in range(25)]
    inks = [ink(plate(name, *strokes), dpi) for dpi in (72, 150, 300, 600)]
    assert inks == pytest.approx([25 * 50 * 0.15 * 0.6] * 4, rel=0.12)


@given(st.integers(0, 2**31))
@settings(deadline=None, max_examples=15)
def test_the_kernel_stamps_as_defined(seed):
    brush = Brush(softness=0.6, clumps=0.8, jitter=0.0, turning=False)
    rng = np.random.default_rng(seed)
    walks = [rng.uniform(5, 45, 2) + np.cumsum(rng.normal(0, 5, (4, 2)), axis=0) for _ in range(3)]
    nodes = np.concatenate([np.column_stack([w, rng.uniform(0.1, 4, 4), rng.uniform(0.1, 1, 4)]) for w in walks])
    offsets = np.array([0, 4, 8, 12])
    stamped, count = stamps(nodes, offsets, brush)
    # One tip that does not change when it is turned over, for the kernel takes one by chance.
    texture = np.zeros_like(tips(brush).texture)
    for level in range(SIZES):
        n = (SIDE >> level) + 2
        whole = tips(brush).texture[level, 0, :n, :n]
        texture[level, :, :n, :n] = 0.5 * (whole + whole[::-1])
    load = np.zeros((50, 60), dtype=np.float32)
    entries = np.array([0, 1, 2, 4, 5, 6, 8, 9, 10], dtype=np.int32)
    number = np.repeat(np.arange(3, dtype=np.int32), 4)
    stamp(stamped, count, number, entries, texture, True, np.float32(0), False, 0, 0, load)
    slow = oracle.stamped(stamped, count, offsets.tolist(), texture[:, 0], SIZES, load.shape)
    np.testing.assert_allclose(load, slow, atol=2e-3 * max(slow.max(), 1.0))


def test_heights_are_spread_evenly_and_paper_is_tileable():
    heights = paper_heights()
    np.testing.assert_allclose(np.histogram(heights, 16, (0, 1))[0], PAPER_SIDE**2 / 16, rtol=1e-6)
    # No seam: the step over the border is like those inside.
    for axis in (0, 1):
        inside = np.abs(np.diff(heights, axis=axis)).mean()
        seam = np.abs(heights.take(0, axis) - heights.take(-1, axis)).mean()
        assert seam == pytest.approx(inside, rel=0.2)


@given(st.floats(0.001, 0.999), st.floats(0, 1))
@settings(deadline=None, max_examples=40)
def test_grain_covers_as_much_as_smooth_paper(cover, grain):
    side = 256
    load = np.full((side, side), -np.log1p(-cover), dtype=np.float32)
    tile = np.ones((side, side, 3), dtype=np.float32)
    # Pixels on texels, so that nothing is interpolated.
    heights = np.tile(noise(side, 0.03, 0.13, np.random.default_rng(5)), (PAPER_SIDE // side, PAPER_SIDE // side))
    catch(load, heights, 1.0, np.float32(grain), -0.5, -0.5, np.zeros(3, dtype=np.float32), tile)
    assert float(1 - tile.mean(dtype=float)) == pytest.approx(cover, abs=2e-3)
    if grain == 1 and TOOTH / 2 < cover < 1 - TOOTH / 2:
        assert tile.min() == 0
        assert tile.max() == 1


@each_brush
def test_full_grain_leaves_valleys_bare_where_smooth_paper_is_covered(name):
    broad = [line([[5, 30], [55, 30]], 20, 0.4)]
    middle = np.s_[300:400, 200:500, 0]
    smooth, rough = (rasterize_drawing(plate(name, *broad, grain=g), 300).array[middle] for g in (0.0, 1.0))
    # A little of it for ink, a lot for chalk.
    assert rough.std() > (1 + BRUSHES[name].grain) * smooth.std()
    assert rough.mean() == pytest.approx(smooth.mean(), abs=0.03)


def test_brushes_differ():
    pictures = [rasterize_drawing(plate(name, *scribbles(1)), 150).array for name in (PEN, *BRUSHES)]
    for i, a in enumerate(pictures):
        assert all(np.abs(a - b).mean() > 1e-3 for b in pictures[:i])


def test_vectors_stay_clean():
    strokes = scribbles(2)
    assert svg_text(plate("charcoal", *strokes)) == svg_text(plate(PEN, *strokes, grain=0))


@each_brush
def test_pixels_do_not_depend_on_threads_or_tiles(name, monkeypatch):
    drawing = plate(name, *scribbles(3, 60))
    pictures = []
    for threads, tile in ((1, 64), (2, 64), (3, 48), (1, 1000)):
        monkeypatch.setenv("INTAGLIO_THREADS", str(threads))
        monkeypatch.setattr(raster, "TILE", tile)
        pictures.append(rasterize_drawing(drawing, 150).array)
    assert pictures[0].tobytes() == pictures[1].tobytes()
    np.testing.assert_allclose(pictures[0], pictures[2], atol=2e-3)
    np.testing.assert_allclose(pictures[0], pictures[3], atol=2e-3)


@each_brush
def test_order_of_strokes_does_not_matter_but_that_of_layers_does(name):
    """Pigment of one brush and colour is summed; number and chance of a stroke follow its place, hence without jitter."""
    strokes = [line([[5, 20], [55, 20]], 6, 0.6), line([[30, 5], [30, 55]], 6, 0.6)]
    below, above = (plate(name, strokes[0], colour=c).layers[0] for c in ("#ff0000", "#0000ff"))
    red, blue = (
        rasterize_drawing(Drawing(layers, 60, 60), 100).array[75:82, 60:180].mean(axis=(0, 1))[[0, 2]]
        for layers in ((below, above), (above, below))
    )
    assert red[1] > red[0]
    assert blue[0] > blue[1]


def test_a_dab_is_as_large_as_its_outline():
    for name in BRUSHES:
        dabs = [line([[x, y], [x, y]], 2, 0.5) for x in range(5, 60, 5) for y in range(5, 60, 5)]
        assert ink(plate(name, *dabs)) == pytest.approx(len(dabs) * 0.5 * np.pi, rel=0.4)


def test_dots_of_a_brushed_layer_are_there():
    dots = Dots(np.float32([[30, 30]]), np.float32([10]), np.float32([1]))
    assert ink(Drawing((Layer("dots", dots=dots, brush="chalk"),), 60, 60)) == pytest.approx(25 * np.pi, rel=0.02)


def test_images_are_brushes(tmp_path):
    """Dark is pigment; or what is opaque, where a file says so. Equal tips draw alike."""
    y, x = np.indices((40, 60)) - np.array([20, 30])[:, None, None]
    disc = np.hypot(x, y) < 15
    dark, clear = str(tmp_path / "dark.png"), str(tmp_path / "clear.png")
    PIL.Image.fromarray(np.where(disc, 0, 255).astype(np.uint8)).save(dark)
    PIL.Image.fromarray(np.dstack([np.full((40, 60, 3), 200), np.where(disc, 255, 0)]).astype(np.uint8)).save(clear)
    strokes = scribbles(4)
    a, b = (rasterize_drawing(plate(path, *strokes), 100).array for path in (dark, clear))
    np.testing.assert_allclose(a, b, atol=0.02)
    straight = [line([[5, 30], [55, 30]], 3, 0.5)]
    assert ink(plate(dark, *straight)) == pytest.approx(50 * 3 * 0.5, rel=0.08)


@pytest.mark.parametrize(
    ("name", "words"),
    [
        ("mop", "brush must be pen, pencil, .*, or an image file .*, not 'mop'"),
        ("missing.png", "brush 'missing.png' does not exist"),
        ("notes.txt", "brush must be pen"),
    ],
)
def test_unknown_brushes_are_refused(name, words):
    with pytest.raises(InputError, match=words):
        Layer("x", brush=name)


def test_bad_images_are_refused(tmp_path):
    text, blank = tmp_path / "text.png", tmp_path / "blank.png"
    text.write_text("not a picture")
    PIL.Image.new("L", (8, 8), 255).save(blank)
    with pytest.raises(InputError, match="cannot be read as an image"):
        tips(brush_named(str(text)))
    with pytest.raises(InputError, match="is blank"):
        tips(brush_named(str(blank)))


def test_grain_is_checked():
    with pytest.raises(InputError, match="grain must be between 0 and 1, not 2"):
        plate(PEN, grain=2)


@given(st.floats(0, 1), st.floats(0, 1), st.floats(0.02, 1), st.floats(0.05, 0.5), st.floats(0, 1), st.booleans())
@settings(deadline=None, max_examples=20)
def test_any_numbers_make_a_tip(softness, clumps, clump, spacing, jitter, turning):
    tip = tips(Brush(softness=softness, clumps=clumps, clump=clump, spacing=spacing, jitter=jitter, turning=turning))
    assert np.isfinite(tip.texture).all()
    assert tip.texture.min() >= 0
    assert tip.texture.max() <= 1 + 1e-6
    assert 0 < tip.column <= 1.5
    assert (np.diff(tip.covered) > 0)[:-1].all()
