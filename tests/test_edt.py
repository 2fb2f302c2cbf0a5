"""Distances of masks and labels: exact, signed, of any spacing."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp

import intaglio as ig

SPACINGS = [(1.0, 1.0, 1.0), (0.7, 1.3, 2.0), (3.0, 0.5, 1.0)]

masks = hnp.arrays(np.bool_, st.tuples(*[st.integers(2, 7)] * 3)).filter(lambda m: m.any() and not m.all())


@settings(deadline=None, max_examples=60)
@given(masks, st.sampled_from(SPACINGS))
def test_equals_the_search_of_all_voxels(mask, spacing):
    distance = ig.signed_distance(ig.Volume.from_array(mask, spacing))
    assert distance.array.dtype == np.float32
    assert np.allclose(distance.array, oracle.signed_distance(mask, spacing), rtol=1e-6, atol=1e-6)


@pytest.mark.parametrize("spacing", SPACINGS)
def test_one_voxel_in_a_corner(spacing):
    mask = np.zeros((70, 40, 300), dtype=bool)
    mask[0, 0, 0] = True
    k, j, i = (np.maximum(np.indices(mask.shape)[a] - 0.5, 0) * s for a, s in enumerate(spacing[::-1]))
    expected = np.sqrt(k**2 + j**2 + i**2)
    expected[0, 0, 0] = -min(spacing) / 2
    assert np.allclose(ig.signed_distance(ig.Volume.from_array(mask, spacing)).array, expected, rtol=2e-6)


def test_a_slab_has_its_border_between_voxels():
    mask = np.zeros((5, 6, 40), dtype=bool)
    mask[:, :, 10:30] = True
    distance = ig.signed_distance(ig.Volume.from_array(mask, 0.5)).array
    x = np.arange(40)
    assert np.array_equal(distance[2, 3], 0.5 * np.maximum(9.5 - x, x - 29.5))


def test_a_ball_is_within_a_voxel_of_its_closed_form():
    volume = ig.Volume.from_array(np.zeros((90, 90, 90), np.float32), 0.8, (-35.0, -36.0, -34.0))
    true = oracle.ball(oracle.positions(volume), (0.0, 0.0, 0.0), 25.0)
    found = ig.signed_distance(ig.Volume(true < 0, volume.world_from_index)).array
    assert np.abs(found - true).max() < 0.8 * np.sqrt(3) / 2 + 1e-3
    assert abs((found - true)[np.abs(true) < 3].mean()) < 0.1


def test_labels_are_bodies_of_their_own():
    labels = np.zeros((8, 9, 10), dtype=np.uint8)
    labels[2:5, 2:5, 2:5] = 3
    labels[5:7, 2:5, 2:8] = 7
    volume = ig.Volume.from_array(labels)
    for label, mask in ((3, labels == 3), (7, labels == 7), (None, labels > 0)):
        expected = oracle.signed_distance(mask, (1, 1, 1))
        assert np.allclose(ig.signed_distance(volume, label).array, expected, atol=1e-6)


def test_any_thread_count_gives_the_same_bytes(monkeypatch):
    mask = ig.Volume.from_array(np.random.default_rng(0).random((40, 41, 42)) < 0.1)
    many = ig.signed_distance(mask).array
    monkeypatch.setenv("INTAGLIO_THREADS", "1")
    assert np.array_equal(ig.signed_distance(mask).array, many)


def test_progress_counts_up_and_cancels():
    mask = ig.Volume.from_array(np.random.default_rng(0).random((40, 41, 42)) < 0.1)
    seen: list[tuple[int, int]] = []
    ig.signed_distance(mask, progress=lambda done, total: seen.append((done, total)))
    assert seen == sorted(seen)
    assert seen[-1][0] == seen[-1][1]

    def stop(done: int, total: int) -> None:
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        ig.signed_distance(mask, progress=stop)


def test_what_has_no_border_is_refused():
    zeros = np.zeros((4, 4, 4), dtype=np.uint8)
    with pytest.raises(ig.InputError, match="no voxel is set"):
        ig.signed_distance(ig.Volume.from_array(zeros))
    with pytest.raises(ig.InputError, match="no voxel has label 5"):
        ig.signed_distance(ig.Volume.from_array(zeros), 5)
    with pytest.raises(ig.InputError, match="all voxels are of the body"):
        ig.signed_distance(ig.Volume.from_array(zeros + 1))
    with pytest.raises(ig.InputError, match="must be a mask or labels, not float32"):
        ig.signed_distance(ig.Volume.from_array(zeros.astype(np.float32)))
    skew = np.eye(4)
    skew[0, 2] = 0.3
    with pytest.raises(ig.InputError, match="perpendicular"):
        ig.signed_distance(ig.Volume(np.indices((4, 4, 4))[0] > 1, skew))


def test_a_label_of_a_real_scan(shared):
    labels = ig.read_volume(shared("volumes/ct_abdomen_labels.nii.gz"))
    liver = ig.signed_distance(labels, 5)
    assert np.array_equal(liver.array < 0, labels.array == 5)
    assert np.allclose(liver.world_from_index, labels.world_from_index)
    pick = np.random.default_rng(0).integers(0, labels.shape, (40, 3))
    places = np.argwhere(labels.array == 5)
    other = np.argwhere(labels.array != 5)
    for p in pick:
        gap = np.maximum(np.abs((other if liver.array[tuple(p)] < 0 else places) - p) - 0.5, 0) * labels.spacing[::-1]
        assert abs(liver.array[tuple(p)]) == pytest.approx(np.sqrt((gap**2).sum(axis=1).min()), rel=1e-5)
