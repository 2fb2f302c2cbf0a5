"""The isovalue for a scan whose isovalue nobody gave."""

from __future__ import annotations

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import InputError, Volume, body_surface, read_volume
from intaglio.datasets import head

BALL = np.linalg.norm(np.indices((24, 24, 24)) - 11.5, axis=0) < 8


def volume(outside, inside, noise=0.0, dtype="float32") -> Volume:
    rng = np.random.default_rng(0)
    array = np.where(BALL, inside, outside) + noise * rng.normal(size=BALL.shape)
    return Volume.from_array(array.astype(dtype), name="scan")


@pytest.mark.parametrize("dtype", ["int16", "float32", "int32"])
def test_hounsfield_units_give_the_skin(dtype):
    array = np.linspace(-1024, 1500, 24**3).reshape(BALL.shape).astype(dtype)
    iso, why = body_surface(Volume.from_array(array))
    assert iso == -300.0
    assert "skin" in why


@pytest.mark.parametrize(("low", "high"), [(0, 3000), (-1000, 100), (-5000, 3000), (-1, 1)])
def test_what_does_not_span_air_to_bone_is_not_taken_for_hounsfield_units(low, high):
    iso, why = body_surface(volume(low, high))
    assert iso == pytest.approx((low + high) / 2, rel=0.01)
    assert "histogram" in why


@pytest.mark.parametrize(
    ("outside", "inside", "noise"), [(20, 180, 8), (180, 20, 8), (0, 1, 0.05), (40, 90, 6), (1e-9, 3e-9, 1e-10)]
)
def test_two_classes_are_parted_between_them(outside, inside, noise):
    iso, _ = body_surface(volume(outside, inside, noise))
    low, high = sorted((outside, inside))
    # At least three deviations from either.
    assert low + 3 * noise <= iso <= high - 3 * noise


@settings(deadline=None, max_examples=60)
@given(st.floats(-1e6, 1e6), st.floats(1e-3, 1e6), st.sampled_from([0.0, 0.1]))
def test_the_value_is_within_the_volumes_and_short(low, span, noise):
    array = volume(0, 1, noise).array.astype(np.float64) * span + low
    scan = Volume.from_array(array)
    if scan.range[0] == scan.range[1]:
        return
    iso, _ = body_surface(scan)
    assert scan.range[0] < iso <= scan.range[1]
    # Of a thousandth of the range.
    step = 10.0 ** (np.floor(np.log10(scan.range[1] - scan.range[0])) - 3)
    assert abs(iso / step - round(iso / step)) < 1e-6 * max(1.0, abs(iso / step))


@pytest.mark.parametrize("dtype", ["bool", "uint8"])
def test_a_mask_is_parted_half_way(dtype):
    assert body_surface(volume(0, 1, dtype=dtype))[0] == pytest.approx(0.5)


@pytest.mark.parametrize("dtype", ["uint8", "int16", "float32"])
def test_a_constant_volume_has_no_surface(dtype):
    with pytest.raises(InputError, match="scan: every voxel is 7, so it has no surface"):
        body_surface(volume(7, 7, dtype=dtype))


@pytest.mark.parametrize("value", [np.nan, np.inf, -np.inf])
def test_nan_is_named(value):
    array = np.where(BALL, 1.0, 0.0)
    array[3, 4, 5] = value
    with pytest.raises(InputError, match="scan: voxels are NaN or infinite"):
        body_surface(Volume.from_array(array, name="scan"))


def test_large_volumes_are_sampled_with_the_same_result():
    small = volume(20, 180, 8)
    large = Volume.from_array(np.kron(small.array, np.ones((6, 6, 6), dtype=np.float32)))
    assert body_surface(large)[0] == pytest.approx(body_surface(small)[0], rel=0.1)


def test_the_embedded_head_parts_air_from_head():
    assert 15 <= body_surface(head())[0] <= 60


@pytest.mark.parametrize(
    ("name", "low", "high"),
    [
        ("ct_head.nii.gz", 0.1, 0.35),
        ("engine.nii.gz", 40, 100),
        ("tooth.nhdr", 480, 750),
        ("bonsai.nii.gz", 20, 120),
        ("ct_abdomen.nii.gz", -400, -200),
        ("mr_head.nii.gz", 30, 200),
    ],
)
def test_real_scans_get_their_body(shared, name, low, high):
    assert low <= body_surface(read_volume(shared(f"volumes/{name}")))[0] <= high
