"""Line density: length for each area, wherever lines are few or many."""

from __future__ import annotations

import numpy as np
import pytest

from intaglio.ink.density import Ground


def parallels(spacing, size, step=1.0):
    """Horizontal lines through a picture of size (height, width)."""
    y, x = np.arange(spacing / 2, size[0], spacing), np.arange(0, size[1] + step / 2, step)
    points = np.stack([np.tile(x, len(y)), np.repeat(y, len(x))], axis=1).astype(np.float32)
    return points, np.arange(0, len(points) + 1, len(x))


def inside(size, border):
    y, x = np.mgrid[border : size[0] - border : 3.7, border : size[1] - border : 3.7]
    return np.stack([x.ravel(), y.ravel()], axis=1).astype(np.float32)


@pytest.mark.parametrize("separation", [1.5, 4.0, 10.0])
@pytest.mark.parametrize("evenness", [0.5, 1.0, 1.3])
def test_parallel_lines_have_one_over_their_distance(separation, evenness):
    size, spacing = (120, 150), evenness * separation
    points, offsets = parallels(spacing, size)
    density = Ground.of(np.ones(size, bool), separation).lines(points, np.ones(len(points), np.float32), offsets)
    # Lines a third farther apart than they should be are seen one by one, a little.
    np.testing.assert_allclose(density.at(inside(size, 20)) * spacing, 1.0, atol=0.02 if evenness <= 1 else 0.08)
    # Up to the border, where half of what is averaged is not there.
    assert np.abs(density.at(inside(size, spacing)) * spacing - 1.0).max() < 0.25


def test_weights_count_as_parts_of_a_line():
    size = (80, 90)
    points, offsets = parallels(4.0, size)
    weight = (points[:, 0] / 90).astype(np.float32)
    density = Ground.of(np.ones(size, bool), 4.0).lines(points, weight, offsets)
    at = inside(size, 15)
    np.testing.assert_allclose(density.at(at) * 4.0, at[:, 0] / 90, atol=0.02)


def test_what_is_not_to_be_filled_does_not_count():
    size = (100, 120)
    points, offsets = parallels(4.0, size)
    left = points[:, 0] <= 60
    region = np.zeros(size, bool)
    region[:, :60] = True
    half = np.concatenate([[0], np.cumsum(left.reshape(len(offsets) - 1, -1).sum(axis=1))])
    density = Ground.of(region, 4.0).lines(points[left], np.ones(left.sum(), np.float32), half)
    at = inside((100, 60), 10)
    np.testing.assert_allclose(density.at(at) * 4.0, 1.0, atol=0.03)
    edge = np.stack([np.full(30, 58.0), np.linspace(20, 80, 30)], axis=1).astype(np.float32)
    np.testing.assert_allclose(density.at(edge) * 4.0, 1.0, atol=0.1)


def test_no_lines_no_density():
    none = np.zeros((0, 2), np.float32)
    for region in (np.ones((7, 5), bool), np.zeros((1, 1), bool)):
        density = Ground.of(region, 3.0).lines(none, none[:, 0], np.zeros(1, np.int64))
        assert (density.at(np.array([[0.5, 0.5], [99, -3]], np.float32)) == 0).all()
