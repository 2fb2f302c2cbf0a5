"""Reflection: directions, poles and seams of the map, and mirrors."""

from __future__ import annotations

import numpy as np
import pytest

import intaglio as ig
from intaglio.rendering.reflection import look_up, reflections


def directions(h=64, w=128):
    """A map whose colour is its own direction."""
    azimuth = ((np.arange(w) + 0.5) / w - 0.5) * 2 * np.pi
    polar = (np.arange(h) + 0.5) / h * np.pi
    x = -np.sin(polar)[:, None] * np.sin(azimuth)
    y = np.sin(polar)[:, None] * np.cos(azimuth)
    z = np.broadcast_to(np.cos(polar)[:, None], x.shape)
    return np.stack([x, y, z], axis=2).astype(np.float32)


def test_every_direction_finds_itself():
    d = np.random.default_rng(3).normal(size=(2000, 3))
    d /= np.linalg.norm(d, axis=1, keepdims=True)
    # Bilinear between pixels of 2.8 degrees; at the poles half a pixel is missing.
    assert np.abs(look_up(directions(), d.astype(np.float32)) - d).max() < 0.03


def test_the_seam_behind_the_patient_is_closed():
    seam = np.array([[1e-4, -1.0, 0.0], [-1e-4, -1.0, 0.0]], dtype=np.float32)
    a, b = look_up(directions(), seam)
    assert np.allclose(a, b, atol=1e-3)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_a_ball_mirrors_by_the_law_of_reflection(projection):
    z, y, x = np.mgrid[:40, :40, :40] - 19.5
    ball = ig.Volume.from_array((14 - np.sqrt(x * x + y * y + z * z)).astype(np.float32))
    camera = ig.Camera.looking("anterior", ball, (90, 90), projection=projection)
    gb = ig.isosurface(ball, 0.0, camera)
    seen = reflections(gb, directions(256, 512))
    assert np.allclose(seen[45, 45], (0, 1, 0), atol=0.06)
    py, px = np.nonzero(gb.mask & (gb.facing > 0.2))
    r = camera.rays()[3:]
    view = r[0] + (px[:, None] + 0.5) * r[1] + (py[:, None] + 0.5) * r[2]
    view /= np.linalg.norm(view, axis=1, keepdims=True)
    n = gb.normal[py, px]
    got = seen[py, px]
    # Incoming and outgoing ray lie evenly on both sides of the normal.
    assert np.abs(np.einsum("nc,nc->n", got, n) + np.einsum("nc,nc->n", view, n)).max() < 0.02
    assert np.abs(np.einsum("nc,nc->n", got, np.cross(view, n))).max() < 0.02
    assert (seen[~gb.mask] == 0).all()


def test_shade_mirrors_as_much_as_asked():
    z, y, x = np.mgrid[:30, :30, :30] - 14.5
    ball = ig.Volume.from_array((10 - np.sqrt(x * x + y * y + z * z)).astype(np.float32))
    gb = ig.isosurface(ball, 0.0, ig.Camera.looking("left", ball, (60, 60)))
    red = np.zeros((4, 8, 3), dtype=np.float32)
    red[..., 0] = 1.0
    plain, half, all_ = (ig.shade(gb, environment=e, mirror=m).array for e, m in ((None, 0.5), (red, 0.5), (red, 1.0)))
    assert np.allclose(all_[30, 30, :3], (1, 0, 0), atol=1e-5)
    assert np.allclose(half[30, 30, :3], 0.5 * (plain[30, 30, :3] + (1, 0, 0)), atol=0.01)
    with pytest.raises(ig.InputError, match="mirror must be"):
        ig.shade(gb, environment=red, mirror=2.0)
    with pytest.raises(ig.InputError, match="environment must be"):
        ig.shade(gb, environment=np.zeros((4, 4), dtype=np.float32))
