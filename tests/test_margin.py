"""How far a place is from where its surface ends."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import GBuffer
from intaglio.ink.margin import margin


@settings(deadline=None, max_examples=30)
@given(st.integers(1, 12), st.integers(1, 90), st.floats(0.5, 9.0), st.integers(0, 2**32 - 1))
def test_margin_is_the_distance_to_the_nearest_crossing(width, height, reach, seed):
    rng = np.random.default_rng(seed)
    gb = oracle.sheet((height, width))
    gb.edge[:] = np.where(rng.random(gb.edge.shape) < 0.02, rng.random(gb.edge.shape), np.nan)
    np.testing.assert_allclose(margin(gb.edge, reach), oracle.margin(gb.edge, reach), atol=1e-5)


def test_without_contours_there_is_room_everywhere():
    empty = GBuffer.empty(oracle.sheet((4, 7)).camera)
    assert (margin(empty.edge, 3.0) == 3.0).all()


@pytest.mark.parametrize("reach", [2.0, 70.0])
def test_strips_agree_where_they_meet(reach, monkeypatch):
    gb = oracle.sheet((200, 30))
    gb.edge[[63, 64, 127], [3, 20, 11], [0, 1, 0]] = 0.25
    found = []
    for threads in "13":
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        found.append(margin(gb.edge, reach))
    assert np.array_equal(*found)
    np.testing.assert_allclose(found[0], oracle.margin(gb.edge, reach), atol=1e-5)
