"""`combine` from the command line: fields, masks and meshes, placed in the world."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import oracle
import pytest
from test_cli import run

import intaglio as ig


@pytest.fixture
def solids(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """a.nii.gz and b.nrrd, fields of balls on two grids; mask.nii.gz; ball.stl, the second ball as a mesh."""
    monkeypatch.chdir(tmp_path)
    for name, centre, radius, spacing, first in (
        ("a.nii.gz", (0, 0, 0), 12.0, 1.0, -20.0),
        ("b.nrrd", (8, 2, 1), 7.0, 0.8, -8.0),
    ):
        grid = ig.Volume.from_array(np.zeros((40, 40, 40), dtype=np.float32), spacing, (first,) * 3)
        distance = oracle.ball(oracle.positions(grid), centre, radius).astype(np.float32)
        ig.write_volume(ig.Volume(distance, grid.world_from_index), name)
    ig.surface(ig.read_volume("b.nrrd")).save("ball.stl")
    field = ig.read_volume("a.nii.gz")
    ig.write_volume(ig.Volume(field.array < 0, field.world_from_index), "mask.nii.gz")
    return tmp_path


@pytest.mark.parametrize("second", ["b.nrrd", "ball.stl"])
@pytest.mark.parametrize("how", ["union", "intersection", "difference"])
def test_balls(how: str, second: str, solids: Path):
    done = run("combine", how, "a.nii.gz", second, "-o", "out.nii.gz")
    assert done.code == 0, done.err
    result = ig.read_volume("out.nii.gz")
    p = oracle.positions(result)
    a, b = oracle.ball(p, (0, 0, 0), 12.0), oracle.ball(p, (8, 2, 1), 7.0)
    true = {"union": np.minimum(a, b), "intersection": np.maximum(a, b), "difference": np.maximum(a, -b)}[how]
    near = np.abs(true) < 1
    assert np.abs(result.array - true)[near].max() < 0.1


def test_masks_are_measured_and_it_is_said(solids: Path):
    done = run("combine", "difference", "mask.nii.gz", "b.nrrd", "-o", "out.nrrd", "--smooth", 2, "--redistance")
    assert done.code == 0, done.err
    assert "note: mask.nii.gz: holds uint8; taking all voxels that are not 0 as the solid" in done.err
    slope = np.linalg.norm(np.gradient(ig.read_volume("out.nrrd").array), axis=0)
    assert abs(np.median(slope) - 1) < 0.02


@pytest.mark.parametrize(
    ("words", "message", "code"),
    [
        ("minus a.nii.gz b.nrrd", "must be one of union, intersection, difference, not 'minus'", 2),
        ("union a.nii.gz missing.nrrd", "missing.nrrd: no such file", 1),
        ("union a.nii.gz -o out.stl", "'--output': must end in", 2),
        ("union a.nii.gz --smooth -1", "must be a number, 0 or more", 2),
    ],
)
def test_bad_input(words: str, message: str, code: int, solids: Path):
    done = run("combine", *words.split())
    assert done.code == code
    assert message in done.err
    assert sorted(p.name for p in solids.iterdir()) == ["a.nii.gz", "b.nrrd", "ball.stl", "mask.nii.gz"]
