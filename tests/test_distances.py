"""Volumes of signed distances: told from scans, written and read as such, drawn at 0 with the body below."""

from __future__ import annotations

import math
from collections.abc import Callable
from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from hypothesis import given, settings, strategies as st

import intaglio as ig
from intaglio.io.distances import GUESSED, MARK, are_distances
from intaglio.io.volume_files import KINDS
from intaglio.parts import Part
from intaglio.rendering.isovalue import body_side, is_label_map


def torus(n: int = 40, spacing: float = 1.0) -> ig.Volume:
    """Radii 10 and 4 mm, exact."""
    z, y, x = (np.mgrid[:n, :n, :n] - (n - 1) / 2) * spacing
    field = np.hypot(np.hypot(x, y) - 10.0, z) - 4.0
    return replace(ig.Volume.from_array(field.astype(np.float32), spacing), distances=True)


@pytest.mark.parametrize("kind", KINDS)
def test_files_say_that_they_hold_distances(kind: str, tmp_path: Path):
    # A band so narrow that the values alone could not tell.
    field = torus()
    band = replace(field, array=np.clip(field.array, -0.4, 0.4))
    assert not are_distances(band.array, band.world_from_index)
    ig.write_volume(band, tmp_path / f"field{kind}")
    again = ig.read_volume(tmp_path / f"field{kind}")
    assert again.distances
    assert again.notes == ()
    np.testing.assert_array_equal(again.array, band.array)
    ig.write_volume(replace(band, distances=False), tmp_path / f"scan{kind}")
    assert not ig.read_volume(tmp_path / f"scan{kind}").distances


def test_a_mark_on_whole_numbers_is_not_believed(tmp_path: Path):
    image = sitk.GetImageFromArray(np.arange(60, dtype=np.int16).reshape(3, 4, 5))
    image.SetMetaData("ITK_FileNotes", MARK)
    sitk.WriteImage(image, str(tmp_path / "a.nii"))
    assert not ig.read_volume(tmp_path / "a.nii").distances
    with pytest.raises(ig.InputError, match="distances must be floats, not int16"):
        ig.Volume(np.zeros((2, 2, 2), np.int16), np.eye(4), distances=True)


def test_fields_of_others_are_told_by_their_slope(tmp_path: Path):
    ig.write_volume(replace(torus(), distances=False), tmp_path / "field.nrrd")
    again = ig.read_volume(tmp_path / "field.nrrd")
    assert again.distances
    assert again.notes == (GUESSED,)


@settings(max_examples=40, deadline=None)
@given(
    sides=st.tuples(*[st.integers(12, 40)] * 3),
    spacing=st.tuples(*[st.floats(0.3, 3.0)] * 3),
    share=st.floats(0.2, 0.8),
    angle=st.floats(0, math.pi),
    half=st.booleans(),
)
def test_balls_and_boxes_in_any_pose_are_told(sides, spacing, share, angle, half):
    turn = np.array([[math.cos(angle), -math.sin(angle), 0], [math.sin(angle), math.cos(angle), 0], [0, 0, 1]])
    world = np.eye(4)
    world[:3, :3] = turn * spacing
    index = np.stack(np.meshgrid(*[np.arange(n) for n in sides], indexing="ij")[::-1], axis=-1)
    p = (index - (np.array(sides[::-1]) - 1) / 2) @ world[:3, :3].T
    radius = share * min(np.array(sides[::-1]) * spacing) / 2 + max(spacing)
    q = np.abs(p) - radius
    box = np.linalg.norm(np.maximum(q, 0), axis=-1) + np.minimum(q.max(axis=-1), 0)
    field = (box if half else np.linalg.norm(p, axis=-1) - radius).astype(np.float32)
    assert are_distances(field, world)
    assert not are_distances(1.5 * field, world)
    assert not are_distances(np.abs(field), world)


@pytest.mark.parametrize("name", ["ct_head.nii.gz", "engine.nii.gz", "tooth.nhdr", "mr_head.nii.gz", "ct_abdomen.nii.gz"])
def test_scans_are_not_taken_for_distances(name: str, shared: Callable[[str], Path]):
    scan = ig.read_volume(shared(f"volumes/{name}"))
    centred = scan.array.astype(np.float32) - np.float32(scan.array.mean())
    steps = np.abs(np.diff(centred, axis=2))
    for percent in (10, 50, 90):  # so that the slopes of some are 1
        unit = max(float(np.percentile(steps[steps > 0], percent)), 1e-6)
        assert not are_distances(centred / unit, scan.world_from_index)
    assert not is_label_map(scan)


@pytest.mark.parametrize(
    ("name", "labels"), [("ct_abdomen_labels.nii.gz", True), ("mr_head_labels.nrrd", True), ("bonsai.nii.gz", False)]
)
def test_labels_are_told_from_scans(name: str, labels: bool, shared: Callable[[str], Path]):
    assert is_label_map(ig.read_volume(shared(f"volumes/{name}"))) is labels


def test_labels_of_few_voxels():
    array = np.zeros((9, 9, 9), np.uint8)
    assert not is_label_map(ig.Volume.from_array(array))
    array[4, 4, 2:7] = 3
    array[2, 2:5, 2] = 7
    assert is_label_map(ig.Volume.from_array(array))
    assert not is_label_map(ig.Volume.from_array(array.astype(np.float32)))
    assert not is_label_map(ig.Volume.from_array(np.arange(729, dtype=np.int16).reshape(9, 9, 9)))


def test_what_makes_fields_says_so(shared: Callable[[str], Path]):
    ball = torus().array < 0
    mask = ig.Volume.from_array(ball)
    a = ig.signed_distance(mask)
    b = ig.offset(a, 1)
    made = (a, b, ig.union(a, b), ig.difference(b, a), ig.redistance(b), ig.shell(a, 2), ig.morph(a, b, 0.5))
    assert all(field.distances for field in made)
    assert Part(volume=ig.Volume.from_array(ball.astype(np.uint8)), label=1).body[0].distances
    mesh = ig.surface(a)
    assert ig.distance_field(mesh, resolution=20).distances
    assert not ig.voxelize(mesh, resolution=20).distances


def test_a_field_is_seen_from_outside():
    field = torus()
    camera = ig.Camera.looking("superior", field, 60)
    gb = ig.isosurface(field, 0.0, camera)
    hit = np.isfinite(gb.depth)
    assert 0.2 < hit.mean() < 0.5
    assert not hit[30, 30], "the hole"
    assert (gb.normal[hit] @ -camera.forward > 0).all()
    assert body_side(field) == "below"
    assert body_side(field, "above") == "above"
    with pytest.raises(ig.InputError, match="inside must be above or below, not 'left'"):
        Part(volume=field, inside="left")  # type: ignore[arg-type]


def test_parts_and_surfaces_take_the_zero_level():
    field = torus()
    assert Part(volume=field).body == (field, 0.0, "below")
    assert Part(volume=field, iso=1.5).body == (field, 1.5, "below")
    assert Part(volume=field, inside="above").body == (field, 0.0, "above")
    assert ig.body_surface(field)[0] == 0.0
    grown = ig.surface(field, 1.0)
    # A torus of radii R and r holds 2 pi^2 R r^2.
    a, b, c = np.moveaxis(grown.vertices[grown.triangles], 1, 0)
    assert (np.cross(a, b) * c).sum() / 6 == pytest.approx(2 * math.pi**2 * 10 * 5**2, rel=0.02)


def test_plates_of_fields_need_no_isovalue():
    field = torus()
    camera = ig.Camera.looking("superior", field, 60)
    told = replace(field, distances=False)
    for draw in (ig.hatch, ig.contour):
        plain = draw(field, camera=camera, width_mm=15)
        explicit = draw(told, iso=0.0, inside="below", camera=camera, width_mm=15)
        assert sum(len(layer.strokes) for layer in plain.layers)
        for a, b in zip(plain.layers, explicit.layers, strict=True):
            np.testing.assert_array_equal(a.strokes.points, b.strokes.points)
    first = next(ig.turntable(field, frames=2, size=60, width_mm=15))
    assert sum(len(layer.strokes) for layer in first.layers)
