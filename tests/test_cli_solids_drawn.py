"""Distance fields and label maps as SCAN: each command knows what they are and draws what they hold."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from test_cli import ball, folder, run, scan, write_scan  # noqa: F401
from test_distances import torus

import intaglio as ig

SMALL = ["--width", "30", "--dpi", "60"]


@pytest.fixture(scope="module")
def field(tmp_path_factory: pytest.TempPathFactory) -> Path:
    path = tmp_path_factory.mktemp("field") / "torus.nii.gz"
    ig.write_volume(torus(), path)
    return path


@pytest.fixture(scope="module")
def turned(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The same torus by someone to whom inside is positive, without our mark."""
    path = tmp_path_factory.mktemp("field") / "turned.nrrd"
    ig.write_volume(ig.Volume(-torus().array, np.eye(4)), path)
    return path


@pytest.fixture(scope="module")
def labels(tmp_path_factory: pytest.TempPathFactory) -> Path:
    array = np.where(ball() > 500, 2, 0).astype(np.uint8)
    array[12:][array[12:] > 0] = 3
    array[:, 19:][array[:, 19:] > 0] = 7
    return write_scan(tmp_path_factory.mktemp("labels") / "parts.nii.gz", array)


def picture(command: str, path: Path, *args: str) -> np.ndarray:
    size = ["--size", "60"] if command == "render" else SMALL
    done = run(command, path, *size, "--view", "superior", *args, "-o", "a.png")
    assert done.code == 0, done.err
    return np.asarray(PIL.Image.open("a.png").convert("L")).astype(int)


@pytest.mark.parametrize("command", ["hatch", "contour", "render"])
def test_a_field_is_drawn_where_it_is_0(command: str, field: Path, folder: Path):  # noqa: F811
    told = [] if command != "render" else ["--mode", "isosurface", "--iso", "0:#f5ebd1:1"]
    explicit = picture(command, field, *(told or ["--iso", "0", "--inside", "below"]))
    # Bone is a colour between two of those that can be given.
    np.testing.assert_allclose(picture(command, field), explicit, atol=1 if command == "render" else 0)
    ink = explicit < explicit.max() - 40
    h, w = ink.shape
    assert ink.any()
    assert not ink[h // 2 - 3 : h // 2 + 3, w // 2 - 3 : w // 2 + 3].any(), "the hole in the torus is paper"


def test_a_field_becomes_its_mesh(field: Path, folder: Path):  # noqa: F811
    done = run("surface", field, "-o", "torus.stl")
    assert "note: no --iso given; taking 0, where the distances are 0" in done.err
    mesh = ig.read_mesh("torus.stl")
    assert mesh.report.caveats == ()
    assert np.ptp(mesh.corners, axis=0) == pytest.approx((28, 28, 8), abs=0.2)


def test_info_says_what_it_is_and_what_to_do(field: Path, turned: Path, labels: Path, scan: Path):  # noqa: F811
    said = run("info", field)
    assert "holds     signed distances in mm, inside negative" in said.out
    assert "`intaglio hatch torus.nii.gz` draws it, `intaglio surface torus.nii.gz` makes a mesh" in said.out
    assert said.err == ""
    assert "negative inside; --inside above turns them" in run("info", turned).err
    said = run("info", labels)
    assert re.search(r"labels +3: 2-3,7\n +largest +. \([\d.]+ ml\), . \(", said.out)
    assert re.search(r"`intaglio hatch parts.nii.gz --label [237]` draws one\n", said.out)
    assert "iso" not in said.out
    # A voxel is a cubic millimetre.
    count = (ball() > 500).sum()
    assert sum(float(ml) for ml in re.findall(r"\(([\d.]+) ml\)", said.out)) * 1000 == pytest.approx(count, rel=0.05)
    assert "signed" not in run("info", scan).out


@pytest.mark.parametrize("command", ["hatch", "contour"])
def test_inside_turns_the_field_of_somebody_else(command: str, field: Path, turned: Path, folder: Path):  # noqa: F811
    np.testing.assert_array_equal(picture(command, turned, "--inside", "above"), picture(command, field))
    assert (picture(command, turned) != picture(command, field)).any()


def test_inside_below_draws_what_is_dark_in_a_scan(scan: Path, folder: Path):  # noqa: F811
    dark = write_scan(folder / "dark.nii", 1000 - ball())
    np.testing.assert_array_equal(
        picture("hatch", dark, "--iso", "400", "--inside", "below"), picture("hatch", scan, "--iso", "600")
    )


@pytest.mark.parametrize("command", ["hatch", "contour", "render", "surface"])
def test_a_label_map_is_drawn_as_one_body(command: str, labels: Path, folder: Path):  # noqa: F811
    out = ["-o", "a.stl" if command == "surface" else "a.png"]
    small = {"render": ["--size", "40"], "surface": []}.get(command, SMALL)
    done = run(command, labels, *small, *out)
    assert done.code == 0, done.err
    assert "note: parts.nii.gz holds labels; " in done.err
    assert "--iso" not in done.err


@pytest.mark.parametrize("command", ["hatch", "contour"])
def test_labels_are_those_of_the_scan_itself_if_it_holds_labels(command: str, labels: Path, folder: Path):  # noqa: F811
    one = picture(command, labels, "--label", "7")
    np.testing.assert_array_equal(one, picture(command, labels, "--labels", str(labels), "--label", "7"))
    assert (one.shape != (other := picture(command, labels, "--label", "2,3")).shape) or (one != other).any()


def test_labels_saved_as_floats_are_labels(scan: Path, labels: Path, folder: Path):  # noqa: F811
    floats = ig.read_volume(labels)
    ig.write_volume(ig.Volume(floats.array.astype(np.float32), floats.world_from_index), "floats.nii.gz")
    of = ["--label", "7", "--labels"]
    np.testing.assert_array_equal(picture("hatch", scan, *of, "floats.nii.gz"), picture("hatch", scan, *of, str(labels)))


def test_a_field_goes_through_the_commands_as_it_came(folder: Path, scan: Path):  # noqa: F811
    assert run("surface", scan, "--iso", 500, "-o", "egg.stl").code == 0
    assert run("distance", "egg.stl", "--resolution", 24, "--band", "full", "-o", "egg.nrrd").code == 0
    assert run("combine", "union", "egg.nrrd", "egg.stl", "-o", "both.mha").code == 0
    for name in ("egg.nrrd", "both.mha"):
        assert "holds     signed distances" in run("info", name).out
    note = run("combine", "union", write_scan(folder / "hu.nii", ball().astype(np.float32) - 500), "egg.nrrd", "-o", "c.nrrd").err
    assert "note: hu.nii: its values do not change by 1 per mm; taking what is negative as the solid" in note
