"""`--cut` opens plates and pictures; its texts are judged before the scan is read."""

from __future__ import annotations

import sys

import numpy as np
import pytest
import SimpleITK as sitk
import typer

from intaglio.cli import main
from intaglio.cli.cuts import check_cuts, selections_of
from intaglio.volume import Volume


@pytest.fixture
def scan(tmp_path):
    z, y, x = np.mgrid[:40, :40, :40] - 19.5
    ball = (1000 - 50 * np.sqrt(x * x + y * y + z * z)).astype(np.int16)
    path = tmp_path / "ball.nii"
    sitk.WriteImage(sitk.GetImageFromArray(ball), str(path))
    mask = tmp_path / "mask.nii"
    sitk.WriteImage(sitk.GetImageFromArray((x > 0).astype(np.uint8)), str(mask))
    return path


def run(monkeypatch, *words):
    monkeypatch.setattr(sys, "argv", ["intaglio", *map(str, words)])
    try:
        main()
    except SystemExit as end:
        return end.code or 0
    return 0


@pytest.mark.parametrize("command", ["hatch", "render"])
@pytest.mark.parametrize("tool", ["plane:anterior", "plane:left,3", "plane:0,-1,0.5,2", "mask"])
def test_a_cut_changes_the_picture(command, tool, scan, tmp_path, monkeypatch):
    tool = scan.with_name("mask.nii") if tool == "mask" else tool
    whole, cut = tmp_path / "whole.png", tmp_path / "cut.png"
    size = (
        ["--size", "300", "--dpi", "50", "--style", "pen-and-ink"]
        if command == "hatch"
        else ["--size", "60", "--preset", "mr-default"]
    )
    assert run(monkeypatch, command, scan, "-o", whole, *size) == 0
    assert run(monkeypatch, command, scan, "-o", cut, *size, "--cut", tool) == 0
    assert whole.read_bytes() != cut.read_bytes()


@pytest.mark.parametrize(
    "text", ["plane:", "plane:up", "plane:1,2", "plane:1,2,3,4,5", "plane:a,b,c", "mesh", "plane:left,up", "bone.stl"]
)
def test_a_cut_that_cannot_be_read_is_refused_first(text, monkeypatch, capfd, tmp_path):
    with pytest.raises(typer.BadParameter, match="must be"):
        check_cuts([text])
    assert run(monkeypatch, "hatch", "no-such-scan.nii", "--cut", text, "-o", tmp_path / "a.svg") == 2
    said = capfd.readouterr().err.strip()
    assert said.count("\n") == 0
    assert "no-such-scan" not in said


def test_planes_count_from_the_middle():
    volume = Volume.from_array(np.zeros((11, 11, 11), dtype=np.uint8))
    (plane,) = selections_of(["plane:superior,2"], volume)
    assert np.allclose(plane.world_from_tool[:3, 3], (5, 5, 7))
    assert np.allclose(plane.world_from_tool[:3, 2], (0, 0, 1))
