"""What a ray reads in one go: rows of neighbours, and gradients of many samples."""

from __future__ import annotations

import numpy as np
import pytest

from intaglio.compute import frozen, kernel, lanes, pair, quad
from intaglio.rendering.packets import LANES, central_differences, smooth_slopes

TYPES = [np.uint8, np.int8, np.uint16, np.int16, np.uint32, np.int32, np.int64, np.float32, np.float64]


@kernel
def read_rows(voxels, twos, fours):
    for i in range(len(voxels) - 1):
        twos[i, 0], twos[i, 1] = pair(voxels, np.uint64(i))
    for i in range(len(voxels) - 3):
        four = quad(voxels, np.uint64(i))
        for n in range(4):
            fours[i, n] = four[n]


@kernel
def gradients(voxels, grid, ray, count, smooth, out):
    gx, gy, gz, other = lanes(), lanes(), lanes(), lanes()
    if smooth:
        smooth_slopes(voxels, grid, ray, 0.0, 0.5, count, gx, gy, gz)
    else:
        central_differences(voxels, grid, ray, 0.0, 0.5, count, 1.0, np.zeros(3), other, gx, gy, gz)
    for lane in range(count):
        out[lane, 0], out[lane, 1], out[lane, 2] = gx[lane], gy[lane], gz[lane]


@pytest.mark.parametrize("kind", TYPES)
def test_rows_are_the_voxels_themselves(kind):
    rng = np.random.default_rng(3)
    if np.issubdtype(kind, np.integer):
        # float32 holds integers of 24 bits.
        info = np.iinfo(kind)
        voxels = rng.integers(max(info.min, -(2**24)), min(info.max, 2**24), 40, endpoint=True, dtype=kind)
    else:
        voxels = rng.normal(size=40).astype(kind)
    twos, fours = np.zeros((39, 2), np.float32), np.zeros((37, 4), np.float32)
    read_rows(frozen(voxels), twos, fours)
    np.testing.assert_array_equal(twos, np.lib.stride_tricks.sliding_window_view(voxels, 2).astype(np.float32))
    np.testing.assert_array_equal(fours, np.lib.stride_tricks.sliding_window_view(voxels, 4).astype(np.float32))


@pytest.mark.parametrize("kind", [np.uint8, np.int16, np.float32])
def test_smooth_slopes_are_central_differences(kind):
    rng = np.random.default_rng(4)
    shape = (9, 11, 13)
    voxels = (rng.uniform(0, 100, shape)).astype(kind)
    z, y, x = shape
    grid = np.array([x, x * y, x - 1, y - 1, z - 1], dtype=np.float64)
    got, expected = np.zeros((LANES, 3), np.float32), np.zeros((LANES, 3), np.float32)
    for _ in range(50):
        a, b = rng.uniform(1, [x - 2, y - 2, z - 2], (2, 3))
        count = int(rng.integers(1, LANES + 1))
        ray = np.concatenate([a, (b - a) / (0.5 * LANES)])
        gradients(frozen(voxels).reshape(-1), grid, ray, count, True, got)
        gradients(frozen(voxels).reshape(-1), grid, ray, count, False, expected)
        np.testing.assert_allclose(got[:count], expected[:count], atol=2e-3)


def test_smooth_slopes_of_a_ramp_hold_up_to_the_border():
    z, y, x = shape = (6, 5, 4)
    k, j, i = np.indices(shape)
    voxels = (2.0 * i - 3.0 * j + 0.5 * k).astype(np.float32)
    grid = np.array([x, x * y, x - 1, y - 1, z - 1], dtype=np.float64)
    out = np.zeros((LANES, 3), np.float32)
    ray = np.array([-0.5, -0.5, -0.5, 4.0 / 16, 5.0 / 16, 6.0 / 16])
    gradients(frozen(voxels).reshape(-1), grid, ray, LANES, True, out)
    np.testing.assert_allclose(out, np.broadcast_to([2.0, -3.0, 0.5], out.shape), atol=1e-5)
