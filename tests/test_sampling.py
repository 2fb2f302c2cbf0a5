"""Interpolation against its float64 twin, and what it must reproduce exactly."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import sampling
from intaglio.compute import frozen

SHAPE = (5, 6, 7)
LAST = np.array(SHAPE[::-1]) - 1.0
DTYPES = ["uint8", "int16", "float32"]
# Corners, faces, voxels, between them, and beyond every side.
PLACES = np.concatenate(
    [
        np.array([(x, y, z) for x in (0, LAST[0]) for y in (0, LAST[1]) for z in (0, LAST[2])]),
        [(0, 2.5, 2.5), (LAST[0], 2.5, 2.5), (3, 2, 1), (2.5, 2.5, 2.5), (LAST[0] - 1e-9, 1e-9, 2)],
        np.random.default_rng(1).uniform(0, LAST, (60, 3)),
    ]
)
OUTSIDE = np.random.default_rng(2).uniform(-3, LAST + 3, (60, 3))

cells = st.floats(0, 1, exclude_max=True)
numbers = st.floats(-2, 2)
quick = settings(deadline=None, max_examples=60)


def noise(dtype: str) -> np.ndarray:
    return frozen(np.random.default_rng(0).uniform(0, 200, SHAPE).astype(dtype))


def tricubic(voxels, point):
    out = np.empty(10)
    sampling.tricubic(frozen(voxels), *(float(c) for c in point), np.empty((3, 3, 4)), out)
    f, gx, gy, gz, xx, yy, zz, xy, xz, yz = out
    return f, np.array([gx, gy, gz]), np.array([[xx, xy, xz], [xy, yy, yz], [xz, yz, zz]])


def values(field, shape=SHAPE):
    z, y, x = np.indices(shape, dtype=np.float64)
    return field(np.stack([x, y, z], axis=-1))


@pytest.mark.parametrize("dtype", DTYPES)
def test_trilinear_is_its_twin_inside_on_borders_and_outside(dtype):
    voxels = noise(dtype)
    points = np.concatenate([PLACES, OUTSIDE])
    got = [sampling.trilinear(voxels, *p) for p in points]
    # Both in float64; 200 times a few roundings.
    np.testing.assert_allclose(got, oracle.trilinear(voxels, points), atol=1e-11)


def test_trilinear_reproduces_voxels_and_what_is_linear_along_each_axis():
    voxels = noise("float32")
    assert all(sampling.trilinear(voxels, x, y, z) == voxels[z, y, x] for z, y, x in np.ndindex(SHAPE))

    def field(p):
        x, y, z = np.moveaxis(p, -1, 0)
        return 3 + 2 * x - y + z * x - 0.5 * x * y * z

    voxels = frozen(values(field))
    np.testing.assert_allclose([sampling.trilinear(voxels, *p) for p in PLACES], field(PLACES), atol=1e-11)


@pytest.mark.parametrize("dtype", DTYPES)
def test_tricubic_is_its_twin_inside_and_on_borders(dtype):
    voxels = noise(dtype)
    for point in PLACES:
        value, gradient, hessian = tricubic(voxels, point)
        expected = oracle.bspline(voxels, point)
        # 64 products of numbers up to 200, in float64.
        assert value == pytest.approx(expected[0], abs=1e-10)
        np.testing.assert_allclose(gradient, expected[1], atol=1e-10)
        np.testing.assert_allclose(hessian, expected[2], atol=1e-9)


@quick
@given(st.tuples(cells, cells, cells), st.lists(numbers, min_size=10, max_size=10))
def test_tricubic_reproduces_a_quadratics_gradient_and_hessian(part, c):
    """And its value plus a sixth of its Laplacian, by which the spline smooths."""
    slope, bent = np.array(c[1:4]), np.array([[c[4], c[7], c[8]], [c[7], c[5], c[9]], [c[8], c[9], c[6]]])
    voxels = values(lambda p: c[0] + p @ slope + np.einsum("...i,ij,...j->...", p, bent, p) / 2)
    p = np.add(part, (3, 2, 2))  # away from the borders, where the grid is continued by constants
    value, gradient, hessian = tricubic(voxels, p)
    field = c[0] + p @ slope + p @ bent @ p / 2
    assert value == pytest.approx(field + np.trace(bent) / 6, abs=1e-10)
    np.testing.assert_allclose(gradient, slope + bent @ p, atol=1e-10)
    np.testing.assert_allclose(hessian, bent, atol=1e-10)


@quick
@given(st.tuples(*[st.floats(1.1, 3.4)] * 3))
def test_tricubic_derivatives_are_those_of_its_value(point):
    voxels, h = noise("float32"), 1e-4
    _, gradient, hessian = tricubic(voxels, point)
    for axis in range(3):
        step = h * np.eye(3)[axis]
        after, before = tricubic(voxels, point + step), tricubic(voxels, point - step)
        # Central differences err by h² times a third derivative of up to some 1000, a jump of which may lie between.
        assert gradient[axis] == pytest.approx((after[0] - before[0]) / (2 * h), abs=1e-4)
        np.testing.assert_allclose(hessian[axis], (after[1] - before[1]) / (2 * h), atol=0.2)


def test_a_constant_has_no_gradient_anywhere():
    voxels = np.full(SHAPE, 7.0, dtype=np.float32)
    for point in PLACES:
        value, gradient, hessian = tricubic(voxels, point)
        assert value == pytest.approx(7.0, abs=1e-12)
        # Weights sum to 0 but for rounding.
        np.testing.assert_allclose(gradient, 0, atol=1e-13)
        np.testing.assert_allclose(hessian, 0, atol=1e-13)


def test_smallest_grid_has_two_voxels_along_each_axis():
    voxels = frozen(np.arange(8, dtype=np.float32).reshape(2, 2, 2))
    for point in np.random.default_rng(3).uniform(0, 1, (20, 3)):
        assert sampling.trilinear(voxels, *point) == pytest.approx(oracle.trilinear(voxels, [point])[0], abs=1e-12)
        value, gradient, _ = tricubic(voxels, point)
        expected = oracle.bspline(voxels, point)
        assert value == pytest.approx(expected[0], abs=1e-12)
        np.testing.assert_allclose(gradient, expected[1], atol=1e-12)
