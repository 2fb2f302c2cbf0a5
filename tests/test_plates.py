"""Saved plates: SVG, PDF and PNG show the same, are the same every time, and appear whole or not at all."""

import io
import os
import re
import stat
import struct
import xml.etree.ElementTree as ET

import numpy as np
import pytest
from PIL import Image as Pillow

from intaglio import Drawing, Image, InputError
from intaglio.drawing import Dots, Layer, Stroke, Strokes
from intaglio.io import plates
from intaglio.io.pdf import pdf_bytes
from intaglio.io.plates import check_output
from intaglio.io.png import png_bytes
from intaglio.io.svg import svg_text

SVG = "{http://www.w3.org/2000/svg}"
INKSCAPE = "{http://www.inkscape.org/namespaces/inkscape}"


def curves(seed: int, count: int, size=127.0, even=False) -> Strokes:
    """Strokes that bend, swell and fade."""
    rng = np.random.default_rng(seed)
    strokes, n = [], 40
    for _ in range(count):
        angle = rng.uniform(0, 6.3) + np.cumsum(rng.normal(0, 0.1, n) + rng.normal(0, 0.06))
        points = rng.uniform(0, size, 2) + np.cumsum(np.stack([np.cos(angle), np.sin(angle)], axis=1), axis=0)
        t = np.linspace(0, np.pi, n)
        width = rng.uniform(0.1, 0.8) * (np.ones(n) if even else np.sin(t) ** 0.7)
        opacity = np.clip(rng.uniform(0.3, 1) + (0 if even else 0.2) * np.sin(rng.uniform(1, 4) * t), 0, 1)
        strokes.append(Stroke(*(a.astype(np.float32) for a in (points, width, opacity))))
    return Strokes.of(strokes)


@pytest.fixture(scope="module")
def plate() -> Drawing:
    rng = np.random.default_rng(0)
    dots = Dots(*map(np.float32, (rng.uniform(0, 127, (300, 2)), rng.uniform(0.1, 1.5, 300), rng.uniform(0.2, 1, 300))))
    layers = (
        Layer("dark", curves(1, 200)),
        Layer("red & <bright>", curves(2, 60), dots, "#a03020"),
        Layer("lines", curves(3, 60, even=True), colour="#203060"),
        Layer("empty"),
    )
    return Drawing(layers, 127.0, 127.0, "#fbf7ee", 'Plate "I" \x00& <Ⅱ>')


def blocks(pixels) -> np.ndarray:
    """Means of 8 x 8 pixels, 0..255."""
    a = np.asarray(pixels, dtype=np.float64)[:496, :496, :3]
    return a.reshape(62, 8, 62, 8, 3).mean(axis=(1, 3))


def test_svg_shows_what_png_shows(plate):
    resvg = pytest.importorskip("resvg_py")
    theirs = Pillow.open(io.BytesIO(resvg.svg_to_bytes(svg_string=svg_text(plate), dpi=100)))
    assert theirs.size == (500, 500)
    agree(blocks(plate.image(100).bytes8), blocks(theirs))


def test_pdf_shows_what_png_shows(plate):
    pdfium = pytest.importorskip("pypdfium2")
    document = pdfium.PdfDocument(pdf_bytes(plate))
    theirs = document[0].render(scale=100 / 72).to_pil()
    document.close()
    assert theirs.size == (500, 500)
    agree(blocks(plate.image(100).bytes8), blocks(theirs))


def agree(ours, theirs):
    """Opacity runs in steps of 1/16 there, so that it is off by half of one at most: 8 of 255 where all is ink.

    Over a plate that and the noise of others' antialiasing average out.
    """
    difference = ours - theirs
    assert abs(difference.mean()) < 0.2
    assert difference.std() < 1
    assert np.abs(difference).max() < 8


def test_agreement_would_notice_a_missing_layer(plate):
    fewer = Drawing(plate.layers[:2], plate.width_mm, plate.height_mm, plate.paper)
    with pytest.raises(AssertionError):
        agree(blocks(plate.image(100).bytes8), blocks(fewer.image(100).bytes8))


def test_a_stroke_has_its_area_in_svg():
    resvg = pytest.importorskip("resvg_py")
    points = np.float32([[2, 10], [18, 10]])
    tapered = Stroke(points, np.float32([0, 2]), np.float32([1, 1]))
    even = Stroke(points + np.float32([0, 5]), np.float32([0.5, 0.5]), np.float32([1, 1]))
    drawing = Drawing((Layer("pen", Strokes.of([tapered, even])),), 20, 20)
    picture = Pillow.open(io.BytesIO(resvg.svg_to_bytes(svg_string=svg_text(drawing), dpi=508))).convert("L")
    ink = (1 - np.asarray(picture) / 255).sum() * 0.05**2
    assert ink == pytest.approx(16 * 1 + np.pi / 2 + 16 * 0.5 + np.pi / 4 * 0.25, rel=0.01)


@pytest.mark.parametrize("plotter", [False, True])
def test_svg_is_layers_of_paths_in_millimetres(plate, plotter):
    root = ET.fromstring(svg_text(plate, plotter=plotter))
    assert (root.get("width"), root.get("height"), root.get("viewBox")) == ("127mm", "127mm", "0 0 127 127")
    assert root.findtext(f"{SVG}title") == 'Plate "I" & <Ⅱ>'
    layers = [g for g in root if g.get(f"{INKSCAPE}groupmode") == "layer"]
    names = [g.get(f"{INKSCAPE}label") for g in layers]
    assert names == ([] if plotter else ["paper"]) + ["dark", "red & <bright>", "lines", "empty"]
    kinds = {e.tag.removeprefix(SVG) for e in root.iter()}
    assert kinds == {"svg", "title", "g", "path", "circle"} | (set() if plotter else {"rect"})
    for path in root.iter(f"{SVG}path"):
        assert re.fullmatch(r"m-?\d+( ?-?\d+)+z?", path.get("d"))


def test_plotter_draws_each_stroke_once_along_its_axis(plate):
    root = ET.fromstring(svg_text(plate, plotter=True))
    layer = next(g for g in root if g.get(f"{INKSCAPE}label") == "lines")
    paths = list(layer.iter(f"{SVG}path"))
    strokes = plate.layers[2].strokes
    assert len(paths) == len(strokes)
    for path, stroke in zip(paths, strokes, strict=True):
        numbers = np.array(re.findall(r"-?\d+", path.get("d")), dtype=float).reshape(-1, 2)
        line = np.cumsum(numbers, axis=0) / 100
        np.testing.assert_allclose(line[[0, -1]], stroke.points[[0, -1]], atol=0.006)
        assert "z" not in path.get("d")
    assert "opacity" not in ET.tostring(root, encoding="unicode")


def test_same_bytes_every_time(plate, tmp_path, monkeypatch):
    for extension in ("svg", "pdf", "png"):
        files = []
        for threads in ("1", "2", "2"):
            monkeypatch.setenv("INTAGLIO_THREADS", threads)
            plate.save(tmp_path / f"plate.{extension}", dpi=100)
            files.append((tmp_path / f"plate.{extension}").read_bytes())
        assert files[0] == files[1] == files[2]


def test_pdf_is_a_page_of_the_plates_size_without_raster(plate):
    pdfium = pytest.importorskip("pypdfium2")
    data = pdf_bytes(plate)
    assert b"/Subtype /Image" not in data
    document = pdfium.PdfDocument(data)
    assert len(document) == 1
    assert document[0].get_size() == pytest.approx((360, 360), abs=0.02)
    assert document.get_metadata_value("Title") == 'Plate "I" & <Ⅱ>'
    document.close()


def test_notebooks_show_drawings(plate):
    assert plate._repr_svg_() == svg_text(plate)
    assert Pillow.open(io.BytesIO(plate._repr_png_())).size == (750, 750)


DEGENERATE = {
    "no layers": (),
    "empty layer": (Layer(""),),
    "no length": (Layer("a", Strokes.of([Stroke(np.zeros((2, 2), np.float32), np.float32([1, 1]), np.float32([1, 0.2]))])),),
    "no width": (Layer("a", Strokes.of([Stroke(np.float32([[1, 1], [5, 5]]), np.float32([0, 0]), np.float32([1, 1]))])),),
    "no opacity": (Layer("a", Strokes.of([Stroke(np.float32([[1, 1], [5, 5]]), np.float32([1, 1]), np.float32([0, 0]))])),),
    "huge": (Layer("a", Strokes.of([Stroke(np.float32([[-9e4, 1], [9e4, 5]]), np.float32([9e4, 0]), np.float32([0, 1]))])),),
    "dot of nothing": (Layer("a", dots=Dots(np.float32([[1, 1]]), np.float32([0]), np.float32([0.001]))),),
    "odd name": (Layer("\ud800\x1b<é\n", curves(0, 2)),),
}


@pytest.mark.parametrize("layers", DEGENERATE.values(), ids=DEGENERATE)
@pytest.mark.parametrize("size", [(10, 10), (0.1, 0.1), (9000, 50)])
def test_degenerate_drawings_can_be_saved(layers, size, tmp_path):
    drawing = Drawing(layers, *size)
    for name in ("a.svg", "a.pdf", "a.png"):
        drawing.save(tmp_path / name, dpi=20)
        assert (tmp_path / name).stat().st_size > 60
    drawing.save(tmp_path / "b.svg", plotter=True)
    ET.parse(tmp_path / "a.svg")
    ET.parse(tmp_path / "b.svg")


@pytest.mark.parametrize("extension", ["svg", "pdf", "png"])
def test_nan_is_refused(extension, tmp_path):
    strokes = Strokes.of([Stroke(np.float32([[np.nan, 1], [5, 5]]), np.float32([1, 1]), np.float32([1, 1]))])
    with pytest.raises(InputError, match="strokes of layer 'a' must have finite positions"):
        Drawing((Layer("a", strokes),), 10, 10).save(tmp_path / f"a.{extension}")
    assert list(tmp_path.iterdir()) == []


def picture(channels: str, levels: int) -> Image:
    rng = np.random.default_rng(0)
    array = np.ones((20, 30, 4), dtype=np.float32)
    array[:, :, :3] = rng.integers(0, levels + 1, (20, 30, 1 if channels == "grey" else 3)) / levels
    if channels == "RGBA":
        array[:, :, 3] = rng.integers(0, levels + 1, (20, 30)) / levels
    return Image(array, dpi=300)


@pytest.mark.parametrize(("channels", "mode"), [("grey", "L"), ("RGB", "RGB"), ("RGBA", "RGBA")])
def test_png_of_8_bits(channels, mode):
    image = picture(channels, 255)
    file = Pillow.open(io.BytesIO(png_bytes(image)))
    assert file.mode == mode
    assert file.info["dpi"] == pytest.approx((300, 300), abs=0.1)
    np.testing.assert_array_equal(np.asarray(file.convert("RGBA")), image.bytes8)


@pytest.mark.parametrize(("channels", "colour_type"), [("grey", 0), ("RGB", 2), ("RGBA", 6)])
def test_png_of_16_bits(channels, colour_type):
    image = picture(channels, 65535)
    data = png_bytes(image, 16)
    assert struct.unpack(">IIBB", data[16:26]) == (30, 20, 16, colour_type)
    file = Pillow.open(io.BytesIO(data))
    assert file.info["dpi"] == pytest.approx((300, 300), abs=0.1)
    if channels == "grey":
        np.testing.assert_array_equal(np.asarray(file), np.rint(image.array[:, :, 0] * 65535))
    else:
        # Pillow keeps the upper byte.
        np.testing.assert_array_equal(np.asarray(file.convert("RGBA")), np.rint(image.array * 65535).astype(int) >> 8)


def test_images_are_saved_as_png_only(tmp_path):
    image = picture("RGB", 255)
    image.save(tmp_path / "a.png", bits=16)
    assert (tmp_path / "a.png").read_bytes() == png_bytes(image, 16)
    with pytest.raises(InputError, match=r"output must end in \.png, not 'a\.svg'"):
        image.save(tmp_path / "a.svg")
    with pytest.raises(InputError, match="bits must be 8 or 16, not 12"):
        image.save(tmp_path / "a.png", bits=12)


def test_outputs_are_checked(tmp_path, monkeypatch):
    assert check_output(str(tmp_path / "A.SVG")) == tmp_path / "A.SVG"
    with pytest.raises(InputError, match=r"output must end in \.svg, \.pdf or \.png, not 'a\.gif'"):
        check_output(tmp_path / "a.gif")
    with pytest.raises(InputError, match=r"output folder .*none does not exist: create it first"):
        check_output(tmp_path / "none" / "a.svg")
    (tmp_path / "b.svg").mkdir()
    with pytest.raises(InputError, match="is a folder"):
        check_output(tmp_path / "b.svg")
    with pytest.raises(InputError, match="cannot be written"):
        check_output(tmp_path / ("x" * 300 + ".svg"))
    (tmp_path / "c.svg").touch()
    monkeypatch.setattr(os, "access", lambda path, mode: not str(path).endswith("c.svg"))
    with pytest.raises(InputError, match="write-protected"):
        check_output(tmp_path / "c.svg")
    monkeypatch.setattr(os, "access", lambda path, mode: False)
    with pytest.raises(InputError, match="is not writable"):
        check_output(tmp_path / "a.svg")
    monkeypatch.undo()
    with pytest.raises(InputError, match=r"plotter output must be \.svg"):
        Drawing((), 1, 1).save(tmp_path / "a.png", plotter=True)


@pytest.mark.parametrize(
    ("error", "seen", "message"),
    [(KeyboardInterrupt, KeyboardInterrupt, None), (OSError(28, "No space left on device"), InputError, "No space left")],
)
def test_interrupted_save_leaves_what_was_there(error, seen, message, tmp_path, monkeypatch):
    target = tmp_path / "a.svg"
    target.write_text("before")

    def fail(*_):
        assert len(list(tmp_path.iterdir())) == 2
        raise error

    monkeypatch.setattr(plates.os, "replace", fail)
    with pytest.raises(seen, match=message):
        Drawing((), 1, 1).save(target)
    assert target.read_text(encoding="utf-8") == "before"
    assert [f.name for f in tmp_path.iterdir()] == ["a.svg"]


def test_files_follow_the_umask(tmp_path):
    before = os.umask(0o027)
    try:
        Drawing((), 1, 1).save(tmp_path / "a.svg")
    finally:
        os.umask(before)
    assert stat.S_IMODE((tmp_path / "a.svg").stat().st_mode) == 0o640
