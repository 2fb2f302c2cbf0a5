"""Blocks: what they hold, which islands stay, on either side of an isovalue."""

from __future__ import annotations

import numpy as np
import pytest

import intaglio as ig


def picture(array, iso, **options):
    volume = ig.Volume.from_array(array)
    camera = ig.Camera.looking("superior", volume, array.shape[2], margin=0.0)
    return ig.isosurface(volume, iso, camera, **options)


def test_islands_go_where_the_scans_face_cuts_them_too():
    array = np.zeros((48, 48, 48), dtype=np.float32)
    array[10:34, 18:34, 18:34] = 1.0
    array[44:, 2:6, 2:6] = 1.0
    everything, main = picture(array, 0.5), picture(array, 0.5, islands=0.02)
    assert everything.mask[40:].any()
    assert not main.mask[40:].any()
    assert main.mask.sum() == everything.mask[:40].sum()


def test_islands_work_below_as_above():
    array = np.zeros((40, 40, 40), dtype=np.int16)
    array[8:30, 8:30, 8:30] = 100
    array[34:37, 34:37, 34:37] = 100
    above = picture(array, 50, islands=0.01)
    below = picture((100 - array).astype(np.int16), 50, islands=0.01, inside="below")
    assert np.array_equal(above.mask, below.mask)
    assert above.mask.any()


def test_a_plateau_exactly_at_the_isovalue_is_inside():
    array = np.full((40, 40, 40), 100, dtype=np.uint8)
    array[4:7, 4:7, 4:7] = 0
    array[20:36, 20:36, 20:36] = 10
    assert picture(array, 10, inside="below").mask.sum() > 200


@pytest.mark.parametrize("kind", [np.bool_, np.float16, np.longdouble, np.int64, np.uint32])
def test_every_type_of_voxel_has_a_surface(kind):
    array = np.zeros((20, 20, 20), dtype=kind)
    array[5:15, 5:15, 5:15] = 1
    assert 80 < picture(array, 0.5).mask.sum() < 130


def test_islands_must_be_a_part():
    with pytest.raises(ig.InputError, match="islands must be"):
        picture(np.arange(27, dtype=np.uint8).reshape(3, 3, 3), 5, islands=2.0)
