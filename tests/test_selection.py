"""Selections: cut faces lie on the tool and have its normals, wherever the tool is put."""

from __future__ import annotations

import numpy as np
import pytest

import intaglio as ig
from intaglio.selection import Selection

RADIUS = 20.0
CENTRE = np.array([31.0, 31.0, 31.0])


def ball(n: int, radius: float, binary: bool = False) -> ig.Volume:
    """A tool of n cubed voxels round its own origin, its ball of unit radius times `radius`."""
    axis = np.linspace(-1.5, 1.5, n) * radius
    z, y, x = np.meshgrid(axis, axis, axis, indexing="ij")
    distance = np.sqrt(x * x + y * y + z * z) - radius
    step = axis[1] - axis[0]
    return ig.Volume.from_array(distance < 0 if binary else distance.astype(np.float32), step, (axis[0],) * 3, "ball")


@pytest.fixture(scope="module")
def body():
    z, y, x = np.mgrid[:63, :63, :63]
    return ig.Volume.from_array((RADIUS - np.sqrt((x - 31.0) ** 2 + (y - 31.0) ** 2 + (z - 31.0) ** 2)).astype(np.float32))


def pose(turn=0.0, scale=1.0, at=CENTRE):
    c, s = np.cos(turn), np.sin(turn)
    matrix = np.eye(4)
    matrix[:3, :3] = scale * np.array([[c, -s, 0], [s, c, 0], [0, 0, 1]])
    matrix[:3, 3] = at
    return matrix


def hits(volume, selections, view=(0.2, 0.3, 1.0), **options):
    camera = ig.Camera.looking(view, volume, (120, 120))
    gb = ig.isosurface(volume, 0.0, camera, selections=selections, **options)
    y, x = np.nonzero(gb.mask)
    r = camera.rays()
    at = r[0] + (x[:, None] + 0.5) * r[1] + (y[:, None] + 0.5) * r[2] + gb.depth[y, x][:, None] * r[3]
    return at, gb.normal[y, x]


def test_a_plane_leaves_one_side_and_a_flat_face(body):
    normal = np.array([0.1, -0.2, 1.0]) / np.linalg.norm([0.1, -0.2, 1.0])
    at, n = hits(body, [Selection.plane(CENTRE + 5 * normal, normal)])
    height = (at - CENTRE) @ normal
    assert height.max() < 5 + 1e-3
    face = np.abs(height - 5) < 1e-3
    assert face.sum() > 1000
    assert np.allclose(n[face], normal, atol=1e-5)
    away = np.linalg.norm(at[face] - CENTRE, axis=1)
    assert away.max() < RADIUS + 0.01
    assert away.max() > RADIUS - 0.5


@pytest.mark.parametrize(("turn", "scale"), [(0.0, 1.0), (0.7, 1.0), (0.7, 1.6)])
def test_a_distance_volume_cuts_smoothly_in_any_pose(body, turn, scale):
    place = CENTRE + np.array([0, 0, 16.0])
    at, n = hits(body, [Selection.of(ball(64, 8.0), pose(turn, scale, place))])
    towards = place - at
    distance = np.linalg.norm(towards, axis=1)
    assert distance.min() > 8 * scale - 0.05
    face = np.linalg.norm(at - CENTRE, axis=1) < RADIUS - 1
    assert face.sum() > 100
    assert np.abs(distance[face] - 8 * scale).max() < 0.05
    # Outwards of the body is towards the middle of the tool.
    cosine = np.einsum("nc,nc->n", n[face], towards[face] / distance[face, None])
    assert np.degrees(np.arccos(np.clip(cosine, -1, 1))).max() < 3.0


def test_a_binary_volume_of_the_same_size_cuts_in_steps(body):
    place = CENTRE + np.array([0, 0, 16.0])

    def spread(tool):
        at, n = hits(body, [Selection.of(tool, pose(0.0, 1.0, place))])
        towards = place - at
        distance = np.linalg.norm(towards, axis=1)
        face = np.linalg.norm(at - CENTRE, axis=1) < RADIUS - 1
        return np.einsum("nc,nc->n", n[face], towards[face] / distance[face, None]).std()

    assert spread(ball(32, 8.0, binary=True)) > 5 * spread(ball(32, 8.0))


def test_several_tools_and_what_they_keep(body):
    tool = ball(48, 10.0)
    at, _ = hits(body, [Selection.of(tool, pose(), keep="inside")])
    assert np.linalg.norm(at - CENTRE, axis=1).max() < 10.05
    at, _ = hits(body, [Selection.plane(CENTRE, (1, 0, 0)), Selection.plane(CENTRE, (0, 1, 0))])
    assert at[:, 0].max() < 31.01
    assert at[:, 1].max() < 31.01


def test_moving_the_tool_moves_the_cut(body):
    plane = Selection.plane(CENTRE, (0, 0, 1))
    shift = np.eye(4)
    shift[2, 3] = 4.0
    at, _ = hits(body, [plane.moved(shift)])
    assert at[:, 2].max() == pytest.approx(35.0, abs=1e-3)


def test_skipping_blocks_does_not_change_a_cut(body, monkeypatch):
    selections = [Selection.of(ball(32, 9.0), pose(0.4, 1.0, CENTRE + 12)), Selection.plane(CENTRE, (0, 0.2, 1))]
    skipped, _ = hits(body, selections)
    monkeypatch.setattr("intaglio.rendering.isosurface.cut_blocks", lambda volume, blocks, heads: np.ones_like(blocks))
    everywhere, _ = hits(body, selections)
    assert np.allclose(skipped, everywhere, atol=1e-4)


def test_render_is_cut_and_lit_by_the_tool(body):
    solid = ig.TransferFunction.from_points([(-1e-3, "#ffffff", 0.0), (0.0, "#ffffff", 1.0), (99.0, "#ffffff", 1.0)])
    camera = ig.Camera.looking("superior", body, (80, 80))
    half = Selection.plane(CENTRE, (0, 0, 1))
    options = {"background": (0.0, 0.0, 0.0, 0.0), "lights": (ig.Light(direction=(0, 0, 1)),)}
    material = ig.Material(ambient=0.0, diffuse=1.0, specular=0.0)
    cut = ig.render(body, solid, camera, selections=[half], material=material, **options)
    assert cut.array[40, 40, 3] > 0.99
    assert cut.array[40, 40, 0] == pytest.approx(1.0, abs=0.02)
    nothing = ig.render(body, solid, camera, selections=[half, Selection.plane(CENTRE, (0, 0, -1))], **options)
    assert nothing.array[..., 3].max() < 0.6
    gone = ig.render(body, solid, camera, selections=[Selection.plane(CENTRE + 30, (0, 0, -1))], **options)
    assert gone.array[..., 3].max() == 0.0


def test_isosurfaces_are_cut(body):
    camera = ig.Camera.looking("superior", body, (60, 60))
    options = {"mode": "isosurface", "surfaces": [(0.0, (1.0, 1.0, 1.0), 0.5)], "background": (0.0, 0.0, 0.0, 0.0)}
    whole = ig.render(body, None, camera, **options)
    half = ig.render(body, None, camera, selections=[Selection.plane(CENTRE, (0, 0, 1))], **options)
    assert whole.array[30, 30, 3] == pytest.approx(0.75, abs=1e-3)
    assert half.array[30, 30, 3] == pytest.approx(0.5, abs=1e-3)


@pytest.mark.parametrize(
    ("make", "message"),
    [
        (lambda: Selection.plane((0, 0, 0), (0, 0, 0)), "plane needs"),
        (lambda: Selection.plane((0, 0, np.nan), (0, 0, 1)), "plane needs"),
        (lambda: Selection.of(ball(8, 1.0), np.zeros((4, 4))), "invertible"),
        (lambda: Selection.of(ig.Volume.from_array(np.ones((4, 4, 4), dtype=bool))), "an inside and an outside"),
        (lambda: Selection.of(ig.Volume.from_array(np.random.default_rng(1).random((4, 4, 4)))), "signed distance"),
        (lambda: Selection.of(ball(8, 1.0), keep="both"), "keep must be"),
    ],
)
def test_tools_that_cannot_cut(make, message):
    with pytest.raises(ig.InputError, match=message):
        make()
