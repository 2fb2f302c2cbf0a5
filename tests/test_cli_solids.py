"""`intaglio voxelize` and `intaglio distance` write what the library makes; `--cut mesh:FILE` opens scans with it."""

from __future__ import annotations

import numpy as np
import pytest
from test_cli_cut import run, scan  # noqa: F401
from test_voxelize import sphere

import intaglio as ig
from intaglio.cli.cuts import selections_of


def write_obj(mesh, path):
    lines = [f"v {x:.9g} {y:.9g} {z:.9g}" for x, y, z in mesh.vertices]
    lines += [f"f {a} {b} {c}" for a, b, c in mesh.triangles + 1]
    path.write_text("\n".join(lines))
    return path


@pytest.fixture
def ball(tmp_path):
    return write_obj(sphere(10, (5, 0, 0), rings=16), tmp_path / "ball.obj")


def test_voxelize(ball, tmp_path, monkeypatch, capfd):
    out = tmp_path / "v.nii.gz"
    assert run(monkeypatch, "voxelize", ball, "-o", out, "--resolution", 40) == 0
    written = ig.read_volume(out)
    made = ig.voxelize(ig.read_mesh(ball), resolution=40)
    assert (written.array == made.array).all()
    assert np.allclose(written.world_from_index, made.world_from_index, atol=1e-4)
    assert "40 x 40 x 40 voxels" in capfd.readouterr().out


def test_distance_on_the_grid_of_a_scan(ball, scan, tmp_path, monkeypatch):  # noqa: F811
    out = tmp_path / "d.nrrd"
    assert run(monkeypatch, "distance", ball, "-o", out, "--like", scan, "--band", "3mm") == 0
    like = ig.read_volume(scan)
    written = ig.read_volume(out)
    assert np.allclose(written.world_from_index, like.world_from_index, atol=1e-4)
    made = ig.distance_field(ig.read_mesh(ball), like=like, band="3mm")
    assert (written.array == made.array).all()
    assert np.abs(written.array).max() == 3


def test_what_had_to_be_assumed_is_said(tmp_path, monkeypatch, capfd):
    mesh = sphere(rings=12)
    path = write_obj(ig.TriangleMesh(mesh.vertices, mesh.triangles[:-3]), tmp_path / "open.obj")
    assert run(monkeypatch, "voxelize", path, "-o", tmp_path / "v.nii", "--spacing", 0.7) == 0
    assert "generalized winding number" in " ".join(capfd.readouterr().err.split())


@pytest.mark.parametrize(
    "words",
    [
        ["voxelize", "MESH", "-o", "v.png"],
        ["voxelize", "MESH", "--resolution", "64", "--spacing", "1"],
        ["voxelize", "SCAN"],
        ["voxelize", "nowhere.obj"],
        ["distance", "MESH", "--band", "wide"],
        ["distance", "MESH", "--resolution", "1"],
        ["distance", "MESH", "--like", "nowhere.nii"],
    ],
)
def test_what_cannot_be_is_said_in_one_line(words, ball, scan, tmp_path, monkeypatch, capfd):  # noqa: F811
    monkeypatch.chdir(tmp_path)
    before = sorted(tmp_path.iterdir())
    assert run(monkeypatch, *({"MESH": ball, "SCAN": scan}.get(word, word) for word in words)) in (1, 2)
    assert capfd.readouterr().err.strip().count("\n") == 0
    assert sorted(tmp_path.iterdir()) == before


def test_a_mesh_cuts(ball, scan, tmp_path, monkeypatch):  # noqa: F811
    whole, cut = tmp_path / "whole.png", tmp_path / "cut.png"
    size = ["--size", "60", "--preset", "mr-default"]
    assert run(monkeypatch, "render", scan, "-o", whole, *size) == 0
    assert run(monkeypatch, "render", scan, "-o", cut, *size, "--cut", f"mesh:{ball}") == 0
    assert whole.read_bytes() != cut.read_bytes()
    (tool,) = selections_of([f"mesh:{ball}"], ig.read_volume(scan))
    assert np.allclose(tool.world_from_tool, np.eye(4))
    assert tool.keep == "outside"
    assert tool.tool.corners.mean(axis=0) == pytest.approx((5, 0, 0), abs=0.01)


@pytest.mark.parametrize(("text", "code"), [("mesh:", 2), ("mesh:nowhere.obj", 1), ("mesh:ball.nii", 1)])
def test_no_such_mesh(text, code, scan, tmp_path, monkeypatch, capfd):  # noqa: F811
    assert run(monkeypatch, "render", "no-such-scan.nii", "--cut", text, "-o", tmp_path / "a.png") == code
    assert "mesh:" in capfd.readouterr().err
