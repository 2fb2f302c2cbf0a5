"""Suggestive contours run where a surface is about to turn away, and nowhere else."""

from __future__ import annotations

import numpy as np
import oracle
import pytest

from intaglio import Camera, GBuffer, isosurface
from intaglio.ink.suggestive import suggestive_contours

SHAPE = (40, 60, 80)
LENGTH, HEIGHT = 24.0, 2.5


def waves(p):
    """Swells along y: crests at x = 0, 24, ... mm."""
    return (HEIGHT * np.cos(2 * np.pi * p[..., 0] / LENGTH) - p[..., 2]) / np.hypot(1, 2 * np.pi * HEIGHT / LENGTH)


def distances(points, camera, x):
    """From each line of height 0 across the swells at x mm, in pixels, by the nearest of them."""
    ends = camera.project(np.stack([np.repeat(x, 2), np.tile([-20.0, 20.0], len(x)), np.zeros(2 * len(x))], axis=1))[:, :2]
    a, b = ends[::2, None], ends[1::2, None]
    along = (b - a) / np.linalg.norm(b - a, axis=2, keepdims=True)
    away = points[None] - a
    return np.abs(away[..., 0] * along[..., 1] - away[..., 1] * along[..., 0]).min(axis=0)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("side", [1, -1])
@pytest.mark.parametrize("across", [0.0, 0.3])
def test_lines_lie_at_inflections_behind_crests(projection, side, across):
    """Where the swell turns from hollow to convex towards the viewer; not where it turns back."""
    volume = oracle.sampled(waves, SHAPE)
    camera = Camera.looking((side * 0.6, across, 1.0), volume, 320, projection=projection)
    gb = isosurface(volume, 0.0, camera)
    points, strength, offsets = suggestive_contours(gb, sigma=2.0, least=2e-3)
    assert len(points) == len(strength) == offsets[-1] > 150
    behind = np.array([-30.0, -6.0, 18.0]) if side > 0 else np.array([-18.0, 6.0, 30.0])
    # Not where the volume ends.
    corners = camera.project([[x, y, 0.0] for x in (-34, 34) for y in (-24, 24)])[:, :2]
    low, high = np.sort(corners, axis=0)[[1, 2]]
    here = ((points > low) & (points < high)).all(axis=1)
    assert here.sum() > 60
    assert distances(points[here], camera, behind).max() < (1.2 if across == 0 else 4.0)
    if across == 0 and projection == "orthographic":
        # Along the swell, in mm: -f''' / (1 + f'^2)^2 of f = h cos(k x) where f'' = 0.
        k = 2 * np.pi / LENGTH
        exact = HEIGHT * k**3 / (1 + (HEIGHT * k) ** 2) ** 2
        # Averaging over two pixels takes a little of it.
        assert np.median(strength[here]) == pytest.approx(exact, rel=0.12)
        assert len(suggestive_contours(gb, sigma=2.0, least=1.3 * exact)[0]) < 0.02 * len(points)


def test_seen_squarely_nothing_is_about_to_turn_away():
    low = oracle.sampled(lambda p: 0.3 * np.cos(p[..., 0] / 4) - p[..., 2], SHAPE)
    gb = isosurface(low, 0.0, Camera.looking("superior", low, 200))
    assert len(suggestive_contours(gb, sigma=2.0, least=1e-4)[0]) == 0


def test_a_ball_has_none():
    volume = oracle.sampled(oracle.Sphere(16.0).field, (48, 48, 48))
    gb = isosurface(volume, 0.0, Camera.looking((1, 2, 1), volume, 160))
    assert len(suggestive_contours(gb, sigma=2.0, least=1e-4)[0]) == 0


def test_empty_and_flat_pictures_have_none():
    for gb in (oracle.sheet((9, 12)), oracle.sheet((1, 1)), oracle.sheet((1, 9)), GBuffer.empty(oracle.sheet((9, 12)).camera)):
        points, strength, offsets = suggestive_contours(gb, sigma=1.0, least=0.01)
        assert points.shape == (0, 2)
        assert strength.shape == (0,)
        assert offsets.tolist() == [0]


def test_number_of_threads_changes_nothing(monkeypatch):
    volume = oracle.sampled(waves, SHAPE)
    gb = isosurface(volume, 0.0, Camera.looking((0.9, 0.3, 1.0), volume, 200))
    results = []
    for threads in "12":
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        results.append(suggestive_contours(gb, sigma=2.0, least=2e-3))
    for a, b in zip(*results, strict=True):
        np.testing.assert_array_equal(a, b)
