"""Holds docs/conventions.md, line by line."""

from __future__ import annotations

import ast
import math
import re
from functools import cache
from pathlib import Path

import numpy as np
import pytest
import SimpleITK

from intaglio import Camera, Drawing, GBuffer, Image, Light, TransferFunction, TriangleMesh, Volume, read_volume
from intaglio.camera import VIEWS, view_direction
from intaglio.drawing import Dots, Layer
from intaglio.lighting import packed_lights
from intaglio.rendering.isosurface import isosurface

ROOT = Path(__file__).parent.parent
PAGE = (ROOT / "docs" / "conventions.md").read_text(encoding="utf-8")
BOX = Volume.from_array(np.zeros((11, 21, 31)), spacing=(2.0, 1.0, 3.0), origin=(-10.0, 40.0, 7.0))
CENTRE = BOX.corners.mean(axis=0)
RIGHT, ANTERIOR, SUPERIOR = np.eye(3)
SIDES = {
    "right": RIGHT,
    "left": -RIGHT,
    "anterior": ANTERIOR,
    "posterior": -ANTERIOR,
    "superior": SUPERIOR,
    "inferior": -SUPERIOR,
}
PROJECTIONS = ("orthographic", "perspective")


def test_every_line_has_its_test_and_every_test_its_line():
    lines = re.findall(r"^- .*(?:\n  [^|\s].*)*", PAGE, flags=re.MULTILINE)
    named = [re.findall(r"`(test_\w+)`", line) for line in lines]
    assert all(len(tests) == 1 for tests in named)
    here = {name for name in globals() if name.startswith("test_")} - {
        test_every_line_has_its_test_and_every_test_its_line.__name__
    }
    assert {tests[0] for tests in named} == here


# World and grids


def test_world_is_ras():
    volume = Volume.from_array(np.zeros((2, 2, 2)))
    np.testing.assert_array_equal(volume.world_from_index, np.eye(4))
    for side, axis in SIDES.items():
        np.testing.assert_array_equal(view_direction(side), axis)


def test_files_in_lps_are_turned_once(tmp_path):
    image = SimpleITK.GetImageFromArray(np.arange(24, dtype=np.int16).reshape(2, 3, 4))
    image.SetSpacing((1.0, 2.0, 3.0))
    image.SetOrigin((10.0, 20.0, 30.0))
    SimpleITK.WriteImage(image, str(tmp_path / "scan.nrrd"))
    volume = read_volume(tmp_path / "scan.nrrd")
    brightest = np.argwhere(volume.array == volume.array.max())[0][::-1]
    position = (volume.world_from_index @ [*brightest, 1.0])[:3]
    lps = image.TransformIndexToPhysicalPoint((3, 2, 1))
    np.testing.assert_allclose(position, np.array(lps) * (-1, -1, 1))


def test_arrays_are_z_y_x():
    array = np.arange(24.0).reshape(2, 3, 4)
    volume = Volume.from_array(array, spacing=(1.0, 10.0, 100.0))
    assert volume.shape == (2, 3, 4)
    np.testing.assert_allclose(volume.spacing, (1, 10, 100))
    i, j, k = np.rint(volume.index_from_world @ [3.0, 20.0, 100.0, 1.0]).astype(int)[:3]
    assert volume.array[k, j, i] == 23.0


def test_voxel_centres_are_at_integers():
    first = BOX.world_from_index @ [0, 0, 0, 1]
    last = BOX.world_from_index @ [30, 20, 10, 1]
    np.testing.assert_allclose(first[:3], (-10, 40, 7))
    np.testing.assert_allclose(last[:3], (50, 60, 37))
    np.testing.assert_allclose([BOX.corners.min(axis=0), BOX.corners.max(axis=0)], [first[:3], last[:3]])


def test_transforms_are_named_b_from_a():
    turned = np.array([(0, -2, 0, 5), (3, 0, 0, 6), (0, 0, 4, 7), (0, 0, 0, 1)], dtype=float)
    volume = Volume(np.zeros((4, 4, 4)), turned)
    world = volume.world_from_index @ [1, 2, 3, 1]
    np.testing.assert_allclose(world, (1, 9, 19, 1))
    np.testing.assert_allclose(volume.index_from_world @ world, (1, 2, 3, 1))
    camera = Camera.looking("anterior", volume, 64)
    view_from_index = camera.view_from_world @ volume.world_from_index[:3, :3]
    np.testing.assert_allclose(view_from_index @ [1, 0, 0], camera.view_from_world @ (3 * ANTERIOR))


def test_voxels_keep_their_type():
    for dtype in (bool, np.uint8, np.int16, np.int32, np.float32, np.float64):
        array = np.zeros((2, 2, 2), dtype=dtype)
        assert Volume.from_array(array).array is array


# Pictures and cameras


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_pixel_centres_are_at_a_half(projection):
    camera = Camera.looking("anterior", BOX, (9, 5), projection=projection)
    x, y, _ = camera.project([camera.eye + 80 * camera.forward])[0]
    assert (x, y) == pytest.approx((4.5, 2.5))  # the centre of the middle pixel, [2, 4]
    gb = GBuffer.empty(camera)
    assert gb.depth.shape == (5, 9)
    assert gb.normal.shape == (5, 9, 3)
    right, below = camera.project(camera.eye + 80 * camera.forward + np.array([camera.right, -camera.up]))
    assert right[0] > x
    assert below[1] > y


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("view", VIEWS)
def test_views_are_named_after_the_viewer(view, projection):
    camera = Camera.looking(view, BOX, 64, projection=projection)
    towards = camera.eye - CENTRE
    np.testing.assert_allclose(towards / np.linalg.norm(towards), SIDES[view], atol=1e-12)
    np.testing.assert_allclose(-camera.forward, view_direction(view))


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("row", re.findall(r"^  \| (\w+) \| (\w+) \| (\w+) \| (\w+) \|$", PAGE, flags=re.MULTILINE))
def test_what_appears_where(row, projection):
    view, left, right, up = row
    camera = Camera.looking(view, BOX, (100, 80), projection=projection)
    x, y, _ = camera.project(CENTRE + np.array([SIDES[left], SIDES[right], SIDES[up]])).T
    assert x[0] < 50 < x[1]
    assert y[2] < 40
    np.testing.assert_allclose(y[:2], 40)
    assert x[2] == pytest.approx(50)


@pytest.mark.parametrize("view", [*VIEWS, "anterior-left-superior"])
def test_view_space_looks_along_minus_z(view):
    camera = Camera.looking(view, BOX, 64)
    np.testing.assert_allclose(camera.view_from_world @ camera.forward, (0, 0, -1), atol=1e-12)
    np.testing.assert_allclose(camera.view_from_world @ camera.up, (0, 1, 0), atol=1e-12)
    np.testing.assert_allclose(camera.view_from_world @ np.cross(camera.forward, camera.up), (1, 0, 0), atol=1e-12)


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_depth_is_along_forward(projection):
    camera = Camera.looking("left", BOX, (64, 64), projection=projection)
    aside = camera.eye + 70 * camera.forward + 25 * camera.right - 9 * camera.up
    assert camera.project([aside])[0, 2] == pytest.approx(70)


@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("view", [*VIEWS, (3, -1, 2)])
def test_rays_and_project_agree(view, projection):
    camera = Camera.looking(view, BOX, (320, 200), projection=projection, roll=20)
    image = np.array([(0, 0, 40), (320, 0, 50), (0.5, 199.5, 60), (100, 77, 70)])
    r = camera.rays()
    x, y, depth = image.T[..., None]
    world = r[0] + x * r[1] + y * r[2] + depth * (r[3] + x * r[4] + y * r[5])
    np.testing.assert_allclose(camera.project(world), image, atol=1e-9)


def test_pixel_is_its_side():
    camera = Camera((0, 0, 0), -ANTERIOR, SUPERIOR, (10, 10), pixel=0.5)
    near = Camera((0, 0, 0), -ANTERIOR, SUPERIOR, (10, 10), pixel=0.005, projection="perspective")
    for c in (camera, near):
        steps = np.diff(c.project(100 * c.forward + np.array([[0], [0.5]]) * c.right), axis=0)
        np.testing.assert_allclose(steps, [(1, 0, 0)], atol=1e-12)


def test_roll_is_clockwise():
    camera = Camera.looking("anterior", BOX, (100, 100), roll=30)
    x, y, _ = camera.project([CENTRE + SUPERIOR])[0]
    clockwise_from_up = math.degrees(math.atan2(x - 50, 50 - y))
    assert clockwise_from_up == pytest.approx(30)


@pytest.mark.parametrize("projection", PROJECTIONS)
def test_one_number_is_the_longer_side(projection):
    wide = [(-40, 0, -10), (40, 5, 10)]
    assert Camera.looking("anterior", wide, 400, projection=projection, margin=0.0).size[0] == 400
    assert Camera.looking("anterior", wide, 400, projection=projection, margin=0.0).size[1] == pytest.approx(100, abs=10)
    assert Camera.looking("anterior", wide, 400, projection=projection, roll=90).size[1] == 400


@pytest.mark.parametrize("size", [(300, 200), (200, 300)])
@pytest.mark.parametrize("projection", PROJECTIONS)
@pytest.mark.parametrize("view", VIEWS)
def test_margin_is_a_part_of_the_shorter_side(view, projection, size):
    camera = Camera.looking(view, BOX, size, projection=projection, margin=0.1)
    x, y, _ = camera.project(BOX.corners).T
    border = (x.min(), size[0] - x.max(), y.min(), size[1] - y.max())
    assert min(border) == pytest.approx(20)


# Surfaces

RADIUS = 8.0


@cache
def seen(body: str, sign: int) -> GBuffer:
    """A sphere or an upright cylinder from anterior; sign 1 as a scan, brighter inside, -1 as a distance field."""
    step = np.array([1.0, 0.8, 1.25])
    z, y, x = np.meshgrid(*(np.arange(-12, 12.01, s) for s in step[::-1]), indexing="ij")
    distance = np.sqrt(x**2 + y**2 + (z**2 if body == "sphere" else 0.0)) - RADIUS
    volume = Volume.from_array((-sign * distance).astype(np.float32), step, origin=(x.min(), y.min(), z.min()))
    camera = Camera.looking("anterior", [(-9, -9, -9), (9, 9, 9)], (18, 18))
    return isosurface(volume, 0.0, camera, inside="above" if sign > 0 else "below")


def test_bodies_are_bright_in_scans_and_negative_in_distance_fields():
    for sign in (1, -1):
        gb = seen("sphere", sign)
        nearest = gb.camera.eye[1] - RADIUS  # from the eye's plane to the sphere's front, in mm
        assert gb.depth.min() == pytest.approx(nearest, abs=0.1)
        assert gb.mask[9, 9]
        assert not gb.mask[0, 0]


def test_normals_point_outwards():
    for sign in (1, -1):
        gb = seen("sphere", sign)
        rows, columns = np.nonzero(gb.mask)
        r = gb.camera.rays()
        x, y = columns[:, None] + 0.5, rows[:, None] + 0.5
        outwards = (r[0] + x * r[1] + y * r[2] + gb.depth[rows, columns][:, None] * r[3]) / RADIUS
        # A degree: the smoothing spline flattens a sphere of eight voxels a little.
        assert (np.einsum("ij,ij->i", gb.normal[rows, columns], outwards) > math.cos(math.radians(1))).all()
        np.testing.assert_allclose(np.linalg.norm(gb.normal[rows, columns], axis=1), 1.0, atol=1e-5)


def test_spheres_have_positive_curvature():
    for sign in (1, -1):
        gb = seen("sphere", sign)
        np.testing.assert_allclose(gb.curvature[gb.mask], 1 / RADIUS, rtol=0.03)


def test_direction_is_that_of_the_larger_curvature():
    gb = seen("cylinder", 1)
    curvature, direction, normal = (a[9, 4:14] for a in (gb.curvature, gb.direction, gb.normal))
    np.testing.assert_allclose(curvature, [(1 / RADIUS, 0.0)] * 10, atol=0.03 / RADIUS)
    np.testing.assert_allclose(direction @ SUPERIOR, 0.0, atol=0.02)
    np.testing.assert_allclose(np.abs(np.cross(normal, direction) @ SUPERIOR), 1.0, atol=0.02)


def test_triangles_run_counter_clockwise():
    vertices = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
    mesh = TriangleMesh(vertices, np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)]))
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    outwards = (a + b + c) / 3 - vertices.mean(axis=0)
    assert (np.einsum("ij,ij->i", np.cross(b - a, c - a), outwards) > 0).all()
    assert mesh.report.oriented


# Light and colour


@pytest.mark.parametrize("view", [*VIEWS, (3, -1, 2)])
def test_lights_stand_in_their_frame(view):
    camera = Camera.looking(view, BOX, 64)
    in_view = packed_lights([Light(kind="point", direction=(0, 0, 1), position=(5, 6, -7))], camera)[0]
    np.testing.assert_allclose(in_view[1:4], view_direction(view), atol=1e-6)
    np.testing.assert_allclose(camera.project([in_view[4:7]])[0, 2], 7, atol=1e-4)
    in_world = packed_lights([Light(kind="point", frame="world", direction=(0, 0, 1), position=(5, 6, -7))], camera)[0]
    np.testing.assert_allclose(in_world[1:7], (0, 0, 1, 5, 6, -7), atol=1e-6)
    assert Light().frame == "camera"


def test_alpha_is_straight():
    tf = TransferFunction.from_points([(0, "#ff8000", 0.0), (1, "#ff8000", 1.0)])
    np.testing.assert_allclose(tf.table(0, 1, 5)[:, :3], [(1.0, 128 / 255, 0.0)] * 5, rtol=1e-6)
    image = Image(np.array([[(1.0, 0.5, 0.0, 0.0)]], dtype=np.float32))
    assert image.bytes8.tolist() == [[[255, 128, 0, 0]]]


def test_opacity_is_per_reference_length():
    tf = TransferFunction.from_points([(0, "#ffffff", 0.75)], reference_length=2.0)
    for step, opacity in ((2.0, 0.75), (1.0, 0.5), (4.0, 0.9375)):
        np.testing.assert_allclose(tf.table(0, 1, 2, step=step)[:, 3], opacity, rtol=1e-6)


# Paper


def dot(x: float, y: float, colour: str) -> Layer:
    place, diameter, opacity = ((x, y),), (1.5,), (1.0,)
    return Layer(
        "dot",
        dots=Dots(np.array(place, np.float32), np.array(diameter, np.float32), np.array(opacity, np.float32)),
        colour=colour,
    )


def test_paper_is_in_millimetres_from_the_upper_left():
    image = Drawing((dot(6.5, 1.5, "#000000"),), width_mm=8, height_mm=5).image(dpi=25.4)
    assert image.array.shape == (5, 8, 4)
    assert np.unravel_index(image.array[..., 0].argmin(), (5, 8)) == (1, 6)


def test_later_layers_lie_on_top():
    red, blue = dot(2.5, 2.5, "#ff0000"), dot(2.5, 2.5, "#0000ff")
    for layers, channel in (((red, blue), 2), ((blue, red), 0)):
        assert Drawing(layers, width_mm=5, height_mm=5).image(dpi=25.4).bytes8[2, 2, :3].argmax() == channel


# Numbers


def test_angles_are_degrees():
    turned = Camera.looking("anterior", BOX, 64, roll=360.0)
    np.testing.assert_allclose(turned.up, SUPERIOR, atol=1e-12)
    row = packed_lights([Light(kind="spot", cone=60.0)], turned)[0]
    assert row[8] == pytest.approx(0.5)
    wide = Camera.looking("anterior", BOX, (64, 64), projection="perspective", fov=90.0, margin=0.0)
    assert wide.pixel * 32 == pytest.approx(1.0)


def test_dtypes():
    camera = Camera.looking("anterior", BOX, 16)
    gb = GBuffer.empty(camera)
    samples = [getattr(gb, name) for name in ("depth", "normal", "curvature", "direction", "view_curvature", "light", "edge")]
    samples += [gb.brightness, gb.pixel_mm, TransferFunction.preset("ct-bone")(0), packed_lights([Light()], camera)]
    assert {s.dtype for s in samples} == {np.dtype(np.float32)}
    mesh = TriangleMesh(np.eye(3), np.array([(0, 1, 2)]))
    places = [
        BOX.world_from_index,
        BOX.index_from_world,
        BOX.corners,
        camera.eye,
        camera.view_from_world,
        camera.rays(),
        mesh.vertices,
    ]
    assert {p.dtype for p in places} == {np.dtype(np.float64)}


def test_chance_comes_from_a_seed():
    loose = []
    for path in sorted((ROOT / "src").rglob("*.py")):
        for node in ast.walk(ast.parse(path.read_text(encoding="utf-8"))):
            source = ast.unparse(node) if isinstance(node, ast.Attribute | ast.Call | ast.Import | ast.ImportFrom) else ""
            legacy = re.fullmatch(r"(np|numpy)\.random\.(?!default_rng|Generator|SeedSequence|PCG64|Philox)\w+", source)
            unseeded = re.fullmatch(r"(np|numpy)\.random\.default_rng\((None)?\)", source)
            if legacy or unseeded or re.match(r"(import random|from random import)\b", source):
                loose.append(f"{path.name}:{node.lineno}: {source}")
    assert loose == []
