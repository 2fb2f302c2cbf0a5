"""Light and Material: frames, packing and what they refuse."""

from __future__ import annotations

import math

import numpy as np
import pytest

from intaglio import Camera, InputError, Light, Material
from intaglio.lighting import KINDS, packed_lights

SUBJECT = [(-50, -50, -50), (50, 50, 50)]


@pytest.mark.parametrize("view", ["anterior", "left", "superior", (1, 2, 3)])
def test_camera_light_stays_in_the_picture(view):
    camera = Camera.looking(view, SUBJECT, 64)
    lights = [Light(direction=d) for d in ((2, 0, 0), (0, 1, 0), (0, 0, 1))]
    rows = packed_lights(lights, camera)
    np.testing.assert_allclose(rows[:, 1:4], [camera.right, camera.up, -camera.forward], atol=1e-6)


def test_world_light_stays_in_the_patient():
    light = Light(kind="point", frame="world", direction=(0, 3, 4), position=(10, 20, 30))
    for view in ("left", "inferior"):
        row = packed_lights([light], Camera.looking(view, SUBJECT, 64))[0]
        np.testing.assert_allclose(row[1:7], [0, 0.6, 0.8, 10, 20, 30], atol=1e-6)


def test_camera_positions_count_from_the_eye():
    camera = Camera.looking("anterior", SUBJECT, 64)
    row = packed_lights([Light(kind="spot", position=(1, 2, -30))], camera)[0]
    np.testing.assert_allclose(row[4:7], camera.eye + camera.right + 2 * camera.up + 30 * camera.forward, atol=1e-4)


def test_rows_hold_kind_intensity_and_cones():
    lights = [Light(kind=kind, intensity=i + 0.5, cone=40) for i, kind in enumerate(KINDS)]
    rows = packed_lights(lights, Camera.looking("right", SUBJECT, 64))
    assert rows.shape == (3, 10)
    assert rows.dtype == np.float32
    np.testing.assert_array_equal(rows[:, 0], [0, 1, 2])
    np.testing.assert_array_equal(rows[:, 7], [0.5, 1.5, 2.5])
    np.testing.assert_allclose(rows[:, 8:], [[math.cos(math.radians(40)), math.cos(math.radians(32))]] * 3, rtol=1e-6)


def test_no_light_is_allowed():
    assert packed_lights([], Camera.looking("right", SUBJECT, 64)).shape == (0, 10)


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"kind": "lamp"}, "kind must be one of directional, point, spot, not 'lamp'"),
        ({"frame": "room"}, "frame must be camera or world, not 'room'"),
        ({"direction": (0, 0, 0)}, "direction must be three numbers"),
        ({"direction": (0, math.nan, 1)}, "direction must be three numbers"),
        ({"direction": (1, 2)}, "direction must be three numbers"),
        ({"position": (1, 2)}, "position must be three numbers in mm"),
        ({"position": (1, 2, math.inf)}, "position must be three numbers in mm"),
        ({"intensity": -1}, "intensity must not be negative, not -1"),
        ({"intensity": math.nan}, "intensity must not be negative, not nan"),
        ({"cone": 0}, "cone must be between 0 and 90 degrees, not 0"),
        ({"cone": 91}, "cone must be between 0 and 90 degrees, not 91"),
    ],
)
def test_refuses_bad_lights(options, message):
    with pytest.raises(InputError, match=message):
        Light(**options)


@pytest.mark.parametrize("name", ["ambient", "diffuse", "specular", "shininess"])
@pytest.mark.parametrize("value", [-0.1, math.inf, math.nan])
def test_refuses_bad_materials(name, value):
    with pytest.raises(InputError, match=f"material {name} must not be negative, not {value}"):
        Material(**{name: value})
