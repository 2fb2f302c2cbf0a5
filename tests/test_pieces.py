"""Islands of pictures: small or faint pieces are left out, by what they show."""

from __future__ import annotations

from typing import Any

import numpy as np
import pytest

import intaglio as ig
from intaglio.rendering.pieces import shown_pieces

RED = (1.0, 0.0, 0.0)


def two_balls(faint: float = 1.0) -> ig.Volume:
    """One of radius 12 at the left, one of radius 5 at the right, apart by more than blocks of 8."""
    z, y, x = np.mgrid[:32, :32, :64].astype(float)
    large = 12 - np.sqrt((x - 14) ** 2 + (y - 15.5) ** 2 + (z - 15.5) ** 2)
    small = 5 - np.sqrt((x - 52) ** 2 + (y - 15.5) ** 2 + (z - 15.5) ** 2)
    return ig.Volume.from_array((100 / (1 + np.exp(-4 * large)) + faint * 100 / (1 + np.exp(-4 * small))).astype(np.float32))


def halves(image: Any) -> tuple[bool, bool]:
    """Whether anything is seen in the left and in the right part of the volume."""
    seen = (image.array[..., :3] != 1).any(axis=2)
    middle = int(seen.shape[1] * 0.6)
    return bool(seen[:, :middle].any()), bool(seen[:, middle:].any())


@pytest.mark.parametrize("mode", ["emission-absorption", "isosurface"])
@pytest.mark.parametrize(("islands", "right"), [(0.0, True), (0.02, True), (0.2, False)])
def test_small_pieces_are_left_out(mode: Any, islands: float, right: bool):
    volume = two_balls()
    camera = ig.Camera.looking("posterior", volume, (64, 32))
    function = ig.TransferFunction.from_points([(20, RED, 0.0), (100, RED, 0.5)])
    image = ig.render(volume, function, camera, mode=mode, surfaces=[(50.0, RED, 1.0)], islands=islands)
    assert halves(image) == (True, right)


def test_what_counts_is_what_a_piece_shows():
    """The small ball holds a fourteenth of the large one's matter; faint as a veil, a hundredth of its opacity."""
    function = ig.TransferFunction.from_points([(20, RED, 0.0), (30, RED, 0.02), (60, RED, 0.02), (100, RED, 0.9)])
    for faint, kept in ((1.0, True), (0.45, False)):
        volume = two_balls(faint)
        low, high = ig.rendering.skipping.min_max_blocks(volume)
        visible = function.visible(low, high)
        left = shown_pieces(volume, function, visible, 0.02)
        assert left[..., :4].any()
        assert left[..., 5:].any() == kept
        assert (shown_pieces(volume, function, visible, 0.0) == visible).all()
        assert not (left & ~visible).any()


def test_two_dimensional_functions_count_their_most_opaque_slope():
    volume = two_balls()
    function = ig.TransferFunction.from_points([(20, RED, 0.0), (100, RED, 0.5)])
    steep = ig.TransferFunction2D.emphasized(function, volume.range, ((0.0, 0.0), (5.0, 1.0)))
    camera = ig.Camera.looking("posterior", volume, (64, 32))
    assert halves(ig.render(volume, steep, camera, islands=0.2)) == (True, False)
    assert halves(ig.render(volume, steep, camera)) == (True, True)


def test_what_cannot_be_left_out():
    volume = two_balls()
    camera = ig.Camera.looking("anterior", volume, 16)
    with pytest.raises(ig.InputError, match="not in mode 'mip'"):
        ig.render(volume, None, camera, mode="mip", islands=0.1)
    with pytest.raises(ig.InputError, match="islands must be a part of the largest piece, 0 up to 1, not 1"):
        ig.render(volume, None, camera, mode="isosurface", surfaces=[(50.0, RED, 1.0)], islands=1)
