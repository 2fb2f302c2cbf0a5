"""Refinements: the size that was asked for, ever nearer to the full picture, and no work that nobody asked for."""

from __future__ import annotations

import numpy as np
import pytest

import intaglio as ig
from intaglio.rendering import progressive


@pytest.fixture(scope="module")
def ball():
    z, y, x = np.mgrid[:40, :40, :40] - 19.5
    return ig.Volume.from_array((15 - np.sqrt(x * x + y * y + z * z)).astype(np.float32))


SOLID = ig.TransferFunction.from_points([(-0.5, "#ffffff", 0.0), (0.5, "#c04020", 0.9), (20.0, "#c04020", 0.9)])


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("size", [(96, 96), (101, 67), (1, 5)])
def test_each_is_nearer_to_the_picture(ball, projection, size):
    camera = ig.Camera.looking("anterior-left", ball, size, projection=projection)
    full = ig.render(ball, SOLID, camera).array
    images = list(progressive.refinements(ball, SOLID, camera))
    assert [image.array.shape for image in images] == [full.shape] * 3
    errors = [float(np.sqrt(np.mean((image.array - full) ** 2))) for image in images]
    assert errors[2] == 0.0
    if min(size) > 50:
        assert errors[1] < errors[0] < 0.15


def test_the_picture_does_not_shift(ball):
    camera = ig.Camera.looking("anterior", ball, (90, 90))
    y, x = np.mgrid[:90, :90]

    def middle(array):
        ink = 1 - array[..., 2]
        return np.array([(x * ink).sum(), (y * ink).sum()]) / ink.sum()

    coarse, full = (image.array for image in progressive.refinements(ball, SOLID, camera, factors=(6, 1), lit=False))
    assert np.abs(middle(coarse) - middle(full)).max() < 0.2


def test_what_is_not_asked_for_is_not_rendered(ball, monkeypatch):
    sizes = []
    monkeypatch.setattr(
        progressive, "render", lambda v, t, c, **_: sizes.append(c.size) or ig.Image(np.ones((*c.size[::-1], 4), "f4"))
    )
    pictures = progressive.refinements(ball, SOLID, ig.Camera.looking("left", ball, (80, 80)))
    next(pictures)
    pictures.close()
    assert sizes == [(20, 20)]


@pytest.mark.parametrize("factors", [(), (0,), (2.0,), (65,)])
def test_factors_are_checked(ball, factors):
    with pytest.raises(ig.InputError, match="factors must be"):
        next(progressive.refinements(ball, SOLID, ig.Camera.looking("left", ball, 20), factors=factors))
