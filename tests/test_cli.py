"""Every command, over the input it is for."""

from __future__ import annotations

import contextlib
import io
import os
import re
import subprocess
import sys
from collections.abc import Callable, Iterator
from contextlib import redirect_stderr, redirect_stdout
from dataclasses import fields
from pathlib import Path
from typing import NamedTuple
from unittest import mock

import numpy as np
import PIL.Image
import pytest
import SimpleITK as sitk
import typer
from numpy.typing import NDArray

import intaglio
from intaglio.cli import app, main
from intaglio.cli.console import COMPILING
from intaglio.ink.styles import STYLES, Hatching, styles

POSIX = os.name == "posix"
COMMANDS = ("demo", "info", "hatch", "contour", "turntable", "render", "surface", "voxelize", "distance", "combine")
COLOURS = ("FORCE_COLOR", "NO_COLOR", "TTY_COMPATIBLE", "TTY_INTERACTIVE", "GITHUB_ACTIONS")


class Run(NamedTuple):
    code: int
    out: str
    err: str


def plain(text: str) -> str:
    return re.sub(r"\x1b\[[0-9;?]*[A-Za-z]", "", text)


def run(*args: object, **env: str) -> Run:
    """The command in this process."""
    out, err = io.StringIO(), io.StringIO()
    inherited = {k: v for k, v in os.environ.items() if k not in COLOURS}
    with (
        mock.patch.object(sys, "argv", ["intaglio", *map(str, args)]),
        mock.patch.object(sys, "excepthook", sys.excepthook),
        mock.patch.dict(os.environ, {**inherited, "COLUMNS": "100", **env}, clear=True),
        redirect_stdout(out),
        redirect_stderr(err),
        pytest.raises(SystemExit) as stop,
    ):
        main()
    return Run(stop.value.code, plain(out.getvalue()), plain(err.getvalue()))


def process(*args: object, **env: str) -> Run:
    """The command as the shell starts it."""
    code = "from intaglio.cli import main; main()"
    inherited = {k: v for k, v in os.environ.items() if k not in COLOURS}
    done = subprocess.run(
        [sys.executable, "-c", code, *map(str, args)], env=inherited | env, capture_output=True, encoding="utf-8", check=False
    )
    return Run(done.returncode, done.stdout, done.stderr)


def ball() -> NDArray[np.int16]:
    """(24, 26, 28): an egg of 1000 in 0, with a nose to the front (+y), its edge soft."""
    z, y, x = np.mgrid[:24, :26, :28].astype(float)
    egg = np.sqrt((x - 13.5) ** 2 + 1.2 * (y - 11) ** 2 + (z - 11.5) ** 2) - 8.5
    nose = np.sqrt((x - 13.5) ** 2 + (y - 20) ** 2 + (z - 11.5) ** 2) - 3.0
    return np.rint(1000 / (1 + np.exp(2 * np.minimum(egg, nose)))).astype(np.int16)


def write_scan(path: Path, array: NDArray[np.generic]) -> Path:
    image = sitk.GetImageFromArray(array)
    # To the right, anterior, superior, in SimpleITK's terms.
    image.SetDirection((-1, 0, 0, 0, -1, 0, 0, 0, 1))
    sitk.WriteImage(image, str(path))
    return path


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scan(tmp_path_factory.mktemp("scan") / "egg.nii.gz", ball())


@pytest.fixture
def folder(tmp_path: Path) -> Iterator[Path]:
    (tmp_path / "out").mkdir()
    before = Path.cwd()
    os.chdir(tmp_path / "out")
    yield tmp_path / "out"
    os.chdir(before)


def plate(scan: Path, *args: object, extension: str = ".svg", **env: str) -> bytes:
    """The bytes of a small plate."""
    path = Path("compared" + extension)
    size = [] if "--width" in args else SMALL.split()
    assert run("hatch", scan, *size, "-o", path, *args, **env).code == 0
    return path.read_bytes()


SMALL = "--width 30"
HATCHED = [
    "hatch {scan}",
    "hatch {scan} -o plate.svg",
    "hatch {scan} -o plate.SVG",
    "hatch {scan} -o plate.pdf",
    "hatch {scan} -o plate.png --dpi 60",
    "hatch {scan} --output plate.svg --plotter",
    *(f"hatch {{scan}} --style {name}" for name in styles()),
    "hatch {scan} --hand-increment 4 --hand-deviation 1 -o plate.png --dpi 60 --brush charcoal --grain 1",
    *(f"hatch {{scan}} --view {name}" for name in ("anterior", "posterior", "left", "right", "superior", "inferior")),
    "hatch {scan} --view anterior-left",
    "hatch {scan} --view Posterior-Right-Superior",
    "hatch {scan} --view -1,0,0",
    "hatch {scan} --view=-0.3,1,-.5",
    "hatch {scan} --iso 300",
    "hatch {scan} --iso 1e2",
    "hatch {scan} --light -1,1,1",
    "hatch {scan} --light 0,-1,0.5",
    "hatch {scan} --perspective 40",
    "hatch {scan} --distance 60",
    "hatch {scan} --perspective 90 --distance 300",
    "hatch {scan} --zoom 2 --roll -30",
    "hatch {scan} --islands 0",
    "hatch {scan} --seed 7",
    "hatch {scan} --spacing 1,1,2.5",
    "hatch {scan} --spacing 0.5",
    "hatch {scan} --crosshatch 2 --separation 1.5 --ink #0000ff --paper #fffff0 --contour 0 --contour-shortest 0",
    "hatch {raw} --raw 28x26x24,int16 --spacing 1,1,1.5",
    "hatch {raw} --raw 28x26x24,<i2",
]


HATCHED += [
    "contour {scan}",
    "contour {scan} -o plate.pdf --style charcoal --no-hand --ridge 0",
    "contour {scan} --hand -o plate.png --dpi 60 --view left --cut plane:superior",
    "contour {scan} --hand-points 4 --hand-rotation 13 --contour 0.2 --plotter",
]


@pytest.mark.parametrize("line", HATCHED)
def test_hatch(line: str, scan: Path, folder: Path, tmp_path: Path):
    raw = tmp_path / "egg.raw"
    ball().tofile(raw)
    done = run(*line.format(scan=scan, raw=raw).split(), *SMALL.split())
    assert done.code == 0
    assert all(text.startswith(("note: ", "Compiling ")) for text in done.err.splitlines()), done.err
    (path,) = folder.iterdir()
    magic = {".svg": b"<?xml", ".pdf": b"%PDF", ".png": b"\x89PNG"}[path.suffix.lower()]
    assert path.read_bytes().startswith(magic)
    assert re.fullmatch(rf"{re.escape(path.name)}  30 x \d+ mm, [1-9]\d* strokes, \d+\.\d\d s \(reading .*\)\n", done.out)


@pytest.mark.parametrize(
    ("one", "other"),
    [
        ("--view left", "--view -1,0,0"),
        ("--view anterior-left", "--view -2,2,0"),
        ("--view Superior", "--view superior"),
        ("--iso 500", "--iso 5e2"),
        ("--style pencil", "--style pencil --seed 0 --zoom 1 --roll 0 --dpi 300"),
        ("--light -1,1,1", "--light -2,2,2"),
    ],
)
def test_two_ways_to_say_the_same(one: str, other: str, scan: Path, folder: Path):
    assert plate(scan, *one.split(), "--dpi", 300, extension=".png") == plate(scan, *other.split(), extension=".png")


@pytest.mark.parametrize(
    "line",
    [
        *("--view left", "--iso 200", "--light 1,-1,1", "--perspective 60", "--zoom 2", "--roll 90", "--style engraving"),
        *("--seed 1", "--width 80", "--size 256", "--plotter", "--wobble 1", "--layers 1", "--ink #ff0000", "--spacing 1,1,3"),
    ],
)
def test_each_option_changes_the_plate(line: str, scan: Path, folder: Path):
    assert plate(scan, *line.split()) != plate(scan)


@pytest.mark.parametrize(("view", "low", "high"), [("left", 0, 0.45), ("right", 0.55, 1), ("anterior", 0.4, 0.6)])
def test_views_show_the_side_that_they_name(view: str, low: float, high: float, scan: Path, folder: Path):
    """The nose points to the front: seen from the left it is on the left, so most of the head is on the right."""
    plate(scan, "--view", view, "--dpi", 100, "--no-hand", extension=".png")
    picture = np.asarray(PIL.Image.open("compared.png").convert("L"))
    columns = np.flatnonzero((picture < 128).any(axis=0))
    heights = [np.ptp(np.flatnonzero(picture[:, column] < 128)) for column in columns]
    assert low <= 1 - np.argmax(heights) / len(columns) <= high


@pytest.mark.parametrize("options", ["--spacing 0.25,1,1", "--width 120"])
def test_tall_and_large_paper_gets_as_many_rays_a_millimetre(options: str, scan: Path, folder: Path):
    """With fewer the lines of a style would be nearer than pixels."""
    assert run("hatch", scan, *(["--width", 60] if "--width" not in options else []), *options.split()).code == 0


def test_the_surface_is_named_when_none_was_asked_for(scan: Path, folder: Path):
    done = run("hatch", scan, *SMALL.split(), "-o", "one.png")
    found = re.fullmatch(r"note: no --iso given; drawing (\d+\.?\d*), .+\n", done.err)
    assert found
    assert 100 < float(found[1]) < 900
    again = run("hatch", scan, *SMALL.split(), "-o", "two.png", "--iso", found[1])
    assert again.err == ""
    assert Path("one.png").read_bytes() == Path("two.png").read_bytes()
    assert found[1] in run("info", scan).out


@pytest.mark.parametrize("extension", [".svg", ".pdf", ".png"])
def test_a_plate_is_the_same_on_any_number_of_threads(extension: str, scan: Path, folder: Path):
    one, two = (plate(scan, extension=extension, INTAGLIO_THREADS=threads) for threads in "12")
    assert one == two == plate(scan, extension=extension)


def test_a_plate_replaces_the_one_before(scan: Path, folder: Path):
    Path("plate.svg").write_text("old")
    assert run("hatch", scan, *SMALL.split()).code == 0
    assert Path("plate.svg").read_bytes().startswith(b"<?xml")
    assert [p.name for p in folder.iterdir()] == ["plate.svg"]


@pytest.mark.skipif(not POSIX, reason="names of files are text there")
def test_names_of_files_need_not_be_text(scan: Path, folder: Path):
    strange = os.fsdecode(b"pl\xff[red]te.svg")
    done = process("hatch", scan, *SMALL.split(), "-o", strange, PYTHONIOENCODING="ascii")
    assert done.code == 0, done.err
    assert done.out.startswith(r"pl\udcff[red]te.svg  30 x ")


class TestParameters:
    def options(self) -> list[tuple[str, str]]:
        command = typer.main.get_command(app).commands["hatch"]  # type: ignore[attr-defined]
        return [(option, parameter.help or "") for parameter in command.params for option in getattr(parameter, "opts", [])]

    def test_each_field_is_one_option(self):
        names = [name for name, _ in self.options()]
        assert len(names) == len(set(names))
        helps = dict(self.options())
        for item in fields(Hatching):
            text = helps["--" + item.name.replace("_", "-")]
            assert item.metadata["help"][1:] in text
            if item.metadata["low"] is not None:
                assert f"({item.metadata['low']:g} to {item.metadata['high']:g})" in text

    @pytest.mark.parametrize("name", styles())
    def test_the_style_given_parameter_by_parameter_is_the_style(self, name: str, scan: Path, folder: Path):
        style = STYLES[name]
        values = {item.name: getattr(style, item.name) for item in fields(style)}
        hand = values.pop("hand")
        if hand is not None:
            values |= {f"hand-{item.name}": getattr(hand, item.name) for item in fields(hand)}
        each = [str(part) for key, value in values.items() for part in (f"--{key.replace('_', '-')}", value)]
        each += ["--hand" if hand is not None else "--no-hand"]
        assert plate(scan, "--style", "pencil", *each) == plate(scan, "--style", name)

    @pytest.mark.parametrize("item", [f for f in fields(Hatching) if f.metadata["low"] is not None], ids=lambda f: f.name)
    def test_ranges_end_where_the_dataclass_says(self, item, folder: Path):
        option, low, high = "--" + item.name.replace("_", "-"), item.metadata["low"], item.metadata["high"]
        for value in (low - 1, high + 1, "nan", "inf", "much"):
            done = run("hatch", "missing.nii", option, value)
            assert done.code == 2
            assert f"'{option}': must be a " in done.err
            assert f"{low:g} to {high:g}, not '{value}'" in done.err


INFO = """\
egg.nii.gz
  voxels    28 x 26 x 24 (x, y, z), int16, 0.0 MiB
  spacing   1 x 1 x 1 mm
  axes      x to the right, y anterior, z superior
  extent    right 0.0 to 27.0, anterior 0.0 to 25.0, superior 0.0 to 23.0 mm
  values    0 to 1000
"""
SHARED = [
    ("volumes/ct_head.nii.gz", "", ["208 x 256 x 225 (x, y, z), float32", "values    0 to 0.9996"]),
    ("volumes/tooth.nhdr", "", ["103 x 94 x 161", "uint16", "values    0 to 1300"]),
    ("volumes/tooth.raw", "--raw 103x94x161,>u2 --spacing 1,1,2", ["spacing   1 x 1 x 2 mm", "values    0 to 1300"]),
    ("volumes/aneurism.raw.gz", "--raw 256x256x256,uint8", ["256 x 256 x 256", "values    0 to 255"]),
    ("volumes/ct_abdomen.nii.gz", "", ["spacing   3 x 3 x 3 mm", "surface   -300, skin in Hounsfield units"]),
    ("volumes/mr_head_labels.nrrd", "", ["x to the left, y posterior, z superior", "spacing   1 x 0.898437 x 0.898437 mm"]),
    ("meshes/bunny.obj", "", ["triangles 69451", "open: 223 boundary edges"]),
    ("meshes/femur.off", "", ["triangles 7798", "closed, manifold, oriented"]),
    ("meshes/bad/bunny_broken.ply", "", ["open: 353 boundary edges; not manifold: 132"]),
    ("meshes/teapot.obj", "", ["components: 3"]),
]


class TestInfo:
    def test_of_a_scan(self, scan: Path):
        done = run("info", scan)
        assert done.code == 0
        assert done.err == ""
        assert done.out.startswith(INFO)
        assert done.out.endswith(" (what `hatch` draws without --iso)\n")

    @pytest.mark.parametrize(("name", "options", "words"), SHARED, ids=[name for name, _, _ in SHARED])
    def test_of_real_data(self, name: str, options: str, words: list[str], shared: Callable[[str], Path]):
        done = run("info", shared(name), *options.split())
        assert done.code == 0
        assert all(text.startswith("note: ") for text in done.err.splitlines())
        assert [word for word in words if word not in done.out] == []

    def test_of_a_constant_scan(self, tmp_path: Path):
        done = run("info", write_scan(tmp_path / "flat.nii", np.full((4, 4, 4), 7, np.int16)))
        assert done.code == 0
        assert "values    7 to 7\n" in done.out

    def test_what_was_assumed_goes_to_stderr(self, tmp_path: Path):
        ball().tofile(tmp_path / "egg.raw")
        done = run("info", tmp_path / "egg.raw", "--raw", "28x26x24,int16")
        assert done.err == "note: no orientation stored: taken as --axes LPS, x to the patient's left, y posterior, z superior\n"

    @pytest.mark.parametrize(("fill", "low"), [("0", "0"), ("-5.5", "-5.5")])
    def test_bad_voxels_can_be_filled(self, fill: str, low: str, tmp_path: Path):
        array = ball().astype(np.float32)
        array[0, 0, :3] = np.nan, np.inf, -np.inf
        path = write_scan(tmp_path / "holes.nii", array)
        assert f"values    {low} to 1000\n" in run("info", path, "--fill", fill).out

    def test_a_volume_of_a_series_in_time(self, tmp_path: Path):
        frames = [sitk.GetImageFromArray(ball() + np.int16(10 * k)) for k in range(3)]
        sitk.WriteImage(sitk.JoinSeries(frames), str(tmp_path / "beat.nii"))
        assert "values    20 to 1020\n" in run("info", tmp_path / "beat.nii", "--index", 2).out


def test_demo(folder: Path):
    done = run("demo", "-o", "new/plates")
    assert done.code == 0
    assert set(done.err.splitlines()) <= {COMPILING}
    *paths, summary = done.out.splitlines()
    assert sorted(paths) == sorted(str(p) for p in Path("new/plates").iterdir())
    assert len(paths) == 7
    assert re.fullmatch(
        r"\d+\.\d\d s \(reading [\d.]+, surface [\d.]+, pencil [\d.]+, pen-and-ink [\d.]+, shaded [\d.]+\)", summary
    )
    assert all(Path(p).stat().st_size > 10_000 for p in paths)
    assert [p.name for p in folder.iterdir()] == ["new"]


class TestHelp:
    def test_version(self):
        assert run("--version") == (0, f"intaglio {intaglio.__version__}\n", "")

    def test_without_a_command(self):
        done = run()
        assert done.code == 2
        assert done.out == run("--help").out
        assert done.err == ""

    def test_lists_the_commands(self):
        done = run("--help")
        assert done.code == 0
        assert done.err == ""
        assert re.findall(r"^│ (\w+)", done.out, re.M) == list(COMMANDS)

    @pytest.mark.parametrize("name", COMMANDS)
    def test_teaches_by_examples_that_work(self, name: str):
        command = typer.main.get_command(app).commands[name]  # type: ignore[attr-defined]
        examples = re.findall(rf"^`intaglio {name}(.*)`$", command.help, re.M)
        assert examples
        page = run(name, "--help")
        assert page.code == 0
        assert page.err == ""
        for example in examples:
            assert f"intaglio {name}{example}" in page.out
            assert len(example) < 70, "wraps in a terminal of 80 columns"
            command.make_context(name, example.split())

    def test_says_a_word_of_each_style(self):
        page = " ".join(run("hatch", "--help").out.split())
        described = page.partition("Styles: ")[2].partition(" Arguments ")[0]
        assert [name for name in styles() if name not in described] == []

    @pytest.mark.parametrize("columns", [40, 80])
    @pytest.mark.parametrize("name", COMMANDS)
    def test_fits_the_terminal(self, name: str, columns: int):
        page = run(name, "--help", COLUMNS=str(columns))
        assert page.code == 0
        assert max(len(line) for line in page.out.splitlines()) <= columns


class TestStreams:
    def test_a_pipe_gets_whole_lines_and_nothing_but_text(self, scan: Path, folder: Path):
        done = process("hatch", scan, *SMALL.split(), "-o", "a.svg", COLUMNS="40", NO_COLOR="1")
        assert done.code == 0
        assert len(done.out.splitlines()) == 1
        assert done.out.startswith("a.svg  30 x ")
        assert len(done.err.splitlines()) == 1
        assert done.err.startswith("note: no --iso given")
        assert "\x1b" not in done.out + done.err
        assert "\r" not in done.out + done.err
        assert [p.name for p in folder.iterdir()] == ["a.svg"]

    def test_errors_are_one_line_in_a_pipe(self, folder: Path):
        done = process("hatch", "a-long-name-" * 10 + ".nii.gz", COLUMNS="40")
        assert done.code == 1
        assert done.out == ""
        assert re.fullmatch(r"error: .*\n", done.err)

    def test_a_reader_that_leaves_is_no_error(self, scan: Path):
        code = "from intaglio.cli import main; main()"
        with subprocess.Popen(
            [sys.executable, "-c", code, "info", str(scan)], stdout=subprocess.PIPE, stderr=subprocess.PIPE, encoding="utf-8"
        ) as child:
            assert child.stdout
            assert child.stderr
            child.stdout.close()
            assert child.stderr.read() == ""

    @pytest.mark.skipif(not POSIX, reason="needs a pseudoterminal")
    def test_a_terminal_gets_progress_that_it_clears(self, scan: Path, folder: Path):
        import pty

        master, slave = pty.openpty()
        code = "from intaglio.cli import main; main()"
        args = ["hatch", str(scan), *SMALL.split(), "--iso", "500"]
        env = {k: v for k, v in os.environ.items() if k not in COLOURS} | {"TERM": "xterm", "COLUMNS": "60"}
        with subprocess.Popen([sys.executable, "-c", code, *args], env=env, stdout=subprocess.PIPE, stderr=slave) as child:
            os.close(slave)
            shown = b""
            with contextlib.suppress(OSError):  # how Linux says that the other end was closed
                while part := os.read(master, 1 << 16):
                    shown += part
            assert child.stdout
            assert child.stdout.read().startswith(b"plate.svg  30 x ")
        os.close(master)
        assert child.returncode == 0
        assert b"writing" in shown
        assert b"\x1b[2K" in shown[-16:], "the last line is erased"
