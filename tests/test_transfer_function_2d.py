"""Colour by value and slope: what the constructors make, and that a picture follows it."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

import intaglio as ig
from intaglio.errors import InputError

CLEAR = (0.0, 0.0, 0.0, 0.0)
RAMP = ig.TransferFunction.from_points([(0.0, "#2040ff", 0.0), (1.0, "#ff8040", 0.5)])


def ramp(slope: float, n: int = 24) -> ig.Volume:
    """slope * x mm, 0 at the middle of the volume's left side."""
    axis = np.arange(n) * slope
    return ig.Volume.from_array(np.broadcast_to(axis, (n, n, n)).astype(np.float32))


def blob() -> ig.Volume:
    return oracle.sampled(lambda p: np.exp(-(p**2).sum(axis=-1) / 50.0), (24, 24, 24), oracle.centred((24, 24, 24)))


def alpha(volume: ig.Volume, function, **options) -> np.ndarray:
    camera = ig.Camera.looking("anterior", volume, (16, 16))
    return ig.render(volume, function, camera, background=CLEAR, lit=False, **options).array[..., 3]


def test_a_factor_of_one_changes_nothing():
    volume = blob()
    camera = ig.Camera.looking("anterior-left", volume, (20, 20))
    flat = ig.TransferFunction2D.emphasized(RAMP, volume.range, [(0.0, 1.0), (5.0, 1.0)])
    for lit in (False, True):
        one = ig.render(volume, RAMP, camera, lit=lit, gradient="central").array
        two = ig.render(volume, flat, camera, lit=lit).array
        # 512 rows instead of 4096 entries.
        np.testing.assert_allclose(two, one, atol=3e-3)


@pytest.mark.parametrize(("slope", "part"), [(0.01, 0.0), (0.02, 0.5), (0.04, 1.0)])
def test_opacity_follows_the_slope_in_values_per_mm(slope, part):
    volume = ramp(slope)
    level = ig.TransferFunction.from_points([(-1.0, "#ffffff", 0.1), (2.0, "#ffffff", 0.1)])
    emphasized = ig.TransferFunction2D.emphasized(level, (-1.0, 2.0), [(0.01, 0.0), (0.03, 1.0), (0.05, 1.0)])
    got = alpha(volume, emphasized).max()
    assert got == pytest.approx(1 - (1 - 0.1 * part) ** 23, abs=0.02)


@pytest.mark.parametrize("slope", [0.02, 0.05, 0.1])
def test_shells_are_equally_thick_whatever_the_slope(slope):
    volume = ramp(slope, 40)
    iso = 20 * slope
    shell = ig.TransferFunction2D.shells([(iso, (1, 1, 1), 0.3)], volume.range, thickness=3.0, steepest=0.12)
    camera = ig.Camera.looking("left", volume, (8, 8))
    got = ig.render(volume, shell, camera, background=CLEAR, lit=False, step=0.1).array[4, 4, 3]
    # The integral of log(1 - 0.3 (1 - |x| / 3)) over 6 mm.
    x = np.linspace(-3, 3, 20001)
    want = 1 - np.exp(np.trapezoid(np.log(1 - 0.3 * (1 - np.abs(x) / 3)), x))
    assert got == pytest.approx(want, abs=0.03)


@settings(max_examples=60, deadline=None)
@given(st.integers(0, 2**32 - 1))
def test_visible_blocks_hold_every_opaque_value(seed):
    rng = np.random.default_rng(seed)
    array = np.zeros((17, 5, 4), dtype=np.float32)
    array[rng.integers(0, 17, 2), rng.integers(0, 5, 2), 3] = 0.5
    function = ig.TransferFunction2D(array, -1.0, 3.0, 2.0)
    low, high = np.sort(rng.uniform(-2, 4, (2, 50)), axis=0)
    shown = function.visible(low, high)
    rows = np.clip((np.linspace(low, high, 300) + 1.0) * 4.0 + 0.5, 0, 16).astype(int)
    assert (shown >= (array[rows].max(axis=-2)[..., 3] > 0).any(axis=0)).all()
    assert function.visible(np.nan, np.nan)


def test_the_default_hides_nothing_of_the_selection():
    volume = blob()
    half = ig.Selection.plane((0, 0, 0), (0, 1, 0))
    function = ig.TransferFunction2D.emphasized(RAMP, volume.range, [(0.0, 0.0), (0.1, 1.0)])
    assert alpha(volume, function, selections=[half]).sum() < 0.8 * alpha(volume, function).sum()


@pytest.mark.parametrize(
    ("change", "words"),
    [
        (lambda: ig.TransferFunction2D(np.zeros((2, 4), np.float32), 0, 1, 1), "array must be"),
        (lambda: ig.TransferFunction2D(np.full((2, 2, 4), np.nan, np.float32), 0, 1, 1), "between 0 and 1"),
        (lambda: ig.TransferFunction2D(np.zeros((2, 2, 4), np.float32), 1, 1, 1), "low must be below high"),
        (lambda: ig.TransferFunction2D(np.zeros((2, 2, 4), np.float32), 0, 1, 0), "steepest"),
        (lambda: ig.TransferFunction2D(np.zeros((2, 2, 4), np.float32), 0, 1, 1, 0), "reference_length"),
        (lambda: ig.TransferFunction2D.emphasized(RAMP, (0, 1), [(2, 1), (1, 1)]), "ascend"),
        (lambda: ig.TransferFunction2D.emphasized(RAMP, (0, 1), [(0, 2)]), "factors between"),
        (lambda: ig.TransferFunction2D.emphasized(RAMP, (0, 1), []), "slopes must be"),
        (lambda: ig.TransferFunction2D.shells([(0.5, (1, 1, 1), 0.5)], (0, 1), thickness=0, steepest=1), "thickness"),
    ],
)
def test_what_cannot_be_is_refused(change, words):
    with pytest.raises(InputError, match=words):
        change()


@pytest.mark.parametrize("options", [{"mode": "mip"}, {"classify": "pre"}, {"classify": "preintegrated"}])
def test_it_needs_post_classification(options):
    function = ig.TransferFunction2D.emphasized(RAMP, (0, 1), [(0.0, 1.0)])
    with pytest.raises(InputError, match="2-D transfer function"):
        alpha(blob(), function, **options)
