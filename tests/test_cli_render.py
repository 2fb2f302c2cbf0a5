"""`intaglio render`, over the input it is for and some that it is not."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
import typer
from test_cli import ball, folder, run, scan, write_scan  # noqa: F401

import intaglio as ig
from intaglio.cli import app

SMALL = ("--size", 40)


def pixels(path: str | Path = "picture.png") -> np.ndarray:
    return np.asarray(PIL.Image.open(path).convert("RGBA"))


def rendered(path: Path, *args: object, size: int | str = 40, **env: str) -> np.ndarray:
    done = run("render", path, "--size", size, *args, **env)
    assert done.code == 0, done.err
    return pixels()


RENDERED = [
    "",
    "-o head.PNG",
    "--output head.png --bits 16",
    "--preset mr-default",
    "--tf ct-bone",
    "--islands 0.2 --tf mr-default",
    "--iso 300",
    "--iso 300:#ff8000:0.4 --iso 700",
    "--mode MIP",
    "--islands 0.2 --mode isosurface",
    *(f"--mode {mode}" for mode in ("mip", "minip", "average", "isosurface")),
    "--mode mip --preset mr-angiography",
    "--mode isosurface --iso 300:#ff8000:0.3 --iso 7e2:#ffffff:1",
    *(f"--classify {when}" for when in ("pre", "post", "preintegrated")),
    "--step 1 --unlit",
    "--interpolation tricubic",
    *(f"--gradient {source}" for source in ("central", "cell", "tricubic")),
    "--gradient central --reach 2",
    "--preset mr-default --emphasis 5:50",
    "--cut plane:left --ghost 0.5",
    "--background #102030",
    "--background transparent",
    "--view anterior-left --perspective 40 --zoom 2 --roll -30 --light 1,1,1",
    "--view=-0.3,1,-.5 --distance 80",
    "--spacing 1,1,2.5",
]


@pytest.mark.parametrize("line", RENDERED)
def test_render(line: str, scan: Path, folder: Path):  # noqa: F811
    done = run("render", scan, *SMALL, *line.split())
    assert done.code == 0
    assert all(text.startswith(("note: ", "Compiling ")) for text in done.err.splitlines()), done.err
    (path,) = folder.iterdir()
    assert path.read_bytes().startswith(b"\x89PNG")
    bits = 16 if "--bits 16" in line else 8
    numbers = r"\d+\.\d\d s \(reading [\d.]+, preparing [\d.]+, rendering [\d.]+, writing [\d.]+\)"
    assert re.fullmatch(rf"{re.escape(path.name)}  \d+ x \d+ pixels, {bits} bits, {numbers}\n", done.out)
    picture = pixels(path)
    assert max(picture.shape[:2]) == 40
    assert (picture != picture[0, 0]).any()


@pytest.mark.parametrize(
    "line",
    [
        *("--preset mr-angiography", "--mode mip", "--mode isosurface", "--step 8", "--unlit", "--background #ff0000"),
        *("--view left", "--perspective 90", "--zoom 2", "--roll 45", "--light 1,-1,0.2", "--classify preintegrated --step 4"),
    ],
)
def test_each_option_changes_the_picture(line: str, scan: Path, folder: Path):  # noqa: F811
    base = rendered(scan, size="40x40")
    assert (rendered(scan, *line.split(), size="40x40") != base).any()


def test_the_picture_is_that_of_the_library(scan: Path, folder: Path):  # noqa: F811
    got = rendered(scan, "--mode", "mip", "--view", "left", "--background", "#000000", size="30x20")
    volume = ig.read_volume(scan)
    camera = ig.Camera.looking("left", volume, (30, 20))
    want = ig.render(volume, None, camera, mode="mip", background=(0, 0, 0, 1))
    np.testing.assert_array_equal(got, want.bytes8)


def test_a_transfer_function_from_a_file(scan: Path, folder: Path):  # noqa: F811
    tf = ig.TransferFunction.from_points([(200, "#ff0000", 0.0), (900, "#ff0000", 0.8)])
    for name in ("red.vp.json", "red.json"):
        tf.write(name)
        picture = rendered(scan, "--tf", name, "--unlit").astype(int)
        seen = (picture[..., :3] != 255).any(axis=2)
        assert 0.2 < seen.mean() < 0.95
        assert (picture[seen][:, 0] >= 254).all()


def test_sizes(scan: Path, folder: Path):  # noqa: F811
    assert rendered(scan, size="31x17").shape[:2] == (17, 31)
    assert max(rendered(scan, size="29").shape[:2]) == 29


def test_transparent_paper_is_in_the_file(scan: Path, folder: Path):  # noqa: F811
    picture = rendered(scan, "--background", "transparent")
    assert picture[0, 0, 3] == 0
    assert picture[..., 3].max() > 250


def test_sixteen_bits_hold_more(scan: Path, folder: Path):  # noqa: F811
    assert run("render", scan, *SMALL, "--mode", "mip", "--bits", 16, "--background", "#000000").code == 0
    with PIL.Image.open("picture.png") as picture:
        assert picture.mode.startswith("I;16")
        # Eight bits in a file of sixteen would be multiples of 257.
        assert (np.asarray(picture) % 257 != 0).any()


def test_what_is_shown_unasked_is_named(scan: Path, folder: Path, tmp_path: Path):  # noqa: F811
    note = run("render", scan, *SMALL).err
    assert re.search(r"note: no --tf given; showing mr-default, from \d+\.?\d*, .+, to 1000\n", note)
    hounsfield = write_scan(tmp_path / "hu.nii.gz", (ball() * 2 - 1000).astype(np.int16))
    note = run("render", hounsfield, *SMALL).err
    assert note == "note: no --tf given; showing ct-bone, for the values are Hounsfield units\n"
    note = run("render", scan, *SMALL, "--mode", "isosurface").err
    assert re.search(r"note: no --iso given; showing \d+", note)
    assert run("render", scan, *SMALL, "--mode", "mip").err == ""


def test_an_empty_picture_is_remarked(scan: Path, folder: Path, tmp_path: Path):  # noqa: F811
    flat = write_scan(tmp_path / "flat.nii", np.full((5, 5, 5), -50, np.int16))
    done = run("render", flat, *SMALL, "--preset", "ct-bone")
    assert done.code == 0
    assert done.err.startswith("note: the picture is empty;")


def test_the_nose_points_where_the_view_says(scan: Path, folder: Path):  # noqa: F811
    """Seen from the left the front is on the left: there the body is lowest."""
    for view, side in (("left", 0), ("right", -1)):
        seen = (rendered(scan, "--view", view, "--mode", "isosurface")[..., :3] != 255).any(axis=2)
        heights = seen.sum(axis=0)[seen.any(axis=0)]
        half = len(heights) // 2
        parts = heights[:half].sum(), heights[-half:].sum()
        assert parts[side] == min(parts)


def test_bytes_are_the_same_on_any_number_of_threads(scan: Path, folder: Path):  # noqa: F811
    shots = []
    for threads in "12":
        rendered(scan, size=100, INTAGLIO_THREADS=threads)
        shots.append(Path("picture.png").read_bytes())
    assert shots[0] == shots[1]


BAD = [
    ("-o picture.jpg", 2, "'--output': must end in .png, not 'picture.jpg'"),
    ("-o nowhere/picture.png", 1, "output folder nowhere does not exist"),
    ("--mode xray", 2, "'--mode': must be one of emission-absorption, mip, minip, average, isosurface, not 'xray'"),
    ("--classify late", 2, "'--classify': must be one of pre, post, preintegrated, not 'late'"),
    ("--interpolation linear", 2, "'--interpolation': must be one of trilinear, tricubic, not 'linear'"),
    ("--interpolation tricubic --classify pre", 2, "'--interpolation': tricubic needs --mode emission-absorption"),
    ("--gradient sobel", 2, "'--gradient': must be one of central, cell, tricubic, not 'sobel'"),
    ("--emphasis 30", 2, "'--emphasis': must be LOW:HIGH"),
    ("--emphasis 30:10", 2, "'--emphasis': must be LOW:HIGH"),
    ("--emphasis 1:9 --mode mip", 2, "'--emphasis': needs --mode emission-absorption"),
    ("--tf bone", 2, "'--tf': must be one of ct-skin, "),
    ("--preset ct-bone --tf a.json", 2, "can be given only once"),
    ("--mode isosurface --preset ct-bone", 2, "'--mode': cannot be isosurface with a transfer function"),
    ("--iso 300:#ffffff:1 --mode mip", 2, "'--iso': cannot be given with --tf, nor with another --mode"),
    ("--iso 300 --tf ct-bone", 2, "'--iso': cannot be given with --tf"),
    ("--iso 300:#ffffff:1:2", 2, "'--iso': must be VALUE, VALUE:#rrggbb or"),
    ("--mode isosurface --iso x:#ffffff:1", 2, "not 'x:#ffffff:1'"),
    ("--mode isosurface --iso nan:#ffffff:1", 2, "not 'nan:#ffffff:1'"),
    ("--mode isosurface --iso 300:white:1", 2, "not '300:white:1'"),
    ("--mode isosurface --iso 300:#ffffff:2", 2, "not '300:#ffffff:2'"),
    ("--mode isosurface --iso 5000:#ffffff:1", 1, "iso must be within the volume's values, above 0 up to 1000, not 5000.0"),
    ("--tf missing.json", 1, "missing.json cannot be read"),
    ("--islands 0.1 --mode mip", 2, "'--islands': cannot be left out with --mode mip"),
    ("--islands 2", 2, "'--islands': must be a number, 0 to 1, not '2'"),
    ("--step 0", 2, "'--step': must be a number, 0.01 to 16, not '0'"),
    ("--step nan", 2, "'--step': must be a number, 0.01 to 16, not 'nan'"),
    ("--bits 12", 2, "'--bits': must be 8 or 16, not 12"),
    ("--background white", 2, "'--background': must be #rrggbb or transparent, not 'white'"),
    ("--size 0", 2, "'--size': must be N or WxH, 1 to 32768 pixels, not '0'"),
    ("--size 10x20x30", 2, "'--size': must be N or WxH, 1 to 32768 pixels, not '10x20x30'"),
    ("--size big", 2, "not 'big'"),
    ("--view above", 2, "view must be one of anterior"),
    ("--light 0,0,0", 2, "light direction must be three numbers that are not all zero"),
    ("--light 1,1", 2, "'--light': must be three numbers"),
]


@pytest.mark.parametrize(("line", "code", "words"), BAD, ids=[line for line, _, _ in BAD])
def test_bad_options_are_one_line(line: str, code: int, words: str, scan: Path, folder: Path):  # noqa: F811
    done = run("render", scan, *([] if "--size" in line else SMALL), *line.split())
    assert done.code == code
    assert done.out == ""
    (message,) = [text for text in done.err.splitlines() if not text.startswith("note: ")]
    assert message.startswith("error: ")
    assert words in message
    assert list(folder.iterdir()) == []


class TestHelp:
    def test_teaches_by_examples_that_work(self):
        command = typer.main.get_command(app).commands["render"]  # type: ignore[attr-defined]
        examples = re.findall(r"^`intaglio render(.*)`$", command.help, re.M)
        assert len(examples) >= 4
        for example in examples:
            assert len(example) < 70, "wraps in a terminal of 80 columns"
            command.make_context("render", example.split())

    @pytest.mark.parametrize("columns", [40, 80])
    def test_fits_the_terminal(self, columns: int):
        page = run("render", "--help", COLUMNS=str(columns))
        assert page.code == 0
        assert max(len(line) for line in page.out.splitlines()) <= columns
