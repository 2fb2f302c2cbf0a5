"""Several semi-transparent isosurfaces at once."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import oracle
import pytest

import intaglio as ig

CLEAR = (0.0, 0.0, 0.0, 0.0)
RED, GREEN, BLUE = (0.9, 0.2, 0.1), (0.2, 0.8, 0.3), (0.1, 0.3, 0.9)


def premultiplied(volume, camera, surfaces, **options) -> np.ndarray:
    options = {"lit": False, "background": CLEAR, **options}
    out = ig.render(volume, None, camera, mode="isosurface", surfaces=surfaces, **options).array.astype(np.float64)
    out[..., :3] *= out[..., 3:]
    return out


def ball(n: int = 33, radius: float = 12.0, axes=None) -> ig.Volume:
    return oracle.sampled(oracle.Sphere(radius).field, (n, n, n), oracle.centred((n, n, n), axes))


def over(layers) -> np.ndarray:
    out = np.zeros(4)
    for colour, alpha in layers:
        out += (1 - out[3]) * alpha * np.array([*colour, 1.0])
    return out


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_two_nested_spheres(projection):
    """Through the middle a ray crosses the outer one, the inner one twice and the outer one again."""
    volume = ball()
    camera = ig.Camera.looking("anterior", volume, 9, projection=projection)
    got = premultiplied(volume, camera, [(0.0, RED, 0.3), (5.0, GREEN, 0.45)])[4, 4]
    assert got[3] == pytest.approx(1 - (1 - 0.3) ** 2 * (1 - 0.45) ** 2, abs=1e-6)
    np.testing.assert_allclose(got, over([(RED, 0.3), (GREEN, 0.45), (GREEN, 0.45), (RED, 0.3)]), atol=1e-6)


@pytest.mark.parametrize("axes", [np.eye(3), np.diag([0.7, 1.0, 1.2]), [[0.9, -0.3, 0], [0.3, 0.9, 0.2], [0, 0, 1.1]]])
@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
def test_every_crossing_counts_in_its_order(projection, axes):
    """Except where the twin, with far finer steps, finds crossings less than half a voxel apart or hardly any way inside."""
    volume, levels = ball(27, 9.0, axes), (-2.0, 0.0, 0.3, 5.0)
    surfaces = list(zip(levels, (RED, GREEN, BLUE, RED), (0.2, 0.3, 0.4, 0.5), strict=True))
    camera = ig.Camera.looking((0.4, 1, 0.3), volume, 12, projection=projection)
    got = premultiplied(volume, camera, surfaces)
    compared = 0
    for y in range(got.shape[0]):
        for x in range(got.shape[1]):
            found = oracle.crossings(volume, camera, x + 0.5, y + 0.5, levels)
            if any(b[1] == a[1] and b[0] - a[0] < 0.8 for a, b in pairwise(found)):
                continue
            np.testing.assert_allclose(got[y, x], over([surfaces[n][1:] for _, n in found]), atol=1e-5)
            compared += len(found) > 2
    assert compared > 12


def test_order_of_the_surfaces_given_does_not_matter():
    volume = ball()
    camera = ig.Camera.looking((0.4, 1, 0.3), volume, 24)
    surfaces = [(0.0, RED, 0.3), (5.0, GREEN, 0.45), (7.0, BLUE, 0.6)]
    np.testing.assert_array_equal(premultiplied(volume, camera, surfaces), premultiplied(volume, camera, surfaces[::-1]))


def test_an_opaque_surface_hides_those_behind_it():
    volume = ball()
    camera = ig.Camera.looking("anterior", volume, 9)
    got = premultiplied(volume, camera, [(0.0, RED, 1.0), (5.0, GREEN, 1.0)])[4, 4]
    np.testing.assert_allclose(got, [*RED, 1.0], atol=1e-6)


@pytest.mark.parametrize("light", [ig.Light(), ig.Light(kind="point", position=(20.0, 60.0, 25.0), frame="world")])
def test_an_opaque_surface_is_that_of_the_g_buffer(light):
    """Central differences against a tricubic spline: one voxel of a sphere of twelve."""
    volume = ball(41)
    camera = ig.Camera.looking((0.4, 1, 0.3), volume, 64)
    gb = ig.isosurface(volume, 0.0, camera, lights=(light,))
    want = ig.shade(gb, colour=RED).array
    got = ig.render(volume, None, camera, mode="isosurface", surfaces=[(0.0, RED, 1.0)], lights=(light,)).array
    inner = gb.mask & (np.abs(want - 1).max(axis=2) > 0.01)
    outline = (got[..., :3] != 1).any(axis=2) != gb.mask
    assert outline.sum() <= 0.02 * gb.mask.sum()
    off = np.abs(got - want)[inner & ~outline].max(axis=1)
    assert np.mean(off) < 0.01
    # At the limb a normal turns by a pixel's width.
    assert np.quantile(off, 0.98) < 0.03


def test_the_inside_is_lit_as_it_is_seen():
    """The back of the sphere is seen from inside when the front is cut away by the volume's face."""
    n = 33
    world = oracle.centred((n, n, n))
    world[1, 3] = -(n - 1)
    volume = oracle.sampled(oracle.Sphere(12.0).field, (n, n, n), world)
    camera = ig.Camera.looking("anterior", volume, 9, margin=0)
    got = ig.render(volume, None, camera, mode="isosurface", surfaces=[(0.0, RED, 1.0)], lights=(ig.Light(direction=(0, 0, 1)),))
    np.testing.assert_allclose(got.array[4, 4, :3], np.minimum(np.array(RED) + 0.25, 1.0), atol=0.01)


def test_skipped_blocks_hide_no_crossing(monkeypatch):
    volume = ball(41)
    camera = ig.Camera.looking((0.4, 1, 0.3), volume, 50, projection="perspective")
    surfaces = [(0.0, RED, 0.3), (5.0, GREEN, 0.45)]
    skipped = premultiplied(volume, camera, surfaces)
    low, high = (np.full((5, 5, 5), v, dtype=np.float32) for v in (-np.inf, np.inf))
    monkeypatch.setattr("intaglio.rendering.raycast.min_max_blocks", lambda _: (low, high))
    # Crossings are refined between the same samples.
    np.testing.assert_allclose(skipped, premultiplied(volume, camera, surfaces), atol=1e-5)


def test_bytes_are_the_same_on_any_number_of_threads(monkeypatch):
    volume = ball()
    camera = ig.Camera.looking((0.4, 1, 0.3), volume, 90)
    shots = []
    for threads in "12":
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        shots.append(premultiplied(volume, camera, [(0.0, RED, 0.3), (5.0, GREEN, 0.45)], lit=True).tobytes())
    assert shots[0] == shots[1]


def test_a_body_of_yes_and_no_has_a_surface():
    values = np.zeros((12, 12, 12), dtype=bool)
    values[3:9, 3:9, 3:9] = True
    volume = ig.Volume.from_array(values)
    got = premultiplied(volume, ig.Camera.looking("anterior", volume, 9), [(0.5, RED, 0.5)])
    np.testing.assert_allclose(got[4, 4], over([(RED, 0.5), (RED, 0.5)]), atol=1e-6)
