"""The field of stroke directions: lines, not arrows; along the form; never mixed across a jump."""

from __future__ import annotations

import dataclasses

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import Camera, GBuffer, isosurface
from intaglio.ink import direction as module
from intaglio.ink.direction import direction_field
from intaglio.ink.smoothing import blurred, connections, smooth

CUBE = (48, 48, 48)


@pytest.fixture
def form_alone(monkeypatch):
    """Without the cuts that take over where nothing bends."""
    monkeypatch.setattr(module, "SLICING_WEIGHT", 0.0)


def linked(h, w):
    return np.ones((2, h, w), dtype=np.float32)


def angle_of(field):
    """Degrees, x right, y down, 0..180."""
    return np.degrees(np.arctan2(field[1], field[0])) / 2 % 180


def turn_between(a, b):
    """Degrees between lines, 0..90."""
    d = np.abs(a - b) % 180
    return np.minimum(d, 180 - d)


def bent(gb: GBuffer, degrees) -> GBuffer:
    """A sheet that bends in a direction of the image, degrees from x to y (down)."""
    a = np.radians(np.broadcast_to(degrees, gb.depth.shape))[..., None]
    gb.direction[:] = np.cos(a) * gb.camera.right - np.sin(a) * gb.camera.up
    gb.curvature[:] = 1.0, 0.0
    return gb


def picture(field, view, size=80, projection="orthographic"):
    volume = oracle.sampled(field, CUBE)
    return isosurface(volume, 0.0, Camera.looking(view, volume, size, projection=projection))


@pytest.mark.parametrize("sigma", [1.0, 4.0, 15.0])
def test_smooth_spreads_a_point_by_sigma_and_keeps_its_sum(sigma):
    n = int(12 * sigma) | 1
    field = np.zeros((1, n, n), dtype=np.float32)
    field[0, n // 2, n // 2] = 1.0
    smooth(field, linked(n, n), sigma)
    # Six sigma to the border, float32.
    assert field.sum() == pytest.approx(1.0, abs=1e-3)
    at = np.arange(n) - n // 2
    for axis in (0, 1):
        share = field[0].sum(axis=axis)
        assert (share * at).sum() == pytest.approx(0.0, abs=0.01 * sigma)
        # A recursion has the width of its continuous model but for some 0.15 pixel that sampling takes.
        assert np.sqrt((share * at**2).sum()) == pytest.approx(sigma, abs=0.2)
    np.testing.assert_allclose(field[0], field[0][::-1], atol=1e-3 * field.max())
    np.testing.assert_allclose(field[0], field[0].T, atol=1e-3 * field.max())


@settings(deadline=None, max_examples=30)
@given(st.integers(1, 30), st.integers(1, 30), st.floats(0, 50), st.integers(0, 5), st.integers(1, 5))
def test_smooth_keeps_constants_and_bounds(h, w, sigma, seed, passes):
    rng = np.random.default_rng(seed)
    links = rng.uniform(0, 1, (2, h, w)).astype(np.float32)
    field = np.stack([np.full((h, w), 0.7), rng.uniform(-1, 2, (h, w))]).astype(np.float32)
    low, high = field[1].min(), field[1].max()
    smooth(field, links, sigma, passes)
    # Every step is a mean of two values, rounded to float32.
    np.testing.assert_allclose(field[0], 0.7, atol=1e-5)
    assert low - 1e-5 <= field[1].min() <= field[1].max() <= high + 1e-5


@pytest.mark.parametrize("sigma", [2.0, 6.0])
def test_smooth_keeps_the_mean_of_a_closed_grid(sigma):
    field = np.random.default_rng(0).uniform(0, 1, (1, 120, 120)).astype(np.float32)
    before = field.mean()
    deviation = field.std()
    smooth(field, linked(120, 120), sigma)
    # Border pixels count a little more than others: sigma / 120 of noise that is 0.3 a pixel.
    assert field.mean() == pytest.approx(before, abs=2e-3)
    # Of white noise a Gaussian leaves 1 / (2 sigma sqrt(pi)); recursions are not quite Gaussian, and noise is noise.
    assert field[0, 25:-25, 25:-25].std() == pytest.approx(deviation / (2 * sigma * np.sqrt(np.pi)), rel=0.4)


def test_smooth_does_not_cross_broken_links():
    links = linked(40, 60)
    links[0, :, 24] = 0.0
    links[1, 9, :25] = 0.0
    field = np.zeros((1, 40, 60), dtype=np.float32)
    field[0, 10:, :25] = 1.0
    field[0, :10, :25] = -3.0
    field[0, :, 25:] = 5.0
    expected = field.copy()
    smooth(field, links, 20.0)
    np.testing.assert_allclose(field, expected, rtol=1e-5)


def test_connections_break_at_edges_and_borders_of_the_surface():
    gb = oracle.sheet((20, 30))
    label = np.zeros((20, 30), dtype=int)
    label[5:12, 7:20] = 1
    oracle.mark_edges(gb, label)
    gb.depth[:, 25:] = np.inf
    links = connections(gb)
    across = label[:, 1:] != label[:, :-1]
    down = label[1:] != label[:-1]
    assert (links[0, :, :-1][across] == 0).all()
    assert (links[1, :-1][down] == 0).all()
    assert (links[:, :, 25:] == 0).all()
    assert (links[0, :, 24] == 0).all()
    assert links[0, :, :24][~across[:, :24]].min() == 1.0
    assert links[1, :-1, :25][~down[:, :25]].min() == 1.0


def test_connections_fade_across_creases():
    shares = []
    for t in np.radians([0, 10, 40, 90]):
        gb = oracle.sheet((4, 10))
        gb.normal[:, 5:] = (np.sin(t), np.cos(t), 0)
        shares.append(connections(gb)[0, 2, 4])
    assert shares[0] == pytest.approx(1.0)
    assert (np.diff(shares) < 0).all()
    assert shares[-1] < 0.01


def test_blurred_leaves_paper_alone_and_each_surface_to_itself():
    gb = oracle.sheet((30, 40))
    label = np.zeros((30, 40), dtype=int)
    label[:, 20:] = 1
    oracle.mark_edges(gb, label)
    gb.depth[:10] = np.inf
    image = np.where(label == 1, 0.8, 0.2).astype(np.float32)
    np.testing.assert_allclose(blurred(gb, image, 6.0), image, atol=1e-6)


def test_directions_are_lines_not_arrows():
    gb = picture(oracle.Torus(11.0, 6.0).field, (1, 2, 3))
    rng = np.random.default_rng(0)
    turned = gb.direction * rng.choice([-1.0, 1.0], gb.depth.shape).astype(np.float32)[..., None]
    np.testing.assert_allclose(
        direction_field(dataclasses.replace(gb, direction=turned), 6.0), direction_field(gb, 6.0), atol=1e-6
    )


def test_opposite_arrows_do_not_cancel(form_alone):
    gb = bent(oracle.sheet((30, 30)), 30.0)
    gb.direction[:, ::2] *= -1
    assert turn_between(angle_of(direction_field(gb, 5.0)), 30.0).max() < 0.1


def test_mean_of_two_lines_is_between_them_and_weighs_the_stronger_more(form_alone):
    degrees = np.where(np.arange(40) % 2 == 0, 170.0, 20.0)
    gb = bent(oracle.sheet((40, 40)), degrees)
    middle = angle_of(direction_field(gb, 8.0))[10:-10, 10:-10]
    # A ripple is left of averaging every other column.
    assert turn_between(middle, 5.0).max() < 5.0
    gb.curvature[:, ::2] *= 0.02
    weighted = angle_of(direction_field(gb, 8.0))[10:-10, 10:-10]
    assert turn_between(weighted, 20.0).max() < 10.0


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("axis", [(0, 0, 1), (1, 0, 1), (2, 0, -1)])
@pytest.mark.parametrize("hollow", [False, True])
def test_strokes_run_round_a_cylinder(axis, projection, hollow, form_alone):
    """Seen from the side, across its axis; in a groove as on a rod, for |k1| or |k2| is the greater there."""
    body = oracle.Cylinder(9.0 if not hollow else 14.0, axis)

    def field(p):
        # A groove: the side towards the viewer of a body hollowed out.
        return body.field(p) if not hollow else np.minimum(-body.field(p), -1.0 - p[..., 1])

    gb = picture(field, "anterior", projection=projection)
    inner = gb.mask & (gb.facing > 0.3) & (np.abs(gb.curvature[..., 0] - gb.curvature[..., 1]) > 0.03)
    h, w = inner.shape
    y, x = np.indices(inner.shape)
    inner &= np.hypot(x + 0.5 - w / 2, y + 0.5 - h / 2) < 15  # away from the groove's rim and where the volume ends
    assert inner.sum() > 250
    got = angle_of(direction_field(gb, 3.0))[inner]
    y, x = np.nonzero(inner)
    if projection == "perspective":
        # What runs round bends in the picture, but crosses the picture of the axis squarely only half way.
        origin, ray = oracle.rays(gb.camera, x + 0.5, y + 0.5)
        at = origin + gb.depth[inner][:, None] * ray
        round_ = np.cross(np.asarray(axis) / np.linalg.norm(axis), gb.normal[inner])
        ahead = gb.camera.project(at + 1e-3 * round_) - gb.camera.project(at)
        expected = np.degrees(np.arctan2(ahead[:, 1], ahead[:, 0])) % 180
    else:
        expected = np.degrees(np.arctan2(-axis[2], -axis[0])) % 180 + 90
    # Averaged over three pixels, over which the direction turns in perspective.
    assert turn_between(got, expected % 180).max() < 3.0


def test_where_nothing_bends_cuts_with_planes_take_over():
    """On a sphere every direction is as good; the field is still smooth and runs like parallel cuts."""
    gb = picture(oracle.Sphere(18.0).field, "anterior")
    field = direction_field(gb, 4.0)
    inner = gb.facing > 0.3
    slicing = np.asarray(module.SLICING) @ gb.camera.view_from_world
    cut = np.cross(gb.normal[inner], slicing)
    expected = np.degrees(np.arctan2(-cut @ gb.camera.up, cut @ gb.camera.right)) % 180
    away = np.linalg.norm(cut, axis=1) > 0.4 * np.linalg.norm(slicing)  # from where the planes only touch
    assert np.quantile(turn_between(angle_of(field)[inner], expected)[away], 0.95) < 5.0


def test_no_mixing_across_a_jump_of_depth(form_alone):
    degrees = np.where(np.arange(60) < 30, 0.0, 70.0)
    apart, together = (bent(oracle.sheet((40, 60)), degrees) for _ in range(2))
    apart.depth[:, 30:] = 140.0
    oracle.mark_edges(apart, np.broadcast_to(degrees, (40, 60)))
    got = angle_of(direction_field(apart, 10.0))
    # The one has no part at all in the other.
    assert turn_between(got, degrees).max() < 0.01
    mixed = angle_of(direction_field(together, 10.0))
    assert turn_between(mixed, degrees)[:, 28:32].min() > 5.0


@pytest.mark.parametrize("view", ["anterior", (1, 2, 3)])
def test_field_is_unit_on_the_surface_and_zero_beside_it(view):
    gb = picture(oracle.Torus(11.0, 6.0).field, view)
    field = direction_field(gb, 5.0)
    assert field.dtype == np.float32
    assert field.shape == (2, *gb.depth.shape)
    np.testing.assert_allclose(np.hypot(*field)[gb.mask], 1.0, atol=1e-6)
    assert (field[:, ~gb.mask] == 0).all()


def test_empty_and_flat_pictures_have_a_field_too():
    empty = GBuffer.empty(oracle.sheet((8, 9)).camera)
    assert (direction_field(empty, 5.0) == 0).all()
    for size in ((1, 1), (1, 7), (7, 1), (12, 9)):
        np.testing.assert_allclose(np.hypot(*direction_field(oracle.sheet(size), 5.0)), 1.0, atol=1e-6)


def test_number_of_threads_changes_nothing(monkeypatch):
    gb = picture(oracle.Torus(11.0, 6.0).field, (1, 2, 3), 150)
    fields = []
    for threads in "12":
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        fields.append(direction_field(gb, 8.0))
    np.testing.assert_array_equal(*fields)
