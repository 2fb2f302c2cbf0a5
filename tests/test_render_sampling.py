"""Where values and gradients of a rendered sample come from, and tools shown as ghosts."""

from __future__ import annotations

import numpy as np
import oracle
import pytest

import intaglio as ig
from intaglio.errors import InputError
from intaglio.rendering.ghost import ghosts

CLEAR = (0.0, 0.0, 0.0, 0.0)
WALL = ig.TransferFunction.from_points([(0.49, "#ffffff", 0.0), (0.5, "#ffffff", 1.0)], reference_length=0.01)


def ball(radius: float = 9.0, n: int = 32) -> ig.Volume:
    """Half at the surface of a ball, falling outwards."""
    return oracle.sampled(
        lambda p: np.clip(0.5 + 0.1 * (radius - np.linalg.norm(p, axis=-1)), 0, 1), (n, n, n), oracle.centred((n, n, n))
    )


def distance(radius: float, n: int = 32) -> ig.Volume:
    return oracle.sampled(lambda p: np.linalg.norm(p, axis=-1) - radius, (n, n, n), oracle.centred((n, n, n)))


def lambert(volume: ig.Volume, **options) -> np.ndarray:
    """How brightly each pixel is lit by a lamp at the eye, and nothing else."""
    camera = ig.Camera.looking("anterior", volume, (48, 48))
    lamp = ig.Light(direction=(0.0, 0.0, 1.0))
    dull = ig.Material(ambient=0.0, diffuse=1.0, specular=0.0)
    return ig.render(volume, WALL, camera, lights=(lamp,), material=dull, background=CLEAR, step=0.1, **options).array


@pytest.mark.parametrize(("gradient", "tolerance"), [("central", 0.02), ("cell", 0.08), ("tricubic", 0.02)])
def test_normals_of_a_ball(gradient, tolerance):
    volume = ball()
    got = lambert(volume, gradient=gradient)
    camera = ig.Camera.looking("anterior", volume, (48, 48))
    off = (np.arange(48) + 0.5 - 24) * camera.pixel
    r = np.hypot(off[:, None], off)
    inside = r < 0.8 * 9.0
    np.testing.assert_allclose(got[inside][:, 0], np.sqrt(1 - (r[inside] / 9.0) ** 2), atol=tolerance)


def test_cells_are_the_roughest():
    """The slope of the trilinear field jumps between cells; the other sources do not."""
    rough = {g: np.abs(np.diff(lambert(ball(), gradient=g)[18:30, 18:30, 0], 2)).mean() for g in ("central", "cell", "tricubic")}
    assert rough["cell"] > 1.5 * max(rough["central"], rough["tricubic"])


def test_central_differences_reach_as_far_as_asked():
    """On a parabola they are exact for every reach; on a wave they shrink as sin(h) / h."""
    x = np.arange(40)
    wave = np.broadcast_to(0.5 + 0.4 * np.sin(0.4 * x), (40, 40, 40)).astype(np.float32)
    volume = ig.Volume.from_array(wave)
    level = ig.TransferFunction.from_points([(0.0, "#ffffff", 0.0), (1.0, "#ffffff", 0.0)])
    steep = [
        ig.TransferFunction2D.emphasized(level, (0.0, 1.0), [(0.0, 0.0), (0.4, 1.0)]),
        ig.TransferFunction2D.emphasized(
            ig.TransferFunction.from_points([(0.0, "#ffffff", 0.1), (1.0, "#ffffff", 0.1)]), (0.0, 1.0), [(0.0, 0.0), (0.4, 1.0)]
        ),
    ]
    camera = ig.Camera.looking("anterior", volume, (40, 40))
    sums = []
    for reach in (0.5, 1.0, 2.0, 3.0):
        a = ig.render(volume, steep[1], camera, reach=reach, lit=False, background=CLEAR).array[10:30, 10:30, 3].astype(float)
        sums.append(-np.log1p(-a).mean())
    want = np.array([np.sin(0.4 * h) / h for h in (0.5, 1.0, 2.0, 3.0)])
    np.testing.assert_allclose(np.array(sums) / sums[0], want / want[0], rtol=0.03)
    assert ig.render(volume, steep[0], camera, background=CLEAR).array[..., 3].max() == 0


def test_tricubic_values_are_the_splines():
    """Through a medium whose opacity is linear in the value, against the float64 spline."""
    rng = np.random.default_rng(5)
    volume = ig.Volume.from_array(rng.uniform(0, 1, (9, 10, 11)).astype(np.float32))
    thin = ig.TransferFunction.from_points([(0.0, "#ffffff", 0.0), (1.0, "#ffffff", 1e-3)])
    camera = ig.Camera.looking("anterior", volume, (12, 12))
    got = ig.render(volume, thin, camera, lit=False, background=CLEAR, interpolation="tricubic", step=0.25).array[6, 6, 3]
    origin, direction, near, far, mm = oracle.path(volume, camera, 6.5, 6.5)
    t = np.linspace(near, far, 200)
    want = np.mean([oracle.bspline(volume.samples, origin + s * direction)[0] for s in t]) * 1e-3 * (far - near) * mm
    assert got == pytest.approx(want, rel=0.02)


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ({"interpolation": "cubic"}, "interpolation must be one of"),
        ({"interpolation": "tricubic", "classify": "pre"}, "tricubic only"),
        ({"gradient": "sobel"}, "gradient must be one of"),
        ({"reach": 0.0}, "reach must be between"),
        ({"reach": np.nan}, "reach must be between"),
        ({"ghost": 1.5}, "ghost must be"),
    ],
)
def test_what_cannot_be_is_refused(options, words):
    volume = ball(4.0, 12)
    with pytest.raises(InputError, match=words):
        ig.render(volume, WALL, ig.Camera.looking("anterior", volume, (8, 8)), **options)


class TestGhost:
    def test_glass_begins_at_the_nearest_tool(self):
        volume = ball()
        camera = ig.Camera.looking("anterior", volume, (33, 33))
        towards = -camera.forward
        poses = [np.eye(4), np.eye(4)]
        poses[1][:3, 3] = 3.0 * towards
        tools = [ig.Selection.of(distance(6.0), pose) for pose in poses]
        veil = ghosts(tools, camera, 0.5, (ig.Light(),))
        middle = camera.rays()
        start = middle[0] + 16.5 * (middle[1] + middle[2])
        depth = float(-(start @ camera.forward)) - 9.0
        assert veil[16, 16, 0] == pytest.approx(depth, abs=0.05)
        assert np.isinf(veil[0, 0, 0])
        assert veil[0, 0, 4] == 0
        rim = veil[..., 4].max()
        assert 0.5 >= rim > 2 * veil[16, 16, 4] > 0

    def test_binary_tools_and_planes(self):
        volume = ball()
        camera = ig.Camera.looking("anterior", volume, (33, 33))
        tool = ig.Volume(distance(6.0).array < 0, volume.world_from_index)
        assert ghosts([ig.Selection.of(tool)], camera, 0.5, (ig.Light(),))[16, 16, 4] > 0
        assert not ghosts([ig.Selection.plane((0, 0, 0), (0, 1, 0))], camera, 0.5, (ig.Light(),))[..., 4].any()

    def test_it_is_behind_what_lies_in_front_of_it_and_before_what_lies_behind(self):
        volume = ball(5.0)
        camera = ig.Camera.looking("anterior", volume, (33, 33))
        towards = -camera.forward
        pictures = {}
        for where in (-9.0, 9.0):
            pose = np.eye(4)
            pose[:3, 3] = where * towards
            tool = ig.Selection.of(distance(3.0), pose)
            plain, veiled = (ig.render(volume, WALL, camera, selections=[tool], ghost=g).array for g in (0.0, 0.8))
            pictures[where] = np.abs(plain - veiled)[14:19, 14:19].max()
        assert pictures[-9.0] == 0.0
        assert pictures[9.0] > 0.02

    def test_beside_the_volume_only_the_glass_is_seen(self):
        volume = ball(4.0, 12)
        camera = ig.Camera.looking("anterior", volume, (64, 64), zoom=0.3)
        pose = np.eye(4)
        pose[:3, 3] = 14.0 * camera.up
        tool = ig.Selection.of(distance(4.0), pose)
        plain, veiled = (ig.render(volume, WALL, camera, selections=[tool], ghost=g).array for g in (0.0, 0.8))
        changed = np.abs(plain - veiled).max(axis=2) > 0
        rows = np.flatnonzero(changed.any(axis=1))
        assert len(rows)
        assert rows.max() < 32
