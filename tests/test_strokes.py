"""Strokes: sampling, cutting, lifting, tapering and turning of packed lines."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage

from intaglio.ink.strokes import (
    arc_length,
    lifted,
    line_of,
    pack,
    reversed_where,
    runs,
    sample,
    sideways,
    smoothed,
    taper,
    wander,
)

quick = settings(deadline=None, max_examples=80)
sizes = st.lists(st.integers(2, 30), max_size=8)


def packed(counts, seed=0, step=1.0):
    """Random lines of so many points, about a step apart."""
    rng = np.random.default_rng(seed)
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    heading = rng.uniform(0, 2 * np.pi, len(counts)).repeat(counts) + rng.normal(0, 0.3, offsets[-1])
    points = np.cumsum(step * np.stack([np.cos(heading), np.sin(heading)], axis=1), axis=0)
    return points.astype(np.float32).reshape(-1, 2), offsets


def straight(counts, step=1.0):
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    x = np.concatenate([np.arange(n) * step for n in counts])
    return np.stack([x, np.repeat(np.arange(len(counts)), counts) * 10.0], axis=1).astype(np.float32), offsets


def split(values, offsets):
    return np.split(values, offsets[1:-1]) if len(offsets) > 1 else []


@quick
@given(st.integers(1, 9), st.integers(1, 9), st.integers(0, 99))
def test_sample_is_bilinear_between_pixel_centres_and_constant_beyond(h, w, seed):
    rng = np.random.default_rng(seed)
    image = rng.uniform(0, 1, (h, w)).astype(np.float32)
    points = rng.uniform(-2, 12, (40, 2)).astype(np.float32)
    expected = ndimage.map_coordinates(image.astype(float), [points[:, 1] - 0.5, points[:, 0] - 0.5], order=1, mode="nearest")
    # float32 positions and values.
    np.testing.assert_allclose(sample(image, points), expected, atol=1e-5)


def test_sample_at_a_pixel_centre_is_the_pixel():
    image = np.arange(12, dtype=np.float32).reshape(3, 4)
    y, x = np.indices(image.shape)
    points = np.stack([x.ravel() + 0.5, y.ravel() + 0.5], axis=1).astype(np.float32)
    np.testing.assert_array_equal(sample(image, points), image.ravel())


@quick
@given(sizes, st.integers(0, 99))
def test_arc_length_begins_at_zero_and_adds_up_segments(counts, seed):
    points, offsets = packed(counts, seed)
    along = arc_length(points, offsets)
    assert len(along) == len(points) == len(line_of(offsets))
    for i, (line, s) in enumerate(zip(split(points, offsets), split(along, offsets), strict=True)):
        expected = np.concatenate([[0], np.cumsum(np.linalg.norm(np.diff(line.astype(float), axis=0), axis=1))])
        np.testing.assert_allclose(s, expected, atol=1e-4)
        assert (line_of(offsets)[offsets[i] : offsets[i + 1]] == i).all()


@quick
@given(sizes, st.floats(0, 1), st.integers(1, 5), st.integers(0, 99))
def test_runs_are_those_of_a_loop(counts, share, least, seed):
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    keep = np.random.default_rng(seed).random(offsets[-1]) < share
    expected, run = [], []
    for line in split(np.arange(offsets[-1]), offsets):
        for i in line:
            if keep[i]:
                run.append(i)
            if not keep[i] or i == line[-1]:
                if len(run) >= max(2, least):
                    expected.append(run)
                run = []
    index, new = runs(keep, offsets, least)
    assert [r.tolist() for r in split(index, new)] == expected
    assert new[0] == 0
    assert new[-1] == len(index)


@quick
@given(st.lists(st.integers(2, 60), min_size=1, max_size=8), st.floats(8, 50), st.integers(0, 99))
def test_lifted_pieces_follow_each_other_with_an_overlap_and_lose_nothing(counts, longest, seed):
    points, offsets = packed(counts, seed)
    along = arc_length(points, offsets)
    index, new = lifted(along, offsets, longest, np.random.default_rng(seed))
    line = line_of(offsets)
    pieces = split(index, new)
    assert new[-1] == len(index)
    assert (np.diff(new) >= 2).all()
    for piece in pieces:
        assert (np.diff(piece) == 1).all()
        assert line[piece[0]] == line[piece[-1]]
        # About as long as asked: half as much more for rounding the number of pieces, the rest for chance and overlap.
        assert along[piece[-1]] - along[piece[0]] < 1.5 * longest * 1.5 + 0.2 * longest + 1e-3
    np.testing.assert_array_equal(np.unique(index), np.arange(len(points)))
    for before, after in pairwise(pieces):
        if line[before[0]] == line[after[0]]:
            # A little, and never more than a piece.
            assert after[0] <= before[-1] + 1
            assert along[before[-1]] - along[after[0]] < 0.2 * longest


def test_lines_not_longer_than_a_piece_are_not_lifted():
    points, offsets = packed([5, 9, 14])
    index, new = lifted(arc_length(points, offsets), offsets, 100.0, np.random.default_rng(0))
    np.testing.assert_array_equal(index, np.arange(28))
    np.testing.assert_array_equal(new, offsets)


@quick
@given(sizes, st.integers(0, 99))
def test_reversed_where_turns_the_marked_lines_only(counts, seed):
    offsets = np.concatenate([[0], np.cumsum(counts)]).astype(np.int64)
    flip = np.random.default_rng(seed).random(len(counts)) < 0.5
    index = reversed_where(flip, offsets)
    for turned, line, f in zip(split(index, offsets), split(np.arange(offsets[-1]), offsets), flip, strict=True):
        np.testing.assert_array_equal(turned, line[::-1] if f else line)


@quick
@given(sizes, st.floats(0, 20), st.floats(0, 20), st.integers(0, 99))
def test_taper_rises_from_nothing_stays_and_falls(counts, begin, end, seed):
    points, offsets = packed(counts, seed)
    factor = taper(points, offsets, begin, end)
    along = arc_length(points, offsets)
    assert ((factor >= 0) & (factor <= 1)).all()
    for f, s in zip(split(factor, offsets), split(along, offsets), strict=True):
        assert begin == 0 or f[0] == 0
        assert end == 0 or f[-1] == 0
        shrink = min(1.0, s[-1] / max(begin + end, 1e-6))
        top = (s > begin * shrink + 1e-3) & (s < s[-1] - end * shrink - 1e-3)
        np.testing.assert_allclose(f[top], 1.0, atol=1e-3)
        peak = int(np.argmax(f))
        assert (np.diff(f[: peak + 1]) >= -1e-4).all()
        assert (np.diff(f[peak:]) <= 1e-4).all()


def test_taper_of_zero_leaves_an_end_blunt_and_may_differ_from_line_to_line():
    points, offsets = straight([11, 11])
    first, second = split(taper(points, offsets, np.array([0.0, 3.0]), np.array([4.0, 0.0])), offsets)
    assert first[0] == 1.0
    assert first[-1] == 0.0
    assert second[0] == 0.0
    assert second[-1] == 1.0
    assert (first[:7] == 1.0).all()
    assert (second[3:] == 1.0).all()
    # A quarter of a circle: at half the length, sqrt(0.75).
    assert first[8] == pytest.approx(np.sqrt(0.75), abs=1e-6)


def test_taper_keeps_the_proportions_of_short_lines():
    points, offsets = straight([5])
    factor = taper(points, offsets, 30.0, 10.0)
    assert factor[3] == pytest.approx(1.0)
    np.testing.assert_allclose(factor[[0, 4]], 0.0)


def test_wander_is_small_slow_and_different_for_each_line():
    points, offsets = straight([400, 400], step=0.1)
    along = arc_length(points, offsets)
    first, second = split(wander(offsets, along, 0.2, 9.0, np.random.default_rng(1)), offsets)
    # Three waves of 1, 1/2 and 1/3, times 0.6.
    assert 0.05 < np.abs(first).max() < 0.2 * 0.6 * 11 / 6 + 1e-6
    assert np.abs(first - second).max() > 0.02
    # No faster than the shortest of them, of 9 / 1.6 / 1.5 mm.
    assert np.abs(np.diff(first)).max() / 0.1 < 0.2 * 0.6 * 2 * np.pi * 1.6 / 9 * (0.5 + 0.5 + 0.5) + 1e-4
    again = wander(offsets, along, 0.2, 9.0, np.random.default_rng(1))
    np.testing.assert_array_equal(again[:400], first)
    assert (wander(offsets, along, 0.0, 9.0, np.random.default_rng(1)) == 0).all()


@quick
@given(sizes, st.integers(0, 99))
def test_sideways_is_unit_and_square_to_the_line(counts, seed):
    points, offsets = packed(counts, seed)
    side = sideways(points, offsets)
    assert side.shape == points.shape
    np.testing.assert_allclose(np.linalg.norm(side, axis=1), 1.0, atol=1e-5)
    for line, s in zip(split(points, offsets), split(side, offsets), strict=True):
        ends = np.stack([line[1] - line[0], line[-1] - line[-2]])
        np.testing.assert_allclose((ends * s[[0, -1]]).sum(axis=1), 0.0, atol=1e-4)


def test_sideways_is_to_the_same_side_all_along():
    points, offsets = straight([6, 3])
    np.testing.assert_allclose(sideways(points, offsets), np.tile([0.0, 1.0], (9, 1)))


@quick
@given(sizes, st.integers(0, 20), st.integers(0, 99))
def test_smoothed_keeps_ends_constants_bounds_and_even_steps(counts, passes, seed):
    points, offsets = packed(counts, seed)
    out = smoothed(points, offsets, passes)
    assert out.shape == points.shape
    for a, b in zip(split(points, offsets), split(out, offsets), strict=True):
        np.testing.assert_array_equal(a[[0, -1]], b[[0, -1]])
        assert (b.min(axis=0) >= a.min(axis=0) - 1e-4).all()
        assert (b.max(axis=0) <= a.max(axis=0) + 1e-4).all()
    even, offsets = straight([7, 12, 2])
    np.testing.assert_allclose(smoothed(even, offsets, passes), even, atol=1e-5)
    x = even[:, 0].copy()
    np.testing.assert_allclose(smoothed(x, offsets, passes), x, atol=1e-5)


def test_smoothed_weighs_one_two_one():
    values = np.array([0, 0, 4, 0, 0], dtype=np.float32)
    np.testing.assert_allclose(smoothed(values, np.array([0, 5]), 1), [0, 1, 2, 1, 0])


def test_nothing_stays_nothing():
    none, offsets = np.zeros((0, 2), dtype=np.float32), np.zeros(1, dtype=np.int64)
    assert len(arc_length(none, offsets)) == 0
    assert len(taper(none, offsets, 1.0, 1.0)) == 0
    assert sideways(none, offsets).shape == (0, 2)
    assert len(smoothed(none, offsets, 3)) == 0
    assert len(reversed_where(np.zeros(0, dtype=bool), offsets)) == 0
    assert len(pack(none, none[:, 0], none[:, 0], offsets)) == 0


def test_pack_takes_any_precision():
    points, offsets = straight([3, 4])
    strokes = pack(points.astype(float)[::1], np.ones(7), np.ones(7, dtype=np.float16), offsets.astype(np.int32))
    assert len(strokes) == 2
    assert {strokes.points.dtype, strokes.width.dtype, strokes.opacity.dtype} == {np.dtype(np.float32)}
    assert strokes.offsets.dtype == np.int64
