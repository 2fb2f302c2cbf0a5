"""Camera: what is in the picture, how large it is, and what it refuses."""

from __future__ import annotations

import math

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import Camera, InputError, Volume
from intaglio.camera import VIEWS, view_direction

BOX = Volume.from_array(np.zeros((11, 21, 31)), spacing=(2.0, 1.0, 3.0), origin=(-10.0, 40.0, 7.0))

coordinate = st.floats(-1000, 1000)
positions = st.lists(st.tuples(coordinate, coordinate, coordinate), min_size=1, max_size=12)
directions = st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: math.hypot(*v) > 0.1)
projections = st.sampled_from(["orthographic", "perspective"])
anything = settings(deadline=None, max_examples=80)


@anything
@given(directions, positions, projections, st.floats(-360, 360), st.integers(1, 400), st.integers(1, 400), st.floats(0, 0.4))
def test_subject_fills_the_image_up_to_the_margin(view, points, projection, roll, width, height, margin):
    camera = Camera.looking(view, points, (width, height), projection=projection, roll=roll, margin=margin)
    x, y, depth = camera.project(points).T
    border = margin * min(width, height)
    slack = 1e-6 * max(width, height)
    assert (depth > 0).all()
    assert min(x.min(), width - x.max(), y.min(), height - y.max()) >= border - slack
    if np.ptp(points, axis=0).max() > 1 and projection == "orthographic":
        touching = min(x.min(), y.min())
        seen_edge_on = np.ptp(np.asarray(points) @ np.stack([camera.right, camera.up]).T, axis=0).max() < 1
        assert seen_edge_on or touching <= border + 1e-3 * max(width, height)


@anything
@given(directions, positions, projections, st.floats(-360, 360))
def test_projected_points_lie_on_their_rays(view, points, projection, roll):
    camera = Camera.looking(view, BOX, (320, 200), projection=projection, roll=roll)
    near = np.asarray(points) * 0.01 + BOX.corners.mean(axis=0)
    x, y, depth = camera.project(near).T
    r = camera.rays()
    origin = r[0] + x[:, None] * r[1] + y[:, None] * r[2]
    direction = r[3] + x[:, None] * r[4] + y[:, None] * r[5]
    np.testing.assert_allclose(origin + depth[:, None] * direction, near, atol=1e-9)


@anything
@given(directions, st.floats(-360, 360))
def test_frame_is_a_rotation(view, roll):
    rotation = Camera.looking(view, BOX, 64, roll=roll).view_from_world
    np.testing.assert_allclose(rotation @ rotation.T, np.eye(3), atol=1e-12)
    assert np.linalg.det(rotation) == pytest.approx(1.0)


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("view", VIEWS)
def test_one_number_is_the_longer_side_and_the_other_fits(view, projection):
    camera = Camera.looking(view, BOX, 600, projection=projection, margin=0.05)
    width, height = camera.size
    assert max(width, height) == 600
    x, y, _ = camera.project(BOX.corners).T
    border = 0.05 * min(width, height)
    # Half a pixel for rounding the shorter side, on either border.
    np.testing.assert_allclose([x.min(), width - x.max(), y.min(), height - y.max()], border, atol=1.0)


def test_one_number_never_makes_a_sliver():
    needle = [(0, 0, 0), (0, 0, 100)]
    assert Camera.looking("anterior", needle, 500).size == (100, 500)


def test_zoom_and_perspective_scale():
    camera, near = (Camera.looking("left", BOX, (64, 64), zoom=zoom) for zoom in (1.0, 2.5))
    assert camera.pixel == pytest.approx(2.5 * near.pixel)
    far = Camera.looking("left", BOX, (64, 64), projection="perspective", distance=1e6)
    np.testing.assert_allclose(far.project(BOX.corners)[:, :2], camera.project(BOX.corners)[:, :2], atol=0.01)


def test_field_of_view_is_what_the_front_of_the_box_takes_up():
    camera = Camera.looking("anterior", BOX, (64, 64), projection="perspective", fov=40, margin=0.0)
    assert 2 * math.degrees(math.atan(camera.pixel * 32)) == pytest.approx(40)


@pytest.mark.parametrize(
    ("view", "direction"),
    [
        ("anterior", (0, 1, 0)),
        (" Posterior ", (0, -1, 0)),
        ("anterior-left", (-math.sqrt(0.5), math.sqrt(0.5), 0)),
        ("right-superior-posterior", np.array([1, -1, 1]) / math.sqrt(3)),
        ("0, -2, 0", (0, -1, 0)),
        ("-3,0,4", (-0.6, 0, 0.8)),
        ((0, 0, 5), (0, 0, 1)),
    ],
)
def test_views_by_name_and_vector(view, direction):
    np.testing.assert_allclose(view_direction(view), direction, atol=1e-12)


@pytest.mark.parametrize(
    ("view", "message"),
    [
        ("front", "view must be one of anterior.*not 'front'"),
        ("", "view must be one of"),
        ("left-right", "a side twice or opposite sides, not 'left-right'"),
        ("1,2", "three numbers"),
        ("1,2,x", "three numbers.*not '1,2,x'"),
        ((0, 0, 0), "view must be three numbers that are not all zero"),
        ((0, math.nan, 1), "view must be three numbers"),
        ((1, 2), "view must be three numbers"),
    ],
)
def test_refuses_bad_views(view, message):
    with pytest.raises(InputError, match=message):
        Camera.looking(view, BOX)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"size": 0}, "pixels, not 0"),
        ({"size": (10, 99999)}, "pixels, not 99999"),
        ({"size": (10.5, 10)}, "whole numbers between 1 and 32768 pixels, not 10.5"),
        ({"size": (math.nan, 10)}, "pixels, not nan"),
        ({"projection": "fisheye"}, "orthographic or perspective, not 'fisheye'"),
        ({"margin": 0.5}, "margin must be between 0 and 0.5, not 0.5"),
        ({"margin": math.nan}, "margin must be"),
        ({"zoom": 0}, "zoom must be positive, not 0"),
        ({"zoom": math.inf}, "zoom must be positive, not inf"),
        ({"roll": math.nan}, "roll must be a number of degrees, not nan"),
        ({"projection": "perspective", "fov": 180}, "fov must be between 1 and 120 degrees, not 180"),
        ({"projection": "perspective", "distance": 5}, "the camera is inside the subject: distance 5 mm"),
        ({"projection": "perspective", "distance": math.nan}, "distance must be a number of mm, not nan"),
        ({"at": np.zeros((0, 3))}, r"\(n, 3\) points"),
        ({"at": np.zeros((4, 2))}, r"\(n, 3\) points"),
        ({"at": [(0, 0, math.inf)]}, r"\(n, 3\) points"),
    ],
)
def test_refuses_bad_options(options, message):
    with pytest.raises(InputError, match=message):
        Camera.looking("anterior", **{"at": BOX, **options})


@pytest.mark.parametrize(
    ("changed", "message"),
    [
        ({"eye": (0, 0, math.nan)}, "eye must be three numbers in mm"),
        ({"eye": (0, 0)}, "eye must be three numbers in mm"),
        ({"forward": (0, 0, 0)}, "forward must be three numbers"),
        ({"up": (0, 3, 0)}, r"up must not be parallel to forward, not \[0, 3, 0\]"),
        ({"pixel": 0.0}, "pixel size must be positive, not 0.0"),
        ({"projection": "isometric"}, "orthographic or perspective, not 'isometric'"),
    ],
)
def test_refuses_bad_cameras(changed, message):
    sound = {"eye": (0, 9, 0), "forward": (0, -1, 0), "up": (0, 0, 1), "size": (8, 8), "pixel": 1.0}
    with pytest.raises(InputError, match=message):
        Camera(**{**sound, **changed})
