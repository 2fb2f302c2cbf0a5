"""`intaglio hatch` and `turntable` with several surfaces: --surface, --label and --tf."""

from __future__ import annotations

import itertools
import math
import re
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from test_cli import SMALL, ball, run, write_scan

from intaglio import InputError, TransferFunction, isosurface, styles
from intaglio.cli.console import Steps
from intaglio.cli.surfaces import VEIL, label_of, surface_of
from intaglio.ink.styles import style

SKIN_AND_CORE = "--surface 300:contour --surface 900:pencil"
FUNCTION = TransferFunction.from_points(
    [(50, "#e0b090", 0.0), (400, "#e0b090", 0.2), (500, "#ffffff", 0.0), (600, "#ffffff", 0.0), (950, "#ffffff", 0.9)]
)


@pytest.fixture(scope="module")
def scan(tmp_path_factory: pytest.TempPathFactory) -> Path:
    return write_scan(tmp_path_factory.mktemp("scan") / "egg.nii.gz", ball())


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    (tmp_path / "out").mkdir()
    monkeypatch.chdir(tmp_path / "out")
    return tmp_path / "out"


@pytest.fixture(scope="module")
def labels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """1 in the egg's lower half, 4 in its upper one, 7 in its nose."""
    array = np.where(ball() > 500, 1, 0).astype(np.uint8)
    array[12:][array[12:] > 0] = 4
    array[:, 19:][array[:, 19:] > 0] = 7
    return write_scan(tmp_path_factory.mktemp("labels") / "parts.nii.gz", array)


def svg(scan: Path, line: str) -> str:
    assert run("hatch", scan, *SMALL.split(), *line.split()).code == 0
    return Path("plate.svg").read_text()


@pytest.mark.parametrize(
    ("line", "layers"),
    [
        (SKIN_AND_CORE, ["300: contour", "900: hatching 1", "900: contour"]),
        ("--surface 300:30%:engraving:#8a2b1a --surface 900", ["300: hatching 1", "900: contour"]),
        ("--surface 300..2000 --surface 900:contour:100%", ["300..2000: contour", "900: contour"]),
        (
            "--labels {labels} --label 1,4:engraving --label 7:pen-and-ink:#203a80",
            ["label 1,4: hatching 1", "label 7: hatching 1"],
        ),
        ("--surface 300:contour --labels {labels} --label 2-7:#8a2b1a", ["300: contour", "label 2-7: hatching 1"]),
        ("--tf {tf} --halo 0", ["iso 50: contour", "iso 600: hatching 1"]),
    ],
)
def test_layers_are_named_after_their_surfaces(
    line: str, layers: list[str], scan: Path, labels: Path, folder: Path, tmp_path: Path
):
    FUNCTION.write(tmp_path / "two.vp.json")
    text = svg(scan, line.format(labels=labels, tf=tmp_path / "two.vp.json"))
    named = re.findall(r'inkscape:label="([^"]+)"', text)
    assert [name for name in layers if name not in named] == []
    assert len(set(named)) == len(named)


def test_a_surface_alone_is_the_isosurface(scan: Path, folder: Path):
    title = re.compile("<title>.*</title>")
    one, other = (title.sub("", svg(scan, line)) for line in ("--iso 400", "--surface 400"))
    assert one == other


def test_each_part_of_a_surface_counts(scan: Path, folder: Path):
    plates = {svg(scan, f"--surface 300:{look} --surface 900") for look in ("contour", "40%", "80%", "#203a80", "engraving")}
    assert len(plates) == 5
    assert svg(scan, SKIN_AND_CORE) == svg(scan, f"--surface 300:contour:{VEIL:.0%} --surface 900")


def test_options_of_style_hold_for_all_surfaces(scan: Path, folder: Path):
    assert 'fill="#0000ff"' in svg(scan, "--surface 300:contour --surface 900:engraving --ink #0000ff")
    assert 'fill="#2b2b2e"' not in svg(scan, "--surface 300:contour --surface 900:pencil --ink #0000ff")


def test_what_texts_say():
    def styled(name: str | None):
        return style(name or "pencil")

    assert surface_of("0.2:contour", styled) == {
        "iso": 0.2, "name": "0.2", "style": style("pencil"), "opacity": VEIL, "lines_only": True,
    }  # fmt: skip
    assert surface_of("-500..-150.5:30%:contour", styled)["iso"] == (-500.0, -150.5)
    assert surface_of("-500..:30%:contour", styled)["opacity"] == 0.3
    assert surface_of("..600:pen-and-ink:#8a2b1a", styled)["iso"] == (-math.inf, 600.0)
    assert surface_of("450..", styled)["iso"] == (450.0, math.inf)
    assert label_of("5", styled)["label"] == [range(5, 6)]
    assert label_of("26-33,77", styled)["label"] == [range(26, 34), range(77, 78)]


KNOWN = ", ".join(styles())


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("--surface 300:oil", 2, f"'300:oil' has 'oil' where it must have {KNOWN}, contour, #rrggbb, or a percentage"),
        ("--surface 300:0%", 2, "'300:0%' has '0%'"),
        ("--surface 300:120%", 2, "'120%'"),
        ("--surface skin", 2, r"'--surface': must begin with a value, LOW..HIGH or ..HIGH such as .*, not 'skin'"),
        ("--surface 9..3", 2, "not '9..3'"),
        ("--surface ..", 2, r"not '\.\.'"),
        ("--surface nan", 2, "not 'nan'"),
        ("--surface 5000", 1, "iso must be within the volume's values"),
        ("--surface 2000..3000", 1, "no matter three voxels thick has values from 2000 to 3000; the scan's run from 0 to 1000"),
        ("--surface ..2", 1, "no cavity has values from -inf to 2"),
        ("--label 5", 1, "egg.nii.gz: is a scan, not labels; say where --label picks from, with --labels FILE"),
        ("--labels {labels}", 2, "'--labels': needs --label NUMBERS"),
        ("--labels {labels} --label five", 2, "'--label': must begin with numbers of labels such as .*, not 'five'"),
        ("--labels {labels} --label 5", 1, r"parts.nii.gz: label must be one of 1, 4, 7, not 5"),
        ("--labels {labels} --label 20-30", 1, "label must be one of 1, 4, 7, not none"),
        ("--labels missing.nii --label 5", 1, "missing.nii"),
        ("--tf oil", 2, "'--tf': must be one of ct-skin, .*, or a file, not 'oil'"),
        ("--tf ct-bone --iso 3", 2, "cannot be given together"),
        ("--surface 300 --iso 3", 2, "cannot be given together"),
        ("--halo -1", 2, "'--halo': must be a number, 0 to 20, not '-1'"),
    ],
)
def test_says_what_is_wrong_and_leaves_nothing(line: str, code: int, words: str, scan: Path, labels: Path, folder: Path):
    done = run("hatch", scan, *SMALL.split(), *line.format(labels=labels).split())
    assert done.code == code, done.err
    error = done.err.splitlines()[-1]
    assert error.startswith("error: ")
    assert re.search(words, error), error
    assert list(folder.iterdir()) == []


def test_transfer_function_without_a_surface(scan: Path, folder: Path, tmp_path: Path):
    function = TransferFunction.from_points([(5000, "#ffffff", 0.0), (6000, "#ffffff", 0.5)])
    function.write(tmp_path / "far.vp.json")
    done = run("hatch", scan, "--tf", tmp_path / "far.vp.json")
    assert done.code == 1
    assert "its opacity has no maximum that begins between 0 and 1000" in done.err
    assert done.err.endswith("say where a surface is with --iso\n")
    with pytest.raises(InputError, match="preset must be"):
        TransferFunction.preset("far")


TURN = "--frames 2 --degrees 30 --width 30 --size 160 --dpi 60"


@pytest.mark.parametrize(
    "line",
    [
        SKIN_AND_CORE,
        "--labels {labels} --label 1,4:engraving --label 7:pen-and-ink:#203a80",
        "--tf {tf} --halo 0",
        "--iso 500 --cut plane:superior --islands 0",
    ],
)
def test_a_turntable_takes_what_hatch_takes(line, scan, labels, folder):
    """Two plates, and not the same twice."""
    FUNCTION.write(folder / "two.vp.json")
    words = line.format(labels=labels, tf=folder / "two.vp.json").split()
    turned = run("turntable", scan, *TURN.split(), *words, "-o", "turn.png")
    assert turned.code == 0
    assert "2 plates" in turned.out
    with PIL.Image.open("turn.png") as picture:
        assert picture.n_frames == 2
        first = np.asarray(picture.convert("RGB")).copy()
        picture.seek(1)
        assert (np.asarray(picture.convert("RGB")) != first).any()


def test_a_turntable_refuses_what_hatch_refuses(scan, folder):
    done = run("turntable", scan, "--iso", 1, "--tf", "ct-bone")
    assert (done.code, done.out) == (2, "")
    assert "cannot be given together" in done.err
    assert not list(folder.iterdir())


@pytest.mark.parametrize("output", ["spin.gif", "spin.png", "frames"])
def test_an_interrupted_turntable_leaves_whole_files_alone(output, scan, folder, monkeypatch):
    """Ctrl-C in the second plate: no file, no partial one; in a folder, the picture that was complete."""
    plates = itertools.count()

    def stopping(*of, **options):
        if next(plates) == 1:
            raise KeyboardInterrupt
        return isosurface(*of, **options)

    monkeypatch.setattr("intaglio.plate.isosurface", stopping)
    done = run("turntable", scan, *TURN.split(), "--iso", 500, "-o", output)
    assert (done.code, done.out) == (130, "")
    assert [p.name for p in folder.rglob("*") if p.is_file()] == ["0001.png"] * (output == "frames")


def test_frames_done_and_time_left_are_shown():
    steps = Steps()
    with steps.step("plates", counted="plates") as progress:
        progress(0, 4)
        assert steps.bar.tasks[0].fields["count"] == "0 of 4 plates, some time left"
        progress(2, 4)
        assert re.fullmatch(r"2 of 4 plates, 0:00:0\d left", steps.bar.tasks[0].fields["count"])
    with steps.step("reading") as progress:
        progress(1, 4)
        assert steps.bar.tasks[0].fields["count"] == ""
