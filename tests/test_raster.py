"""Our rasterizer: ink is conserved, joints do not darken, and thread counts do not matter."""

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import Drawing, InputError
from intaglio.drawing import Dots, Layer, Stroke, Strokes
from intaglio.io import raster
from intaglio.io.raster import drawing_bytes8, rasterize_drawing

DPI = 254.0  # ten pixels a millimetre


def plate(*layers: Layer, size=(20.0, 20.0), paper="#ffffff") -> Drawing:
    return Drawing(tuple(layers), *size, paper)


def line(points, width=0.4, opacity=1.0) -> Stroke:
    points = np.asarray(points, dtype=np.float32)
    return Stroke(points, *(np.broadcast_to(np.asarray(v, dtype=np.float32), len(points)) for v in (width, opacity)))


def pen(*strokes: Stroke, dots=None, colour="#000000") -> Layer:
    return Layer("pen", Strokes.of(strokes), dots or Dots.none(), colour)


def scribbles(seed: int, count=25, size=20.0) -> list[Stroke]:
    rng = np.random.default_rng(seed)
    lines = []
    for _ in range(count):
        n = int(rng.integers(2, 15))
        points = rng.uniform(-2, size + 2, 2) + np.cumsum(rng.normal(0, rng.choice([0.05, 1.0]), (n, 2)), axis=0)
        lines.append(line(points, rng.uniform(0, 0.8, n), rng.uniform(0, 1, n)))
    return lines


def ink(drawing: Drawing, dpi=DPI) -> float:
    """mm² of black."""
    image = rasterize_drawing(drawing, dpi).array[:, :, 0].astype(np.float64)
    return float((1 - image).sum()) * (25.4 / dpi) ** 2


def part_of_pixel(u, nx, ny):
    """Area of the unit square within signed distance u of its centre, normal (nx, ny): two boxes convolved, summed."""
    nx, ny = max(nx, 1e-5), max(ny, 1e-5)
    ramp = lambda x: np.maximum(x, 0) ** 2 / 2  # noqa: E731
    a, b = (nx + ny) / 2, (nx - ny) / 2
    return (ramp(u + a) - ramp(u + b) - ramp(u - b) + ramp(u - a)) / (nx * ny)


def slow(drawing: Drawing, dpi: float) -> np.ndarray:
    """The definition, a stroke and a segment at a time over the whole plate, in double precision."""
    width, height = raster.pixel_size(drawing, dpi)
    rgb = lambda c: np.array([int(c[i : i + 2], 16) for i in (1, 3, 5)]) / 255  # noqa: E731
    picture = np.broadcast_to(rgb(drawing.paper), (height, width, 3)).copy()
    x, y = np.meshgrid(np.arange(width) + 0.5, np.arange(height) + 0.5)
    for layer in drawing.layers:
        for stroke in layer.strokes:
            p, r = stroke.points.astype(float) * dpi / 25.4, stroke.width.astype(float) / 2 * dpi / 25.4
            o = stroke.opacity.astype(float)
            most = np.zeros((height, width))
            for i in range(len(p) - 1):
                d = p[i + 1] - p[i]
                t = np.clip(((x - p[i, 0]) * d[0] + (y - p[i, 1]) * d[1]) / max(d @ d, 1e-12), 0, 1)
                radius, opacity = r[i] + t * (r[i + 1] - r[i]), o[i] + t * (o[i + 1] - o[i])
                away = np.hypot(x - p[i, 0] - t * d[0], y - p[i, 1] - t * d[1])
                across = np.abs(d) / np.linalg.norm(d) if d @ d > 1e-12 else [0, 1]
                cover = part_of_pixel(radius - away, *across) - part_of_pixel(-radius - away, *across)
                most = np.maximum(most, cover * opacity)
            picture += most[..., None] * (rgb(layer.colour) - picture)
    return picture


@given(st.integers(0, 2**32 - 1))
@settings(max_examples=15, deadline=None)
def test_kernels_agree_with_the_definition(seed):
    drawing = plate(pen(*scribbles(seed)), pen(*scribbles(seed + 1, 5), colour="#c04020"), paper="#f8f0e0")
    with pytest.MonkeyPatch.context() as patch:
        patch.setattr(raster, "TOLERANCE", 0.0)
        patch.setattr(raster, "TILE", 16)
        fast = rasterize_drawing(drawing, 100).array[:, :, :3]
    # float32 places within a pixel: 1e-4 of one.
    np.testing.assert_allclose(fast, slow(drawing, 100), atol=1e-3)


@pytest.mark.parametrize("width", [0.02, 0.05, 0.1, 0.33, 1.0, 3.0])
@pytest.mark.parametrize("angle", [0, 13, 45])
def test_a_stroke_has_its_area(width, angle):
    way = 6 * np.array([np.cos(np.radians(angle)), np.sin(np.radians(angle))])
    middle = np.array([10, 10.03])
    stroke = line([middle - way, middle + way], width)
    cap = np.pi * (width / 2) ** 2  # less certain for thin lines, which fade over half a pixel
    assert ink(plate(pen(stroke))) == pytest.approx(12 * width + cap, abs=0.01 * 12 * width)


@pytest.mark.parametrize("diameter", [0.02, 0.06, 0.1, 0.13, 0.4, 2.0])
def test_dots_have_their_area(diameter):
    points = np.random.default_rng(0).uniform(2, 18, (400, 2)).astype(np.float32)
    each = [ink(plate(pen(dots=Dots(p[None], np.float32([diameter]), np.float32([1]))))) for p in points[:40]]
    assert np.mean(each) == pytest.approx(np.pi / 4 * diameter**2, rel=0.03)


def test_a_hairline_does_not_bead():
    """Along a thin slanted line the ink of each column is the same."""
    image = rasterize_drawing(plate(pen(line([[2, 5], [18, 9]], 0.04))), DPI).array[:, 30:170, 0]
    columns = (1 - image).sum(axis=0)
    assert columns.std() < 0.005 * columns.mean()


def test_joints_are_no_darker():
    t = np.linspace(0, 1, 400)
    drawing = plate(pen(line(np.stack([2 + 16 * t, 10 + 3 * np.sin(9 * t)], axis=1), 0.8, 0.4)))
    assert rasterize_drawing(drawing, DPI).array[:, :, 0].min() == pytest.approx(0.6, abs=1e-3)


def test_crossing_strokes_are_laid_over_each_other():
    drawing = plate(pen(line([[2, 10], [18, 10]], 1, 0.5), line([[10, 2], [10, 18]], 1, 0.5)))
    assert rasterize_drawing(drawing, DPI).array[100, 100, 0] == pytest.approx(0.25, abs=1e-6)


def test_layers_from_the_bottom_up():
    below, above = pen(line([[2, 10], [18, 10]], 2), colour="#ff0000"), pen(line([[2, 10], [18, 10]], 1), colour="#0000ff")
    image = rasterize_drawing(plate(below, above), DPI).bytes8
    assert image[100, 100].tolist() == [0, 0, 255, 255]
    assert image[107, 100].tolist() == [255, 0, 0, 255]


def test_opacity_runs_evenly_along_a_stroke():
    image = rasterize_drawing(plate(pen(line([[2, 10], [18, 10]], 1, [0, 1]))), DPI).array[100, 20:180, 0]
    np.testing.assert_allclose(1 - image, (np.arange(160) + 0.5) / 160, atol=1e-4)


def test_pixels_do_not_depend_on_threads_or_tiles(monkeypatch):
    drawing = plate(pen(*scribbles(3, 200), dots=Dots(*map(np.float32, ([[5, 5], [9, 12]], [1, 2], [1, 0.3])))))
    pictures = []
    for threads, tile in ((1, 64), (2, 64), (3, 16), (1, 1000)):
        monkeypatch.setenv("INTAGLIO_THREADS", str(threads))
        monkeypatch.setattr(raster, "TILE", tile)
        pictures.append(rasterize_drawing(drawing, 150).array)
    assert pictures[0].tobytes() == pictures[1].tobytes()
    np.testing.assert_allclose(pictures[0], pictures[2], atol=1e-4)
    np.testing.assert_allclose(pictures[0], pictures[3], atol=1e-4)


def test_bytes_are_the_rounded_picture():
    drawing = plate(pen(*scribbles(1)), paper="#f0e0d0")
    np.testing.assert_array_equal(drawing_bytes8(drawing, 150), rasterize_drawing(drawing, 150).bytes8[:, :, :3])


def test_strokes_may_leave_the_paper():
    far = plate(pen(line([[-5000, 10], [5000, 10]], 1), line([[-50, -50], [-40, -40]], 1), line([[30, 5], [40, 6]], 3)))
    assert ink(far) == pytest.approx(20, rel=1e-3)
    assert ink(plate(pen(line([[10, 10], [10.1, 10]], 500)))) == pytest.approx(400, rel=1e-6)


def test_zero_length_and_empty():
    assert ink(plate()) == 0
    assert ink(plate(pen())) == 0
    assert ink(plate(pen(line([[10, 10], [10, 10]], 1)))) == pytest.approx(np.pi / 4, rel=0.02)


def test_size_is_the_paper_at_the_resolution():
    assert rasterize_drawing(plate(size=(25.4, 50.8)), 100).array.shape == (200, 100, 4)
    assert rasterize_drawing(plate(size=(0.1, 0.1)), 10).array.shape == (1, 1, 4)


@pytest.mark.parametrize("dpi", [0, 9, 2401, -1, float("nan"), float("inf")])
def test_resolution_is_checked(dpi):
    with pytest.raises(InputError, match="dpi must be between 10 and 2400"):
        rasterize_drawing(plate(), dpi)


def test_too_many_pixels_are_refused():
    with pytest.raises(InputError, match=r"dpi must be at most \d+ for a plate of 1000 x 1000 mm, not 1200"):
        rasterize_drawing(plate(size=(1000.0, 1000.0)), 1200)
