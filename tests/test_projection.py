"""Largest, smallest and mean values along rays."""

from __future__ import annotations

import numpy as np
import oracle
import pytest

import intaglio as ig
from intaglio.errors import InputError
from intaglio.rendering.projection import projection

WAYS = ("mip", "minip", "average")


def along_y(volume: ig.Volume) -> ig.Camera:
    """One pixel a voxel, from anterior: rows from the last z down, columns from the last x: right is left."""
    z, _, x = volume.shape
    eye = volume.corners.mean(axis=0) + np.array([0.0, 1000.0, 0.0])
    return ig.Camera(eye, np.array([0.0, -1, 0]), np.array([0.0, 0, 1]), (x, z), 1.0)


def noise(shape=(11, 21, 13), seed=0, dtype="float32") -> ig.Volume:
    return ig.Volume.from_array(np.random.default_rng(seed).uniform(-100, 100, shape).astype(dtype))


def linear(p):
    return p @ [0.5, 1.0, -0.25]


def spans(volume, camera):
    """(h, w, 2) values of the linear field where rays enter and leave, NaN where they miss."""
    w, h = camera.size
    out = np.full((h, w, 2), np.nan)
    for y in range(h):
        for x in range(w):
            origin, direction = (a[0] for a in oracle.rays(camera, [x + 0.5], [y + 0.5]))
            *_, near, far, _ = oracle.path(volume, camera, x + 0.5, y + 0.5)
            if near < far:
                out[y, x] = linear(origin + near * direction), linear(origin + far * direction)
    return out


class TestAxisAligned:
    """Samples reach from face to face, so that those a whole part of a voxel apart hit voxels' centres, and nothing lies
    beyond those between them. Inside only: the outermost layer is read a thousandth of a voxel inwards.
    """

    @pytest.mark.parametrize("step", [0.25, 0.5, 1.0])
    @pytest.mark.parametrize("dtype", ["float32", "int16", "uint8", "bool", "float64"])
    def test_extremes_are_those_of_the_voxels(self, dtype, step):
        values = np.random.default_rng(1).uniform(0, 200, (11, 21, 13))
        values[:, (0, -1)] = 100
        array = values > 190 if dtype == "bool" else values.astype(dtype)
        volume = ig.Volume.from_array(array)
        for mode, extreme in (("mip", np.max), ("minip", np.min)):
            got = projection(volume, along_y(volume), mode, step=step)
            want = extreme(array.astype(np.float32), axis=1)[::-1, ::-1]
            # A float32 sample lies within 1e-5 voxel of the centre; neighbours differ by up to 200.
            np.testing.assert_allclose(got[1:-1, 1:-1], want[1:-1, 1:-1], atol=4e-3)

    @pytest.mark.parametrize("step", [0.25, 0.5, 1.0])
    def test_the_mean_is_that_of_the_field(self, step):
        """Trapezoids between voxels, which the midpoints of whole parts of a voxel meet."""
        volume = noise()
        got = projection(volume, along_y(volume), "average", step=step)
        want = (np.trapezoid(volume.array, axis=1) / 20)[::-1, ::-1]
        np.testing.assert_allclose(got[1:-1, 1:-1], want[1:-1, 1:-1], atol=5e-3)


class TestLinearField:
    @pytest.mark.parametrize("projection_", ["orthographic", "perspective"])
    @pytest.mark.parametrize("axes", [np.eye(3), np.diag([0.5, 1.0, 2.0]), [[0.9, -0.3, 0], [0.3, 0.9, 0.2], [0, 0, 1.1]]])
    def test_closed_forms(self, axes, projection_):
        """The extremes are at the faces, the mean is that of both ends; whatever the step."""
        shape = (13, 17, 19)
        volume = oracle.sampled(linear, shape, oracle.centred(shape, axes))
        camera = ig.Camera.looking((0.4, 1, 0.3), volume, 16, projection=projection_)
        ends = spans(volume, camera)
        for step in (0.3, 0.5, 2.0):
            for mode, want in zip(WAYS, (ends.max(axis=2), ends.min(axis=2), ends.mean(axis=2)), strict=True):
                got = projection(volume, camera, mode, step=step)
                np.testing.assert_allclose(got, want, atol=5e-3, err_msg=f"{mode} {step}")
                assert np.isnan(got).any()


class TestBlob:
    def test_the_brightest_is_what_passes_nearest_to_the_middle(self):
        width, n = 4.0, 41
        volume = oracle.sampled(lambda p: np.exp(-(p**2).sum(axis=-1) / (2 * width**2)), (n, n, n))
        camera = ig.Camera.looking((0.4, 1, 0.3), volume, 33)
        got = projection(volume, camera, "mip", step=0.25)
        y, x = np.mgrid[:33, :33] + 0.5
        origin, direction = oracle.rays(camera, x.ravel(), y.ravel())
        miss = np.linalg.norm(np.cross(origin, direction), axis=1)
        near = (miss < 12).reshape(33, 33)
        # Trilinear values fall short of the middle's by up to h²/8 of three second derivatives of 1 / width².
        np.testing.assert_allclose(got[near], np.exp(-(miss**2) / (2 * width**2)).reshape(33, 33)[near], atol=3 / 8 / width**2)

    def test_finer_steps_find_more(self):
        volume = noise((9, 9, 9))
        camera = ig.Camera.looking((0.4, 1, 0.3), volume, 24)
        coarse, fine = (projection(volume, camera, "mip", step=s) for s in (0.5, 0.0625))
        seen = ~np.isnan(coarse)
        assert fine[seen].mean() > coarse[seen].mean()
        assert fine[seen].max() <= volume.range[1] + 1e-3


@pytest.mark.parametrize("mode", WAYS)
def test_skipping_blocks_changes_nothing(mode, monkeypatch):
    """All blocks sampled: for an extreme they may hold anything, for a mean they are never constant."""
    values = np.zeros((30, 33, 28), dtype=np.float32)
    values[5:9, 6:9, 7:20] = np.random.default_rng(2).normal(size=(4, 3, 13))
    volume = ig.Volume.from_array(values)
    camera = ig.Camera.looking((0.4, 1, 0.3), volume, 40, projection="perspective")
    skipped = projection(volume, camera, mode)
    monkeypatch.setattr(
        "intaglio.rendering.projection.min_max_blocks",
        lambda _: (np.full((4, 4, 4), -np.inf, dtype=np.float32), np.full((4, 4, 4), np.inf, dtype=np.float32)),
    )
    np.testing.assert_allclose(skipped, projection(volume, camera, mode), atol=1e-6 if mode == "average" else 0)


class TestPicture:
    def test_greys_without_a_transfer_function(self):
        volume = noise()
        camera = ig.Camera.looking((0.4, 1, 0.3), volume, 20)
        low, high = volume.range
        for mode in WAYS:
            value = projection(volume, camera, mode)
            got = ig.render(volume, None, camera, mode=mode, background=(0.1, 0.2, 0.3, 1.0)).array
            inside = ~np.isnan(value)
            grey = np.clip((value[inside] - low) / (high - low), 0, 1)
            np.testing.assert_allclose(got[inside], np.stack([grey, grey, grey, np.ones_like(grey)], axis=1), atol=1e-6)
            np.testing.assert_allclose(got[~inside], np.broadcast_to([0.1, 0.2, 0.3, 1.0], got[~inside].shape), atol=1e-6)

    def test_colours_of_a_transfer_function(self):
        volume = noise()
        camera = ig.Camera.looking((0.4, 1, 0.3), volume, 20)
        tf = ig.TransferFunction.from_points([(-100, "#000080", 0.2), (100, "#ff8000", 1.0)])
        value = projection(volume, camera, "mip")
        got = ig.render(volume, tf, camera, mode="mip", background=(0, 0, 0, 0)).array
        inside = ~np.isnan(value)
        np.testing.assert_allclose(got[inside], tf(value[inside]), atol=1e-5)
        assert (got[~inside] == 0).all()

    def test_bytes_are_the_same_on_any_number_of_threads(self, monkeypatch):
        volume = noise()
        camera = ig.Camera.looking((0.4, 1, 0.3), volume, 80)
        for mode in WAYS:
            shots = []
            for threads in "12":
                monkeypatch.setenv("INTAGLIO_THREADS", threads)
                shots.append(ig.render(volume, None, camera, mode=mode).array.tobytes())
            assert shots[0] == shots[1]

    def test_a_step_must_be_a_step(self):
        volume = noise()
        with pytest.raises(InputError, match="step must be between"):
            ig.render(volume, None, along_y(volume), mode="mip", step=0)


class TestCut:
    """A plane across the rays: what lies in front of it does not count."""

    def volume(self) -> ig.Volume:
        """Value and millimetre along y are the same."""
        return ig.Volume.from_array(np.broadcast_to(np.arange(21.0)[:, None], (11, 21, 13)).astype(np.float32))

    @pytest.mark.parametrize(("mode", "want"), [("mip", 8.0), ("minip", 0.0), ("average", 4.0)])
    def test_only_what_is_kept_counts(self, mode, want):
        volume = self.volume()
        plane = ig.Selection.plane((0, 8.01, 0), (0, 1, 0))
        camera = along_y(volume)
        got = projection(volume, camera, mode, step=0.05, selections=[plane])
        hit = ~np.isnan(projection(volume, camera, mode))
        np.testing.assert_allclose(got[hit], want, atol=0.06)

    @pytest.mark.parametrize("mode", ["mip", "minip", "average"])
    def test_where_nothing_is_kept_there_is_nothing(self, mode):
        volume = self.volume()
        away = ig.Selection.plane((0, -5, 0), (0, 1, 0))
        assert np.isnan(projection(volume, along_y(volume), mode, selections=[away])).all()
        image = ig.render(volume, None, along_y(volume), mode=mode, selections=[away], background=(1, 0, 0, 1))
        assert (image.array == np.float32([1, 0, 0, 1])).all()

    @pytest.mark.parametrize("mode", ["mip", "minip", "average"])
    def test_a_tool_that_cuts_nothing_changes_nothing(self, mode):
        volume = noise()
        beside = ig.Selection.plane((0, 100, 0), (0, 1, 0))
        camera = ig.Camera.looking("anterior-left", volume, (20, 20))
        np.testing.assert_allclose(
            projection(volume, camera, mode, selections=[beside]), projection(volume, camera, mode), atol=1e-5
        )
