"""Labels and tools beside a scan: where they lie is checked, and said if they cannot belong to it."""

from __future__ import annotations

import re
from pathlib import Path

import numpy as np
import pytest
from test_cli import SMALL, ball, folder, run, scan, write_scan  # noqa: F401

import intaglio as ig
from intaglio.cli.placing import distance_apart, read_beside
from intaglio.errors import InputError
from intaglio.io.raster import pixels_of


def moved(path: Path, right: float, kind: str = "mask") -> Path:
    """A mask of the egg, its mesh or its distances, so many mm to the right of where the scan is."""
    world = np.eye(4)
    world[0, 3] = right
    mask = ig.Volume((ball() > 500).astype(np.uint8), world)
    if kind == "stl":
        ig.surface(ig.signed_distance(mask)).save(path)
    else:
        ig.write_volume(mask if kind == "mask" else ig.signed_distance(mask), path)
    return path


TOOLS = [
    ("--cut {mask}", "mask.nii.gz", "mask"),
    ("--cut {field}", "field.nrrd", "field"),
    ("--cut mesh:{stl}", "egg.stl", "stl"),
    ("--labels {mask} --label 1", "mask.nii.gz", "mask"),
    ("--surface 500 --labels {mask} --label 1:contour", "mask.nii.gz", "mask"),
]


@pytest.mark.parametrize(("options", "name", "kind"), TOOLS)
def test_what_lies_elsewhere_is_refused(options: str, name: str, kind: str, scan: Path, folder: Path):  # noqa: F811
    tool = moved(folder / name, 300, kind)
    done = run("hatch", scan, *SMALL.split(), *options.format(**{kind: tool}).split())
    assert done.code == 1
    assert re.search(rf"error: {name}: lies 2\d\d mm away from egg.nii.gz, so they cannot belong together", done.err)
    assert [p.name for p in folder.iterdir()] == [name]


@pytest.mark.parametrize(("options", "name", "kind"), TOOLS)
def test_what_meets_the_scan_is_drawn(options: str, name: str, kind: str, scan: Path, folder: Path):  # noqa: F811
    tool = moved(folder / name, 6, kind)
    done = run("hatch", scan, *SMALL.split(), "-o", "a.svg", *options.format(**{kind: tool}).split())
    assert done.code == 0, done.err
    assert "away" not in done.err


@pytest.mark.parametrize(
    ("cut", "part"), [("plane:superior,200", "nothing"), ("plane:superior,-200", "everything"), ("plane:superior,5", "")]
)
def test_a_plane_that_misses_is_remarked(cut: str, part: str, scan: Path, folder: Path):  # noqa: F811
    done = run("render", scan, "--size", 30, "--cut", cut)
    assert done.code == 0
    assert ("removes " in done.err) == bool(part)
    if part:
        assert f"note: --cut {cut} removes {part}: the scan ends 12 mm from its middle" in done.err


def test_labels_without_a_place_lie_where_the_scan_does(scan: Path, folder: Path, capsys):  # noqa: F811
    volume = ig.read_volume(scan)
    (folder / "labels.nrrd").write_bytes(
        b"NRRD0004\ntype: uint8\ndimension: 3\nsizes: 28 26 24\nencoding: raw\n\n" + (ball() > 500).astype(np.uint8).tobytes()
    )
    labels = read_beside(folder / "labels.nrrd", volume)
    np.testing.assert_array_equal(labels.world_from_index, volume.world_from_index)
    assert "taken to lie in the same place" in " ".join(capsys.readouterr().err.split())
    other = ig.Volume.from_array(ball()[:20])
    with pytest.raises(InputError, match="lies 7 mm away"):
        read_beside(folder / "labels.nrrd", other)


def test_distance_apart_is_that_of_boxes():
    volume = ig.Volume.from_array(np.zeros((4, 4, 4), np.uint8), spacing=2.0)
    box = np.array([(0.0, 0, 0), (1, 1, 1)])
    # Voxels reach a millimetre beyond their centres, from -1 to 7.
    assert distance_apart(box + np.array([7.5, 0, 0]), volume) == pytest.approx(0.5)
    assert distance_apart(box + np.array([10, -5, 0]), volume) == pytest.approx(np.hypot(3, 3))
    assert distance_apart(box + np.array([6.9, 6.9, -1.9]), volume) == 0
    assert distance_apart(box * 100 - 50, volume) == 0


def test_too_many_pixels_are_refused_before_the_strokes(scan: Path, folder: Path, monkeypatch: pytest.MonkeyPatch):  # noqa: F811
    def illustrate(*_: object, **__: object) -> None:
        raise AssertionError("too late")

    monkeypatch.setattr("intaglio.plate.illustrate", illustrate)
    for command in ("hatch", "contour"):
        done = run(command, scan, "--width", 5000, "--dpi", 2400, "--size", 50, "-o", "a.png")
        assert done.code == 1
        assert re.search(r"error: dpi must be at most \d+ for a plate of 5000 x \d+", done.err)
    monkeypatch.setattr("intaglio.io.limits._free_memory", lambda: 1e6)
    done = run("render", scan, "--size", 2000)
    assert done.code == 1
    assert re.search(r"a picture of \d+ x \d+ rays: needs .* of memory, .* are free; take a smaller --size", done.err)
    with pytest.raises(InputError, match="dpi must be between"):
        pixels_of(100, 100, 5)
