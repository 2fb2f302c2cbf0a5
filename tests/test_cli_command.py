"""What holds for every command: options once, one way of naming what they take, messages in the words of the command line."""

from __future__ import annotations

import ast
import re
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import typer
from test_cli import COMMANDS, ball, run, write_scan

import intaglio as ig
from intaglio.cli import app
from intaglio.cli.command import UsageError
from intaglio.cli.console import KEYWORD, PHRASES, spoken

SOURCE = Path(ig.__file__).parent


def command(name: str) -> Any:
    return typer.main.get_command(app).commands[name]  # type: ignore[attr-defined]


def options(name: str) -> list[Any]:
    context = typer.Context(command(name))
    return [p for p in command(name).get_params(context) if p.param_type_name == "option" and p.name != "help"]


@pytest.mark.parametrize("name", COMMANDS)
def test_an_option_given_twice_is_refused_unless_it_may_be_repeated(name: str):
    arguments = {"combine": ["union", "a.nii"], "demo": []}.get(name, ["a.nii"])
    for option in options(name):
        once = option.opts[:1] + ([] if option.is_flag else ["0"])
        again = option.opts[-1:] + ([] if option.is_flag else ["0"])
        try:
            command(name).make_context(name, [*arguments, *once, *again])
        except UsageError as error:
            refused = error.format_message().endswith(" can be given only once")
        else:
            refused = False
        assert refused is not option.multiple, option.opts


def test_options_that_may_be_repeated():
    assert {p.name for name in COMMANDS for p in options(name) if p.multiple} == {"cut", "iso", "label", "surface"}
    assert {p.name for p in options("hatch") if p.multiple} == {"cut", "label", "surface"}


@pytest.mark.parametrize("name", COMMANDS)
def test_what_an_option_takes_is_in_capitals_and_switches_take_nothing(name: str):
    page = run(name, "--help", COLUMNS="200").out
    assert "<bool>" not in page
    assert "TEXT" not in page
    for option in options(name):
        if option.is_flag:
            assert option.metavar == ""
        else:
            assert re.fullmatch(r"[A-Z#][][A-Z#|:,x.]*", option.metavar), (option.opts, option.metavar)


def test_words_that_an_option_knows_are_in_its_help():
    page = " ".join(re.sub("[│╭╰─╮╯]", " ", run("render", "--help", COLUMNS="200").out).split())
    assert [name for name in ig.TransferFunction.presets() if name not in page] == []
    assert "preintegrated" in page
    for name in ("hatch", "render"):
        (option,) = [p for p in options(name) if p.name == "tf"]
        assert option.opts == ["--tf", "--preset"]


@pytest.mark.parametrize(
    ("said", "heard"),
    [
        ("replace them with fill=VALUE when reading", "replace them with --fill VALUE when reading"),
        ("choose one with index=0..2", "choose one with --index 0..2"),
        ("choose one with series=: 1: head; 2: foot", "choose one with --series: 1: head; 2: foot"),
        ('inside="above" turns them', "--inside above turns them"),
        ("taken as axes=LPS, x to the left", "taken as --axes LPS, x to the left"),
        ("; give spacing=", "; give --spacing"),
        ("close it with cap=True", "close it without --open"),
        ("my-iso=3.nii: is empty", "my-iso=3.nii: is empty"),
        ("cannot read 'fill=3'", "cannot read 'fill=3'"),
    ],
)
def test_keywords_are_options_in_messages(said: str, heard: str):
    assert spoken(said) == heard


def messages() -> list[tuple[str, str]]:
    """The fixed text of each InputError and note outside the command line, with where it stands."""
    found = []
    for path in SOURCE.rglob("*.py"):
        if path.parent.name == "cli":
            continue
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            if isinstance(node, ast.Call) and getattr(node.func, "id", "") == "InputError":
                texts = [part.value for part in ast.walk(node) if isinstance(part, ast.Constant) and isinstance(part.value, str)]
                found.append((" ".join(texts), f"{path.name}:{node.lineno}"))
    return found


# Of functions that the command line calls with what it has checked, or not at all.
PYTHON_ONLY = {"classify", "range", "cap", "like", "resolution"}


def test_every_keyword_in_a_message_is_an_option():
    found = messages()
    assert len(found) > 150
    known = set(re.findall(r"\b[a-z]{3,}\b", KEYWORD.pattern))
    assert known <= {p.name for name in COMMANDS for p in options(name)} | {"iso"}
    for text, where in found:
        keywords = set(re.findall(r"(?<=[\s(])([a-z_]+)=", text))
        assert keywords <= known | PYTHON_ONLY, (where, text)
    assert all(re.search(rf"{re.escape(phrase)}", " ".join(text for text, _ in found)) for phrase in PHRASES)


def write_mask(path: Path) -> Path:
    return write_scan(path, (ball() > 500).astype(np.uint8))


@pytest.mark.parametrize(
    ("line", "code", "words"),
    [
        ("hatch {scan} --index 2", 1, "index must be between 0 and 0, not 2"),
        ("info {raw} --raw 28x26x25,int16", 1, "28 x 26 x 25 voxels of .?i2 do not fill the file; correct --raw$"),
        ("surface {floats} --label 5", 1, "labels must be whole numbers, not float32; is this the label volume"),
        ("surface {mask} --label 5", 1, "label must be one of 1, not 5"),
        ("surface {full} --iso 10 --open", 1, "fills the grid, and so has no surface; close it without --open"),
        ("hatch {nan}", 1, "voxels are NaN or infinite; replace them with --fill VALUE"),
        ("hatch {scan} --label 5", 1, "is a scan, not labels; say where --label picks from, with --labels FILE"),
        ("surface bunny.obj", 1, "bunny.obj: no such file|bunny.obj: is a mesh"),
        ("combine union {scan} {mask} -o {scan}", 2, "'--output': must be a file of its own"),
        ("combine join {scan} {mask}", 2, "'HOW': must be one of union"),
        ("turntable {scan} -o spin.mp4", 2, "'--output': must end in .gif or .png"),
        ("voxelize {scan}", 1, "must be a mesh"),
    ],
)
def test_errors_speak_of_options_and_exit_by_their_cause(line: str, code: int, words: str, tmp_path: Path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    ball().tofile("egg.raw")
    full = ball().astype(np.float32) * 0 + np.arange(28, dtype=np.float32)
    nan = ball().astype(np.float32)
    nan[0, 0, 0] = np.nan
    (tmp_path / "bunny.obj").write_text("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 3\n")
    files = {
        "scan": write_scan(Path("egg.nii"), ball()),
        "floats": write_scan(Path("floats.nii"), ball().astype(np.float32)),
        "mask": write_mask(Path("mask.nii")),
        "full": write_scan(Path("full.nii"), full + 10),
        "nan": write_scan(Path("nan.nii"), nan),
        "raw": Path("egg.raw"),
    }
    before = sorted(tmp_path.iterdir())
    done = run(*line.format(**files).split())
    assert done.code == code, done.err
    error = done.err.splitlines()[-1]
    assert error.startswith("error: ")
    assert re.search(words, error), error
    assert not re.search(r"[a-z_]+=[A-Z(\[\"']|signed_distance|redistance|mapped", error), error
    assert sorted(tmp_path.iterdir()) == before
