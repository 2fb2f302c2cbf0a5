"""Distances to isosurfaces, the medial axis and penetration, against closed forms."""

from __future__ import annotations

import itertools
import math

import numpy as np
import oracle
import pytest
from test_csg import grid, on

import intaglio as ig

CENTRE = np.array([30.3, 31.1, 29.6])


def ball(p):
    return oracle.ball(p, CENTRE, 19.0)


# The same ball as other fields: linear, quadratic, falling.
BALLS = {
    "distance": (ball, {}),
    "quadric": (lambda p: ((p - CENTRE) ** 2).sum(axis=-1) - 19.0**2, {}),
    "scan": (lambda p: 200 * np.exp(-ball(p) / 15), {"iso": 200.0}),
}


def slopes(field: ig.Volume) -> np.ndarray:
    return np.linalg.norm(np.gradient(field.array, *field.spacing[::-1]), axis=0)


@pytest.mark.parametrize("name", BALLS)
def test_balls(name):
    form, options = BALLS[name]
    volume = on(grid(62), form)
    true = ball(oracle.positions(volume))
    found = ig.redistance(volume, **options)
    assert found.array.dtype == np.float32
    error = np.abs(found.array - true)
    # Near the centre of a ball many points are equally close.
    inner = true > -12
    assert error[inner].max() < 1e-3
    assert error.max() < 0.1
    slope = slopes(found)[1:-1, 1:-1, 1:-1][inner[1:-1, 1:-1, 1:-1]]
    assert abs(np.median(slope) - 1) < 2e-3
    assert np.percentile(np.abs(slope - 1), 99) < 0.02


def test_anisotropic_grids_in_any_pose():
    pose = grid(60, 1.0, (4.0, -3.0, 2.0), 0.7).world_from_index @ np.diag([0.8, 1.0, 1.7, 1.0])
    volume = ig.Volume(np.zeros((36, 60, 70), dtype=np.float32), pose)
    centre = (pose @ (36.0, 29.0, 18.0, 1.0))[:3]
    volume = on(volume, lambda p: oracle.ball(p, centre, 17.0) ** 3)
    true = oracle.ball(oracle.positions(volume), centre, 17.0)
    cubed = ig.redistance(ig.Volume(np.cbrt(volume.array) * 5, volume.world_from_index))
    assert np.abs(cubed.array - true)[true > -11].max() < 0.02


def test_boxes_keep_their_faces():
    volume = on(grid(60), lambda p: oracle.box(p, CENTRE, (18.0, 15.0, 12.0)))
    squeezed = ig.Volume(np.sinh(volume.array / 12), volume.world_from_index)
    found = ig.redistance(squeezed)
    p = np.abs(oracle.positions(volume) - CENTRE)
    # Over the middle of a face no edge is near; a sampled field blunts edges by half a voxel.
    over = (p[..., 1] < 11) & (p[..., 2] < 8) & (p[..., 0] > 11)
    assert np.abs(found.array - volume.array)[over].max() < 0.01
    assert np.abs(found.array - volume.array).max() < 0.6
    assert np.abs(found.array - volume.array).mean() < 0.15


def test_csg_becomes_a_distance_field_again():
    a, b = (on(grid(60), lambda p, c=c, r=r: oracle.ball(p, c, r)) for c, r in (((24, 30, 30), 16.0), ((40, 30, 30), 12.0)))
    lens = ig.intersection(a, b)
    found = ig.redistance(lens)
    p = oracle.positions(lens)
    # Outside near the rim the closest point is on it: a circle about the axis.
    x = (16.0**2 - 12.0**2 + 40.0**2 - 24.0**2) / (2 * (40 - 24))
    rim = math.sqrt(16.0**2 - (x - 24) ** 2)
    to_rim = np.hypot(p[..., 0] - x, np.hypot(p[..., 1] - 30, p[..., 2] - 30) - rim)
    beyond = np.hypot(p[..., 1] - 30, p[..., 2] - 30) > rim + np.abs(p[..., 0] - x) * 2
    assert beyond.sum() > 1000
    assert np.abs(found.array - to_rim)[beyond].max() < 0.6
    assert np.abs(lens.array - to_rim)[beyond].max() > 1.5
    inside = lens.array < -1
    assert np.abs(found.array - lens.array)[inside].max() < 0.3
    slope = slopes(found)
    assert abs(np.median(slope) - 1) < 0.005
    assert np.percentile(slope, 95) < 1.02
    assert np.percentile(slope, 5) > 0.95


def test_redistancing_twice_changes_little():
    once = ig.redistance(on(grid(62), lambda p: ball(p) * (2 + np.sin(p[..., 0] / 5))))
    twice = ig.redistance(once)
    assert np.abs(once.array - twice.array)[once.array > -12].max() < 0.05


def test_signs_are_those_of_the_voxels():
    noise = ig.Volume.from_array(np.random.default_rng(0).normal(size=(20, 21, 22)).astype(np.float32))
    found = ig.redistance(noise)
    assert np.array_equal(found.array <= 0, noise.array <= 0)
    assert np.isfinite(found.array).all()
    assert np.abs(found.array).max() < 4


def test_any_thread_count_gives_the_same_bytes(monkeypatch):
    noise = ig.Volume.from_array(np.random.default_rng(0).normal(size=(20, 21, 22)).astype(np.float32))
    many = ig.redistance(noise).array
    monkeypatch.setenv("INTAGLIO_THREADS", "1")
    assert np.array_equal(ig.redistance(noise).array, many)


def test_a_real_scan(shared):
    volume = ig.read_volume(shared("volumes/tooth.nhdr"))
    found = ig.redistance(volume, 500.0)
    assert np.array_equal(found.array <= 0, volume.array >= 500)
    slope = slopes(found)
    assert abs(np.median(slope) - 1) < 0.01
    assert np.percentile(slope, 99) < 1.1


def test_what_has_no_surface_is_refused():
    flat = ig.Volume.from_array(np.ones((4, 4, 4), dtype=np.float32))
    with pytest.raises(ig.InputError, match="iso must be within"):
        ig.redistance(flat)
    with pytest.raises(ig.InputError, match="is a mask, which has no smooth surface; use signed_distance"):
        ig.redistance(ig.Volume.from_array(np.indices((4, 4, 4))[0] > 1))


def test_medial_axis_of_a_box_is_its_middle_sheet():
    # 50 x 30 x 16: between the two large faces lies a sheet of 34 x 14.
    field = on(grid(62), lambda p: oracle.box(p, (30.5, 30.5, 30.5), (25.0, 15.0, 8.0)))
    sheet = ig.medial_axis(field, 120).array
    k, j, i = np.nonzero(sheet)
    assert set(k) == {30} or set(k) == {31}
    assert abs(np.ptp(i) - 34) <= 2
    assert abs(np.ptp(j) - 14) <= 2
    assert sheet.sum() == (np.ptp(i) + 1) * (np.ptp(j) + 1)
    roof = ig.medial_axis(field, 60).array
    assert (roof | ~sheet).all()
    k, j, i = np.nonzero(roof & ~sheet)
    # Below the edges the axis is as far from one face as from the other.
    faces = np.sort(np.stack([25 - abs(i - 30.5), 15 - abs(j - 30.5), 8 - abs(k - 30.5)]), axis=0)
    assert len(k) > 500
    assert (faces[1] - faces[0]).max() <= 1


def test_medial_axis_of_a_ball_is_its_centre():
    field = on(grid(62), ball)
    where = np.argwhere(ig.medial_axis(field).array)[:, ::-1]
    assert 0 < len(where) <= 12
    assert np.abs(where - CENTRE).max() < 2
    with pytest.raises(ig.InputError, match="angle must be"):
        ig.medial_axis(field, 180)


SLANTED = np.linalg.qr(np.array([[1.0, 0.3, 0.2], [-0.4, 1.0, 0.5], [0.1, 0.2, 1.0]]))[0]


def thin(mask: np.ndarray) -> bool:
    """In one piece, without a hollow or a hole, and nowhere two voxels thick."""
    from scipy import ndimage

    blocks = ndimage.minimum_filter(mask.astype(np.uint8), 2, mode="constant")
    # Without tunnels its points, lines, faces and cells sum up to 1.
    padded = np.pad(mask, 1)
    euler = 0
    for axes in itertools.product((0, 1), repeat=3):
        cells = np.zeros(np.array(padded.shape) - 1, dtype=bool)
        for shift in itertools.product(*[(0, 1) if a == 0 else (0,) for a in axes]):
            cells |= padded[tuple(slice(o, n - 1 + o) for o, n in zip(shift, padded.shape, strict=True))]
        euler += (-1) ** sum(axes) * int(cells.sum())
    return ndimage.label(mask, np.ones((3, 3, 3)))[1] == 1 and not blocks.any() and euler == 1


@pytest.mark.parametrize("centre", [30.0, 30.5, 30.27])
@pytest.mark.parametrize("turn", [np.eye(3), SLANTED], ids=["upright", "slanted"])
def test_medial_axes_are_one_voxel_thick(centre, turn):
    def turned(distance):
        return on(grid(62), lambda p: distance((p - centre) @ turn + centre))

    assert thin(ig.medial_axis(turned(lambda p: oracle.box(p, (centre,) * 3, (21.0, 16.0, 10.0)))).array)
    slab = ig.medial_axis(turned(lambda p: np.abs(p[..., 0] - centre) - 8.3)).array
    assert thin(slab)
    assert slab.sum() == 62**2


def test_medial_axis_of_an_ellipsoid_is_a_disc():
    """Up to where the radius of curvature at the rim is as small as the distance: (1 - c²/a²) a, and with b."""
    import trimesh

    sphere = trimesh.creation.icosphere(5)
    ball = ig.TriangleMesh(sphere.vertices * (25.0, 19.0, 11.0) + 30.27, sphere.faces.astype(np.int32))
    disc = ig.medial_axis(ig.distance_field(ball, like=grid(62), band="full"), 60).array
    assert thin(disc)
    k, j, i = np.nonzero(disc)
    assert set(k) == {30}
    assert np.abs(i - 30.27).max() < 25 - 11**2 / 25 + 0.5
    assert np.abs(j - 30.27).max() < 19 - 11**2 / 19 + 0.5


@pytest.mark.parametrize("gap", [-7.0, -2.0, 3.0])
def test_two_balls_penetrate_along_their_centres(gap):
    along = np.array([2.0, 1.0, -0.5]) / np.linalg.norm([2.0, 1.0, -0.5])
    other = CENTRE + along * (12 + 9 + gap)
    a = on(grid(62), lambda p: oracle.ball(p, CENTRE, 12.0))
    b = on(grid(90, 0.7, other - 31), lambda p: oracle.ball(p, other, 9.0))
    found = ig.penetration_depth(a, b)
    assert found.depth == pytest.approx(-gap, abs=0.03)
    assert np.degrees(np.arccos(found.direction @ along)) < 1
    assert np.linalg.norm(found.place - (CENTRE + along * (12 + gap / 2))) < 0.2
