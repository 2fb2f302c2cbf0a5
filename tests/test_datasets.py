from __future__ import annotations

from importlib.resources import files

import numpy as np
import pytest

from intaglio.datasets import head


def test_head() -> None:
    v = head()
    assert v.name == "head"
    assert v.shape == (84, 128, 128)
    assert v.array.dtype == np.uint8
    assert v.range == (0, 202)
    np.testing.assert_allclose(v.spacing, (2, 2, 1.5 * 109 / 84), rtol=1e-6)
    assert any("left and right are assumed" in note for note in v.notes)
    np.testing.assert_allclose(v.corners.mean(axis=0), 0, atol=1e-3)


def test_face_is_anterior_and_vertex_superior() -> None:
    v = head()
    z, y, x = np.nonzero(v.array > 30)
    world = np.stack([x, y, z, np.ones_like(x)], axis=1) @ v.world_from_index.T
    # Around the midline the foremost point is the tip of the nose, between brow and chin.
    middle = world[np.abs(world[:, 0]) < 15]
    nose = middle[np.argmax(middle[:, 1])]
    assert nose[2] == pytest.approx(-25, abs=25)
    # The top is the brain laid open, well behind the nose; the lowest slices show the neck, narrower than the head.
    top = middle[np.argmax(middle[:, 2])]
    assert top[1] < nose[1] - 50
    low, mid = world[world[:, 2] < -75], world[np.abs(world[:, 2]) < 10]
    assert np.ptp(low[:, 1]) < np.ptp(mid[:, 1])
    # Proportions of a head: breadth over length of the brain at its widest.
    brain = world[(world[:, 2] > 30) & (world[:, 2] < 60)]
    assert 0.7 < np.ptp(brain[:, 0]) / np.ptp(brain[:, 1]) < 1.0


def test_source_and_licence_come_along() -> None:
    folder = files("intaglio").joinpath("data")
    assert "Redistribution and use" in folder.joinpath("LICENSE-head.txt").read_text(encoding="utf-8")
    assert "libvolpack1-dev" in folder.joinpath("README.md").read_text(encoding="utf-8")
