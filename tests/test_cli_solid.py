"""`surface` from the command line."""

from __future__ import annotations

from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from test_cli import ball, run, write_scan

import intaglio as ig


@pytest.fixture
def scan(tmp_path: Path) -> Path:
    return write_scan(tmp_path / "egg.nii.gz", ball())


@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "glb"])
def test_surface_of_a_scan(kind: str, scan: Path, tmp_path: Path):
    target = tmp_path / f"egg.{kind}"
    done = run("surface", scan, "--iso", 500, "-o", target)
    assert done.code == 0, done.err
    mesh = ig.read_mesh(target)
    assert f"{len(mesh.triangles)} triangles" in done.out
    assert mesh.report.caveats == ()
    volume = ig.read_volume(scan)
    middle = volume.world_from_index @ (13.5, 12.0, 11.5, 1.0)
    assert np.abs(mesh.corners.mean(axis=0) - middle[:3]).max() < 1.5


def test_surface_without_an_isovalue_says_which(scan: Path, tmp_path: Path):
    done = run("surface", scan, "-o", tmp_path / "egg.stl")
    assert done.code == 0
    assert "note: no --iso given; taking" in done.err


def test_surface_of_a_label_lies_between_voxels(tmp_path: Path):
    labels = np.zeros((10, 11, 12), dtype=np.uint8)
    labels[3:7, 3:7, 3:7] = 4
    labels[3:7, 3:7, 8:10] = 9
    sitk.WriteImage(sitk.GetImageFromArray(labels), str(tmp_path / "labels.nrrd"))
    assert run("surface", tmp_path / "labels.nrrd", "--label", 4, "--no-smooth", "-o", tmp_path / "four.ply").code == 0
    corners = ig.read_mesh(tmp_path / "four.ply").corners
    # SimpleITK is LPS.
    assert corners.max(axis=0) == pytest.approx([-2.5, -2.5, 6.5])
    assert corners.min(axis=0) == pytest.approx([-6.5, -6.5, 2.5])
    for labels, right in ((4, -2.5), ("4,9", -2.5), ("4-8", -2.5), ("8-9", -7.5)):
        assert run("surface", tmp_path / "labels.nrrd", "--label", labels, "-o", tmp_path / "smooth.ply").code == 0
        assert ig.read_mesh(tmp_path / "smooth.ply").corners.max(axis=0)[0] == pytest.approx(right, abs=0.3)


@pytest.mark.parametrize(
    ("options", "words", "code"),
    [
        ("-o egg.vtk", "must end in .stl", 2),
        ("--iso 5 --label 5", "cannot be given together with --iso", 2),
        ("--inside left", "must be one of above, below, not 'left'", 2),
        ("--label 77", "label must be one of 1, 2", 1),
        ("--label two", "must begin with numbers of labels such as 5", 2),
        ("--iso 5000", "iso must be within the volume's values", 1),
    ],
)
def test_bad_input(options: str, words: str, code: int, scan: Path, monkeypatch: pytest.MonkeyPatch):
    monkeypatch.chdir(scan.parent)
    done = run("surface", scan, *options.split())
    assert done.code == code
    assert words in done.err
    assert [p.name for p in scan.parent.iterdir()] == [scan.name]
