"""axes=: where columns, rows and slices run, for files that do not say or say it wrong."""

from __future__ import annotations

from itertools import permutations, product
from pathlib import Path

import numpy as np
import PIL.Image
import pytest
from test_cli import ball, run, write_scan

import intaglio as ig

ALL = ["".join(sides) for pair in product("RL", "AP", "SI") for sides in permutations(pair)]
SIDE = {"R": (0, 1), "L": (0, -1), "A": (1, 1), "P": (1, -1), "S": (2, 1), "I": (2, -1)}


@pytest.fixture
def stack(tmp_path: Path) -> Path:
    """(3, 4, 5) as PNG slices, each voxel its own value."""
    array = np.arange(60, dtype=np.uint8).reshape(3, 4, 5)
    (tmp_path / "slices").mkdir()
    for k, picture in enumerate(array):
        PIL.Image.fromarray(picture).save(tmp_path / "slices" / f"{k}.png")
    return tmp_path / "slices"


@pytest.mark.parametrize("axes", ALL)
def test_each_axis_runs_to_the_side_of_its_letter(axes: str, stack: Path):
    v = ig.read_volume(stack, axes=axes, spacing=(1, 2, 3))
    assert not [note for note in v.notes if "orientation" in note]
    np.testing.assert_array_equal(v.array, np.arange(60).reshape(3, 4, 5))
    for k, (letter, step) in enumerate(zip(axes, (1, 2, 3), strict=True)):
        axis, sign = SIDE[letter]
        want = np.zeros(3)
        want[axis] = sign * step
        np.testing.assert_array_equal(v.world_from_index[:3, k], want)
    np.testing.assert_array_equal(
        ig.read_volume(stack, axes=axes.lower(), spacing=(1, 2, 3)).world_from_index, v.world_from_index
    )


def test_lps_is_what_is_assumed(stack: Path):
    assumed, said = ig.read_volume(stack), ig.read_volume(stack, axes="LPS")
    np.testing.assert_array_equal(assumed.world_from_index, said.world_from_index)
    assert any(note.startswith("no orientation stored: taken as axes=LPS") for note in assumed.notes)


def test_axes_replace_what_a_file_says(tmp_path: Path):
    path = write_scan(tmp_path / "egg.nii", ball())  # RAS
    v = ig.read_volume(path, axes="PIR", spacing=(1, 1, 2))
    np.testing.assert_array_equal(v.world_from_index[:3, :3], [[0, 0, 2], [-1, 0, 0], [0, -1, 0]])


@pytest.mark.parametrize("axes", ["", "LP", "LPSS", "LRS", "xyz", "LPX", "L,P,S", 3])
def test_bad_axes(axes, tmp_path: Path):
    with pytest.raises(ig.InputError, match="axes must say to which side columns, rows and slices run"):
        ig.read_volume(tmp_path / "missing.nii", axes=axes)


def test_a_stack_upside_down_is_set_right(tmp_path: Path):
    """A head whose slices were counted from the top: read plainly its crown is below."""
    (tmp_path / "slices").mkdir()
    head = np.zeros((20, 16, 16), np.uint8)
    head[2:12, 4:12, 4:12] = 200
    head[12:18, 7:9, 7:9] = 200  # a horn, at the top
    for k, picture in enumerate(head[::-1]):
        PIL.Image.fromarray(picture).save(tmp_path / "slices" / f"s{k:02d}.png")
    widths = {}
    for axes in ("LPS", "LPI"):
        out = tmp_path / f"{axes}.png"
        assert run("render", tmp_path / "slices", "--axes", axes, "--mode", "mip", "--size", 60, "-o", out).code == 0
        dark = np.asarray(PIL.Image.open(out).convert("L")) > 100
        rows = [row.sum() for row in dark if row.any() and not row.all()]
        widths[axes] = rows[: len(rows) // 3], rows[-len(rows) // 3 :]
    assert np.mean(widths["LPI"][0]) < np.mean(widths["LPI"][1])
    assert np.mean(widths["LPS"][0]) > np.mean(widths["LPS"][1])


def test_info_hints_at_axes_where_a_file_says_nothing(stack: Path, tmp_path: Path):
    done = run("info", stack)
    assert "axes      x to the left, y posterior, z superior, assumed; say otherwise with --axes\n" in done.out
    assert "taken as --axes LPS" in done.err
    done = run("info", stack, "--axes", "RAI")
    assert "axes      x to the right, y anterior, z inferior\n" in done.out
    assert "orientation" not in done.err
    assert "assumed" not in run("info", write_scan(tmp_path / "egg.nii", ball())).out
