"""Valleys and ridges run where the surface bends most, and nowhere else."""

from __future__ import annotations

import dataclasses

import numpy as np
import oracle
import pytest

from intaglio import Camera, GBuffer, isosurface
from intaglio.ink.features import feature_lines

SHAPE = (40, 56, 56)
OTHER = {"valley": "ridge", "ridge": "valley"}
each_kind = pytest.mark.parametrize("kind", OTHER)


def fold(angle: float, kind: str, slope: float = 1.0, at: float = 0.4):
    """Two planes that meet, at `at` mm from the middle, in a straight valley or ridge in the direction of `angle`."""
    across = np.array([np.sin(angle), -np.cos(angle), 0.0])
    sign = 1.0 if kind == "valley" else -1.0

    def field(p):
        return (sign * slope * np.abs(p @ across - at) - p[..., 2]) / np.hypot(1, slope)

    along = np.array([np.cos(angle), np.sin(angle), 0.0])
    return field, [across * at - 10 * along, across * at + 10 * along]


def from_line(points, ends):
    """Distance from a line through two image positions, and place along it, in pixels."""
    along = (ends[1] - ends[0]) / np.linalg.norm(ends[1] - ends[0])
    away = points - ends[0]
    return np.abs(away @ (-along[1], along[0])), away @ along


@each_kind
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("sigma", [1.0, 3.0])
@pytest.mark.parametrize("angle", [0.0, 0.4, np.pi / 4, 1.2, 2.5])
@pytest.mark.parametrize(("view", "near"), [("superior", 0.3), ((0.3, 0.2, 1.0), 0.5)])
def test_the_line_of_a_fold_is_straight_and_in_its_place(kind, projection, sigma, angle, view, near):
    """Seen obliquely, smoothing in the picture weighs the side that is turned to the viewer more."""
    field, ends = fold(angle, kind)
    volume = oracle.sampled(field, SHAPE)
    camera = Camera.looking(view, volume, 160, projection=projection)
    gb = isosurface(volume, 0.0, camera)
    points, strength, offsets = feature_lines(gb, kind, sigma=sigma, least=0.1)
    ends = camera.project(ends)[:, :2]
    away, along = from_line(points, ends)
    inner = (along > 0) & (along < np.linalg.norm(ends[1] - ends[0]))
    here = inner & (away < 10)
    # A voxel is 2.5 pixels.
    assert away[here].max() < near
    gaps = np.diff(np.sort(np.concatenate([[0], along[here], [np.linalg.norm(ends[1] - ends[0])]])))
    assert gaps.max() < 4.0
    assert offsets[-1] == len(points) == len(strength)
    # A sharp fold is rounded to about a voxel.
    assert 0.3 < strength[here].min() <= strength[here].max() < 2.0
    other = feature_lines(gb, OTHER[kind], sigma=3.0, least=0.1)[0]
    away, along = from_line(other, ends)
    assert not ((away < 5) & (along > 0) & (along < np.linalg.norm(ends[1] - ends[0]))).any()


def test_edges_of_a_box_are_ridges():
    turn = np.linalg.qr(np.array([[2.0, 1.0, 0.5], [-1.0, 2.0, 1.0], [0.3, -1.0, 2.0]]))[0]
    half = 14.0

    def field(p):
        return half - np.abs(p @ turn).max(axis=-1)

    volume = oracle.sampled(field, (56, 56, 56))
    towards = turn @ (1.0, 1.3, 0.8)
    camera = Camera.looking(towards, volume, 160)
    gb = isosurface(volume, 0.0, camera)
    points = feature_lines(gb, "ridge", sigma=1.5, least=0.15)[0]
    corner = turn @ np.full(3, half)
    covered = np.zeros(len(points), dtype=bool)
    for axis in range(3):
        ends = camera.project([corner, corner - 2 * half * turn[:, axis]])[:, :2]
        away, along = from_line(points, ends)
        length = np.linalg.norm(ends[1] - ends[0])
        near = (away < 1.0) & (along > -2) & (along < length)
        covered |= near
        places = np.sort(along[near & (along > 5) & (along < length - 5)])
        assert np.diff(places).max() < 3.0
        assert np.ptp(places) > length - 14
    assert covered.mean() > 0.95


@each_kind
@pytest.mark.parametrize("radius", [8.0, 16.0])
def test_a_sphere_has_none(kind, radius):
    """It bends by 1 / r everywhere, but for some thousandths."""
    volume = oracle.sampled(oracle.Sphere(radius).field, (48, 48, 48))
    gb = isosurface(volume, 0.0, Camera.looking((1, 2, 3), volume, 120))
    assert len(feature_lines(gb, kind, sigma=2.0, least=1.05 / radius)[0]) == 0


@each_kind
def test_what_bends_less_than_asked_has_no_line(kind):
    volume = oracle.sampled(fold(0.4, kind, slope=0.3)[0], SHAPE)
    gb = isosurface(volume, 0.0, Camera.looking("superior", volume, 120))
    strength = feature_lines(gb, kind, sigma=1.0, least=0.05)[1]
    assert len(strength) > 50
    assert strength.min() >= 0.05
    assert len(feature_lines(gb, kind, sigma=1.0, least=1.01 * strength.max())[1]) == 0


def test_a_fold_between_two_pixels_is_a_ridge_unless_it_is_the_rim_of_a_section():
    gb = oracle.sheet((40, 60))
    side = np.where(np.arange(60) < 25, -0.6, 0.6)[:, None] * gb.camera.right
    gb.normal[:] = side - 0.8 * gb.camera.forward
    points, _, offsets = feature_lines(gb, "ridge", sigma=1.0, least=0.5)
    assert len(offsets) == 2
    np.testing.assert_allclose(points[:, 0], 25.0)
    gb.section[:, :25] = 0.5
    assert len(feature_lines(dataclasses.replace(gb), "ridge", sigma=1.0, least=0.5)[0]) == 0


@each_kind
def test_a_flat_or_empty_picture_has_none(kind):
    for gb in (oracle.sheet((9, 12)), oracle.sheet((1, 1)), GBuffer.empty(oracle.sheet((9, 12)).camera)):
        points, strength, offsets = feature_lines(gb, kind, sigma=1.0, least=0.01)
        assert points.shape == (0, 2)
        assert strength.shape == (0,)
        assert offsets.tolist() == [0]
