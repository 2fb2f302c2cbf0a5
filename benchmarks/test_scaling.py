"""How a frame and a change of the transfer function grow with the volume: one body, sampled ever finer."""

from __future__ import annotations

from functools import cache

import numpy as np
import pytest

import intaglio as ig
from intaglio.rendering.culling import tile_depths
from intaglio.rendering.skipping import min_max_blocks

SIZES = [64, 128, 256, 512]


@cache
def body(n: int) -> ig.Volume:
    """A rippled ball of 512 mm in n cubed int16 voxels."""
    axis = np.linspace(-1, 1, n, dtype=np.float32)
    plane = axis[:, None] ** 2 + axis[None] ** 2
    array = np.empty((n, n, n), dtype=np.int16)
    for k, z in enumerate(axis):
        array[k] = 1000 - 1400 * np.sqrt(plane + z * z) + 60 * np.sin(20 * plane)
    return ig.Volume.from_array(array, 512 / n)


def bone(start: float) -> ig.TransferFunction:
    return ig.TransferFunction.from_points([(start, "#c08060", 0.0), (start + 80, "#ffffff", 0.8), (3000, "#ffffff", 0.9)])


@pytest.mark.parametrize("n", SIZES)
def test_frame(benchmark, n):
    volume = body(n)
    camera = ig.Camera.looking("anterior-left", at=volume, size=(512, 512))
    benchmark(ig.render, volume, bone(300), camera)


@pytest.mark.parametrize("n", SIZES)
def test_another_transfer_function(benchmark, n):
    """Everything that has to be done again before the first ray."""
    volume = body(n)
    camera = ig.Camera.looking("anterior-left", at=volume, size=(512, 512))
    blocks = min_max_blocks(volume)

    def change():
        function = bone(310)
        function.table(*volume.range, 4096, step=0.5)
        tile_depths(volume, function.visible(*blocks), camera)

    benchmark(change)


@pytest.mark.parametrize("n", SIZES)
def test_min_max_blocks(benchmark, n):
    """Once a volume."""
    array = body(n).array
    benchmark.pedantic(min_max_blocks, setup=lambda: ((ig.Volume.from_array(array),), {}), rounds=3)
