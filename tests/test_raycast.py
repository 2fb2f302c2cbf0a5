"""Emission and absorption along rays: closed forms, the float64 twin, and what must not change a picture."""

from __future__ import annotations

import math

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

import intaglio as ig
from intaglio.errors import InputError
from intaglio.rendering.emission import OPAQUE

CLASSIFY = ("pre", "post", "preintegrated")
CLEAR = (0.0, 0.0, 0.0, 0.0)
# Entries of the table along the range: a value is looked up at most half of one away, in the two-dimensional one too.
ENTRY, ENTRY_2D = 1 / 4095, 1 / 255
STEEP = ((0.0, "#2040ff", 0.0), (0.35, "#20ff40", 0.05), (0.5, "#ff4020", 0.35), (0.65, "#ffffff", 0.1), (1.0, "#ff00ff", 0.6))


def function(*points, **options) -> ig.TransferFunction:
    return ig.TransferFunction.from_points(points, **options)


def sawtooth(teeth: int = 24, opacity: float = 0.3) -> ig.TransferFunction:
    points = []
    for i in range(teeth):
        colour = ("#d04030", "#f0e0b0", "#3060a0")[i % 3]
        points += [(i / teeth, colour, 0.0), ((i + 1) / teeth, colour, opacity)]
    return ig.TransferFunction.from_points(points)


def blob(n: int = 24, width: float = 5.0, axes=None, shape=None) -> ig.Volume:
    """exp(-r² / 2 width²) around the origin."""
    shape = shape or (n, n, n)
    return oracle.sampled(lambda p: np.exp(-(p**2).sum(axis=-1) / (2 * width**2)), shape, oracle.centred(shape, axes))


def view(volume, size=12, towards="anterior", projection="orthographic") -> ig.Camera:
    return ig.Camera.looking(towards, volume, size, projection=projection)


def premultiplied(image: ig.Image) -> np.ndarray:
    out = image.array.astype(np.float64)
    out[..., :3] *= out[..., 3:]
    return out


def picture(volume, tf, camera, **options) -> np.ndarray:
    """Premultiplied, over nothing, unlit unless it is asked for."""
    return premultiplied(ig.render(volume, tf, camera, **{"lit": False, "background": CLEAR, **options}))


def lengths(volume, camera) -> np.ndarray:
    w, h = camera.size
    out = np.zeros((h, w))
    for y in range(h):
        for x in range(w):
            *_, near, far, mm = oracle.path(volume, camera, x + 0.5, y + 0.5)
            out[y, x] = max(far - near, 0.0) * mm
    return out


def twin(volume, tf, camera, step, classify="post") -> np.ndarray:
    w, h = camera.size
    rows = [
        [oracle.emission_absorption(volume, tf, camera, x + 0.5, y + 0.5, step, classify) for x in range(w)] for y in range(h)
    ]
    return np.array(rows)


class TestClosedForms:
    @pytest.mark.parametrize("lit", [False, True])
    @pytest.mark.parametrize("projection", ["orthographic", "perspective"])
    @pytest.mark.parametrize("step", [0.3, 0.5, 0.7, 3.0, 16.0])
    @pytest.mark.parametrize("classify", CLASSIFY)
    def test_constant_medium(self, classify, step, projection, lit):
        """alpha = 1 - (1 - a)^(length / reference) whatever the step, its last part included; nothing to light in it."""
        volume = ig.Volume.from_array(np.full((9, 13, 11), 5, dtype=np.uint8), (1.0, 1.5, 0.8))
        tf = function((5.0, (0.9, 0.5, 0.2), 0.25), reference_length=2.0)
        camera = view(volume, 10, (0.3, 1, 0.4), projection)
        got = picture(volume, tf, camera, classify=classify, step=step, lit=lit)
        alpha = 1 - 0.75 ** (lengths(volume, camera) / 2.0)
        # Rounding of at most a hundred float32 sums, and of what little of a grazing ray counts as none.
        np.testing.assert_allclose(got[..., 3], alpha, atol=1e-5)
        np.testing.assert_allclose(got[..., :3], alpha[..., None] * [0.9, 0.5, 0.2], atol=1e-5)

    @pytest.mark.parametrize("classify", CLASSIFY)
    def test_opaque_slab(self, classify):
        values = np.zeros((9, 17, 9), dtype=np.float32)
        values[:, 4:9] = 1.0
        values[:, 13:] = 0.5
        volume = ig.Volume.from_array(values)
        tf = function((0.0, "#00ff00", 0.0), (0.9, "#ff0000", 0.0), (0.9, "#ff0000", 1.0))
        got = picture(volume, tf, view(volume, 8, (0.1, 1, 0.2)), classify=classify)[3:5, 2:6]
        np.testing.assert_allclose(got, np.broadcast_to([1, 0, 0, 1], got.shape), atol=1e-6)

    @pytest.mark.parametrize("lit", [False, True])
    @pytest.mark.parametrize("classify", CLASSIFY)
    def test_vacuum(self, classify, lit):
        volume = blob(12)
        tf = function((0.0, "#ffffff", 0.0), (2.0, "#ffffff", 0.0))
        got = ig.render(volume, tf, view(volume), classify=classify, lit=lit, background=(0.2, 0.4, 0.6, 1.0)).array
        np.testing.assert_allclose(got, np.broadcast_to([0.2, 0.4, 0.6, 1.0], got.shape), atol=1e-7)

    @pytest.mark.parametrize(("classify", "tolerance"), [("pre", 0.02), ("post", 1e-5), ("preintegrated", 2e-3)])
    def test_two_layers(self, classify, tolerance):
        """The border lies between two voxels and two samples, 7.5 mm behind the front.

        Exact for "post"; "pre" mixes the two opacities over a voxel; that of "preintegrated" is the table's entry.
        """
        values = np.zeros((9, 17, 9), dtype=np.float32)
        values[:, :9] = 1.0
        volume = ig.Volume.from_array(values)
        front, back = np.array([0.2, 0.4, 0.9]), np.array([0.9, 0.6, 0.1])
        tf = function((0.0, front, 0.08), (0.5, front, 0.08), (0.5, back, 0.2), (1.0, back, 0.2))
        got = picture(volume, tf, ig.Camera.looking("anterior", volume, 6, margin=0), classify=classify)[3, 3]
        a, b = 1 - 0.92**7.5, 1 - 0.8**8.5
        np.testing.assert_allclose(got, [*(a * front + (1 - a) * b * back), a + (1 - a) * b], atol=tolerance)

    def test_the_last_sample_stands_for_what_is_left(self):
        """A ray of 10 mm in steps of 3 has three whole steps and a third of one."""
        volume = ig.Volume.from_array(np.ones((3, 11, 3), dtype=np.float32))
        tf = function((1.0, "#ffffff", 0.1))
        got = picture(volume, tf, ig.Camera.looking("anterior", volume, 3), step=3.0)[1, 1, 3]
        assert got == pytest.approx(1 - 0.9**10, abs=1e-6)
        assert abs(got - (1 - 0.9**12)) > 0.05


class TestTwin:
    @pytest.mark.parametrize("projection", ["orthographic", "perspective"])
    @pytest.mark.parametrize("classify", ["pre", "post"])
    def test_kernel_and_twin_agree(self, classify, projection):
        volume = blob(14, 3.0, np.diag([1.0, 1.3, 0.8]))
        tf = function(*STEEP)
        camera = view(volume, 9, (0.5, 1, 0.7), projection)
        got = picture(volume, tf, camera, classify=classify)
        want = twin(volume, tf, camera, 0.5 * 0.8, classify)
        # A value is looked up half an entry off at most; opacity rises by 2 per unit, and some 40 samples of 0.4 mm add up.
        np.testing.assert_allclose(got, want, atol=40 * 0.4 * 2 * ENTRY / 2)

    @pytest.mark.parametrize("classify", CLASSIFY)
    def test_linear_ramp_against_the_integral(self, classify):
        """Opacity proportional to the value; the integral in steps of 0.01 mm.

        Voxels' colours times opacity bend between voxels, which "pre" does not see at any step.
        """
        volume = blob(20, 4.0)
        tf = function((0.0, "#4060c0", 0.0), (1.0, "#f0c080", 0.3))
        camera = view(volume, 7, (0.2, 1, 0.3))
        got = picture(volume, tf, camera, classify=classify, step=0.25)
        tolerance = {"pre": 5e-3, "post": 2e-4, "preintegrated": 1e-3}[classify]
        np.testing.assert_allclose(got, twin(volume, tf, camera, 0.01), atol=tolerance)

    @pytest.mark.parametrize("points", [((0.0, "#4060c0", 0.0), (1.0, "#f0c080", 0.3)), STEEP], ids=["smooth", "steep"])
    def test_finer_steps_converge(self, points):
        """Nearly in second order, the midpoint rule's; kinks between voxels and the table's entries spoil the rest."""
        volume, tf = blob(24, 5.0), function(*points)
        camera = view(volume, 7, (0.2, 1, 0.3))
        want, steps = twin(volume, tf, camera, 0.01), [4.0, 2.0, 1.0, 0.5]
        off = np.array([np.abs(picture(volume, tf, camera, step=s) - want).mean(axis=(0, 1)) for s in steps])
        order = [np.polyfit(np.log(steps), np.log(off[:, c]), 1)[0] for c in range(4)]
        assert min(order) > 1.5

    def test_an_early_end_costs_no_more_than_what_was_left(self):
        volume = blob(20, 5.0)
        tf = function((0.0, "#000000", 0.0), (0.5, "#ff8000", 0.6), (1.0, "#ffffff", 0.9))
        camera = view(volume, 9)
        got, want = picture(volume, tf, camera), twin(volume, tf, camera, 0.5)
        assert (want[..., 3] > 0.999).any()
        assert np.abs(got - want).max() < OPAQUE + 40 * 0.5 * 2 * ENTRY / 2


class TestClassification:
    @pytest.mark.parametrize(("step", "early", "late"), [(1.0, 1.2, 2.5), (0.25, 2.5, 1.1)])
    def test_high_frequencies_want_later_classification(self, step, early, late):
        """Against 64 samples per voxel: pre is worse than post, post than preintegrated.

        Finer steps help post and not pre; preintegrated is as good as its table from the first. In a translucent medium:
        where few samples decide, and they are too few, the blur of pre is as good as chance.
        """
        volume, tf = blob(24, 6.0), sawtooth(16, 0.1)
        camera = view(volume, 32, (0.3, 1, 0.2))
        want = picture(volume, tf, camera, step=1 / 64)
        off = {c: np.sqrt(((picture(volume, tf, camera, classify=c, step=step) - want) ** 2).mean()) for c in CLASSIFY}
        assert off["pre"] > early * off["post"]
        assert off["post"] > late * off["preintegrated"]

    def test_where_opacity_is_linear_in_the_value_all_agree(self):
        """In short steps, and one colour."""
        volume, tf = blob(20, 5.0), function((0.0, "#808080", 0.0), (1.0, "#808080", 0.1))
        camera = view(volume, 12, (0.3, 1, 0.2))
        pre, post, both = (picture(volume, tf, camera, classify=c, step=0.1) for c in CLASSIFY)
        np.testing.assert_allclose(pre, post, atol=2e-3)
        np.testing.assert_allclose(both, post, atol=2e-3)

    @pytest.mark.parametrize("classify", ["post", "preintegrated"])
    def test_an_opaque_value_hides_what_is_behind(self, classify):
        """A shell thinner than a step is missed by samples and found by pairs of values."""
        volume = blob(24, 5.0)
        tf = function((0.49, "#ff0000", 0.0), (0.495, "#ff0000", 1.0), (0.505, "#ff0000", 1.0), (0.51, "#ff0000", 0.0))
        alpha = picture(volume, tf, view(volume, 24), classify=classify, step=2.0)[8:16, 8:16, 3]
        assert (alpha.min() > 0.5) == (classify == "preintegrated")


class TestGrids:
    @pytest.mark.parametrize("classify", ["post", "preintegrated"])
    def test_a_linear_field_looks_the_same_on_any_grid_of_a_box(self, classify):
        """Trilinear interpolation is exact there, so the grids differ by rounding and by entries of the table."""

        def made(shape):
            axes = np.diag([16 / (n - 1) for n in shape[::-1]])
            return oracle.sampled(lambda p: p @ [0.02, 0.03, 0.025] + 0.6, shape, oracle.centred(shape, axes))

        even, uneven = made((17, 17, 17)), made((9, 33, 12))
        tf, camera = function((0.0, "#203080", 0.0), (1.2, "#ffd0a0", 0.2)), view(even, 11, (0.4, 1, 0.3))
        a = picture(even, tf, camera, classify=classify, step=0.5)
        b = picture(uneven, tf, camera, classify=classify, step=1.0)
        np.testing.assert_allclose(a, b, atol=2e-3)

    @pytest.mark.parametrize("lit", [False, True])
    def test_a_turned_grid_and_camera_are_the_same_picture(self, lit):
        turn = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]
        turn *= np.linalg.det(turn)
        volume, tf = blob(16, 4.0), function(*STEEP)
        camera = view(volume, 12, (0.4, 1, 0.3), "perspective")
        matrix = np.eye(4)
        matrix[:3, :3] = turn
        turned = ig.Volume(volume.array, matrix @ volume.world_from_index)
        moved = ig.Camera(turn @ camera.eye, turn @ camera.forward, turn @ camera.up, camera.size, camera.pixel, "perspective")
        a, b = picture(volume, tf, camera, lit=lit), picture(turned, tf, moved, lit=lit)
        # Rounding may move a value to the next entry: 40 samples of half a mm, slope 2.
        np.testing.assert_allclose(a, b, atol=40 * 0.5 * 2 * ENTRY)

    @pytest.mark.parametrize("lit", [False, True])
    def test_a_blob_looks_the_same_on_uneven_and_oblique_grids(self, lit):
        c, s = math.cos(0.5), math.sin(0.5)
        oblique = np.array([[c, -s, 0.0], [s, c, 0.1], [0.0, 0.0, 1.0]])
        tf = function((0.1, "#203080", 0.0), (0.6, "#ffd0a0", 0.4))
        even = blob(40, 4.0)
        camera = view(even, 24, (0.4, 1, 0.3))
        want = picture(even, tf, camera, lit=lit, step=0.5, fade=0.02)
        for volume in (
            blob(width=4.0, axes=np.diag([0.8, 1.25, 1.0]), shape=(40, 34, 50)),
            blob(width=4.0, axes=oblique, shape=(40, 40, 40)),
        ):
            got = picture(volume, tf, camera, lit=lit, step=0.5 / volume.spacing.min(), fade=0.02)
            # Trilinear values are off by up to h²/8 times three second derivatives of 1/16; light doubles what that does.
            assert np.abs(got - want).max() < 0.06
            assert np.abs(got - want).mean() < 0.004


class TestSkipping:
    def scene(self):
        z, y, x = np.indices((40, 44, 37))
        values = np.zeros(z.shape, dtype=np.float32)
        for c in ((8, 9, 7), (30, 31, 28), (12, 35, 20)):
            values += np.exp(-((z - c[0]) ** 2 + (y - c[1]) ** 2 + (x - c[2]) ** 2) / 18.0)
        values[values < 0.01] = 0
        return ig.Volume.from_array(values)

    @pytest.mark.parametrize("lit", [False, True])
    @pytest.mark.parametrize("classify", CLASSIFY)
    def test_skipping_empty_blocks_changes_nothing(self, classify, lit, monkeypatch):
        volume = self.scene()
        tf = function((0.0, "#000000", 0.0), (0.05, "#a04030", 0.0), (0.5, "#f0e0c0", 0.5), (0.8, "#ffffff", 0.0))
        camera = view(volume, 40, (0.5, 1, 0.3), "perspective")
        skipped = picture(volume, tf, camera, classify=classify, lit=lit)
        asked = []

        def all_visible(self, low, high):
            asked.append(low.size)
            return np.ones(np.shape(low), dtype=bool)

        monkeypatch.setattr(ig.TransferFunction, "visible", all_visible)
        # Blocks that show nothing no longer lengthen packets, whose sums are rounded otherwise.
        np.testing.assert_allclose(skipped, picture(volume, tf, camera, classify=classify, lit=lit), rtol=0, atol=1e-6)
        assert asked == [5 * 6 * 5]
        assert skipped.max() > 0.2

    @pytest.mark.parametrize("classify", CLASSIFY)
    def test_bytes_are_the_same_on_any_number_of_threads(self, classify, monkeypatch):
        volume, camera = self.scene(), view(self.scene(), 90)
        tf = function(*STEEP)
        shots = []
        for threads in "123":
            monkeypatch.setenv("INTAGLIO_THREADS", threads)
            shots.append(ig.render(volume, tf, camera, classify=classify).array.tobytes())
        assert shots[0] == shots[1] == shots[2]


def wall(slope: float = 0.05, towards=(0.0, 1.0, 0.0)) -> ig.Volume:
    """Values rise away from a viewer in front of it, by slope per mm, along -towards; 0.5 in the middle."""
    direction = -np.asarray(towards) / np.linalg.norm(towards)
    return oracle.sampled(lambda p: p @ direction * slope + 0.5, (25, 25, 25), oracle.centred((25, 25, 25)))


MATERIAL = ig.Material(ambient=0.2, diffuse=0.6, specular=0.3, shininess=12.0)


class TestLight:
    """One sample is opaque and all that is seen: where the value first reaches 0.5."""

    OPAQUE = function((0.5, (0.6, 0.4, 0.3), 0.0), (0.5, (0.6, 0.4, 0.3), 1.0))

    def lit(self, volume, camera, lights, material=MATERIAL, **options):
        image = ig.render(volume, self.OPAQUE, camera, lights=lights, material=material, step=0.05, fade=1e-3, **options)
        w, h = camera.size
        return image.array[h // 2, w // 2, :3]

    def expected(self, volume, normal, camera, lights, material=MATERIAL):
        w, h = camera.size
        origin, direction = (a[0] for a in oracle.rays(camera, [w // 2 + 0.5], [h // 2 + 0.5]))
        matrix = np.linalg.inv(volume.world_from_index)

        def value(t):
            index = matrix[:3, :3] @ (origin + t * direction) + matrix[:3, 3]
            return oracle.trilinear(volume.samples, index[None])[0]

        *_, near, far, _ = oracle.path(volume, camera, w // 2 + 0.5, h // 2 + 0.5)
        t = np.linspace(near, far, 4001)
        hit = t[np.argmax([value(s) >= 0.5 for s in t])]
        ambient, diffuse, specular = oracle.blinn_phong(origin + hit * direction, normal, camera, lights, material)
        return np.clip(np.array([0.6, 0.4, 0.3]) * (ambient + diffuse) + specular, 0, 1)

    @pytest.mark.parametrize("projection", ["orthographic", "perspective"])
    @pytest.mark.parametrize(
        ("light", "tolerance"),
        [
            (ig.Light(), 2e-3),
            (ig.Light(direction=(0.3, 0.8, 1.0), frame="world", intensity=0.7), 2e-3),
            # The first opaque sample lies up to half a step behind the surface.
            (ig.Light(kind="point", position=(20.0, 50.0, 15.0), frame="world"), 3e-3),
            (ig.Light(kind="spot", position=(20.0, 50.0, 15.0), direction=(0.4, 1.0, 0.3), frame="world", cone=25.0), 3e-3),
            (ig.Light(kind="spot", position=(20.0, 50.0, 15.0), direction=(-1.0, 1.0, 0.3), frame="world", cone=25.0), 3e-3),
        ],
        ids=["camera", "world", "point", "spot", "spot-aside"],
    )
    def test_one_light(self, light, tolerance, projection):
        towards = np.array([0.3, 0.9, 0.4]) / np.linalg.norm([0.3, 0.9, 0.4])
        volume = wall(towards=towards)
        camera = view(volume, 9, "anterior", projection)
        got = self.lit(volume, camera, (light,))
        np.testing.assert_allclose(got, self.expected(volume, towards, camera, (light,)), atol=tolerance)

    def test_lights_add_up(self):
        volume = wall()
        camera = view(volume, 9)
        lights = (ig.Light(direction=(1, 0, 1), intensity=0.4), ig.Light(direction=(-1, 1, 1), intensity=0.3))
        want = self.expected(volume, np.array([0.0, 1.0, 0.0]), camera, lights)
        np.testing.assert_allclose(self.lit(volume, camera, lights), want, atol=2e-3)

    def test_without_lights_there_is_ambient(self):
        volume = wall()
        np.testing.assert_allclose(self.lit(volume, view(volume, 9), ()), 0.2 * np.array([0.6, 0.4, 0.3]), atol=1e-5)

    def test_uneven_and_oblique_grids_have_normals_in_the_world(self):
        towards = np.array([0.3, 0.9, 0.4]) / np.linalg.norm([0.3, 0.9, 0.4])
        turn = np.array([[math.cos(0.4), -math.sin(0.4), 0.0], [math.sin(0.4), math.cos(0.4), 0.0], [0.0, 0.0, 1.0]])
        matrix = oracle.centred((21, 25, 23), turn @ np.diag([0.5, 1.0, 2.0]))
        volume = oracle.sampled(lambda p: 0.5 - 0.05 * p @ towards, (21, 25, 23), matrix)
        camera = view(volume, 9)
        want = self.expected(volume, towards, camera, (ig.Light(),))
        np.testing.assert_allclose(self.lit(volume, camera, (ig.Light(),)), want, atol=2e-3)

    def test_both_sides_are_lit_if_asked_for(self):
        """Values fall away from the viewer: the first sample is opaque and its normal points away."""
        volume = wall(-0.05)
        camera = view(volume, 9)
        lights = (ig.Light(direction=(0.5, 0.5, 1.0)),)
        one, two = (ig.Material(ambient=0.2, diffuse=0.6, specular=0.3, shininess=12.0, two_sided=t) for t in (False, True))
        np.testing.assert_allclose(self.lit(volume, camera, lights, one), 0.2 * np.array([0.6, 0.4, 0.3]), atol=1e-5)
        want = self.expected(wall(), np.array([0.0, 1.0, 0.0]), camera, lights, two)
        np.testing.assert_allclose(self.lit(volume, camera, lights, two), want, atol=2e-3)

    def test_light_fades_where_there_is_no_slope(self):
        """Below half of `fade` a sample has its own colour, above it all light, between them a smooth step."""
        volume, own = wall(), np.array([0.6, 0.4, 0.3])
        camera = view(volume, 9)
        shot = {
            part: ig.render(volume, self.OPAQUE, camera, material=MATERIAL, step=0.05, fade=0.05 / part).array[4, 4, :3]
            for part in (0.25, 0.5, 0.75, 1.0, 4.0)
        }
        np.testing.assert_allclose(shot[0.25], own, atol=1e-5)
        np.testing.assert_allclose(shot[0.5], own, atol=1e-4)
        np.testing.assert_allclose(shot[1.0], shot[4.0], atol=1e-4)
        assert np.abs(shot[4.0] - own).max() > 0.1
        np.testing.assert_allclose(shot[0.75], (own + shot[4.0]) / 2, atol=1e-3)


def test_a_picture_lies_over_its_background():
    volume, tf = blob(), function((0.2, "#ff0000", 0.0), (1.0, "#ffff00", 0.3))
    camera = view(volume, 20)
    front = picture(volume, tf, camera)
    for red, green, blue, alpha in ((0.2, 0.5, 0.9, 1.0), (0.2, 0.5, 0.9, 0.4), CLEAR):
        got = ig.render(volume, tf, camera, lit=False, background=(red, green, blue, alpha)).array
        want = front + (1 - front[..., 3:]) * np.array([red * alpha, green * alpha, blue * alpha, alpha])
        np.testing.assert_allclose(got[..., 3], want[..., 3], atol=1e-6)
        np.testing.assert_allclose(got[..., :3] * got[..., 3:], want[..., :3], atol=1e-5)


@pytest.mark.parametrize("mode", ["emission-absorption", "mip", "minip", "average", "isosurface"])
@pytest.mark.parametrize(
    "dtype", ["bool", "int8", "uint8", "int16", "uint16", "int32", "uint32", "float16", "float32", "float64"]
)
def test_every_type_of_voxel(dtype, mode):
    """The same half of a box in each type: 0 and 1 of a bool, 0 and 100 of the others."""
    values = np.zeros((10, 11, 12), dtype=dtype)
    values[:, 5:] = 1 if dtype == "bool" else 100
    volume = ig.Volume.from_array(values)
    top = float(values.max())
    tf = function((0.0, "#000000", 0.0), (top, "#ff8000", 0.5))
    got = ig.render(volume, tf, view(volume, 8), mode=mode, surfaces=[(top / 2, (1.0, 0.5, 0.0), 0.5)]).array
    same = ig.Volume.from_array((values > 0).astype(np.float32) * 100)
    tf = function((0.0, "#000000", 0.0), (100.0, "#ff8000", 0.5))
    want = ig.render(same, tf, view(volume, 8), mode=mode, surfaces=[(50.0, (1.0, 0.5, 0.0), 0.5)]).array
    np.testing.assert_allclose(got, want, atol=1e-4)
    assert want[4, 4].min() < 0.9 or mode == "minip"


@settings(max_examples=60, deadline=None)
@given(data=st.data())
def test_any_small_volume_makes_a_picture(data):
    shape = data.draw(st.tuples(*[st.integers(2, 11)] * 3))
    seed = data.draw(st.integers(0, 2**31))
    dtype = data.draw(st.sampled_from(["bool", "uint8", "int16", "float32"]))
    rng = np.random.default_rng(seed)
    values = rng.integers(0, 2, shape) * 50 if data.draw(st.booleans()) else rng.normal(size=shape) * 100
    with np.errstate(invalid="ignore"):
        volume = ig.Volume.from_array(values.astype(dtype), data.draw(st.tuples(*[st.floats(0.2, 5.0)] * 3)))
    number = st.floats(-300, 300, allow_nan=False)
    points = sorted(data.draw(st.lists(number, min_size=1, max_size=5, unique=True)))
    unit = st.floats(0.0, 1.0)
    tf = function(*[(v, data.draw(st.tuples(unit, unit, unit)), data.draw(unit)) for v in points])
    towards = data.draw(st.tuples(*[st.floats(-1, 1)] * 3).filter(lambda v: np.linalg.norm(v) > 0.1))
    camera = view(volume, 7, towards, data.draw(st.sampled_from(["orthographic", "perspective"])))
    image = ig.render(
        volume, tf, camera, classify=data.draw(st.sampled_from(CLASSIFY)), step=data.draw(st.floats(0.2, 16.0)),
        lit=data.draw(st.booleans()), background=(*data.draw(st.tuples(unit, unit, unit)), data.draw(unit)),
    )  # fmt: skip
    assert image.array.dtype == np.float32
    assert np.isfinite(image.array).all()
    assert image.array.min() >= 0
    assert image.array.max() <= 1


NAN = float("nan")
RAMP = function((0.0, "#000000", 0.0), (1.0, "#ffffff", 1.0))


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"mode": "xray"}, "mode must be one of emission-absorption, mip, minip, average, isosurface, not 'xray'"),
        ({"classify": "late"}, "classify must be one of pre, post, preintegrated, not 'late'"),
        ({"transfer_function": None}, "transfer_function must be given for emission-absorption"),
        ({"mode": "isosurface"}, "surfaces must be given for mode"),
        ({"mode": "isosurface", "surfaces": [(2.0, (1, 1, 1), 1)]}, "iso must be within the volume's values, above .* not 2.0"),
        ({"mode": "isosurface", "surfaces": [(NAN, (1, 1, 1), 1)]}, "iso must be within the volume's values, .* not nan"),
        ({"mode": "isosurface", "surfaces": [(0.5, (1, 1, 2), 1)]}, "colour and opacity of a surface must be within 0..1"),
        ({"mode": "isosurface", "surfaces": [(0.5, (1, 1, 1), -1)]}, "colour and opacity of a surface must be within 0..1"),
        ({"step": 0}, "step must be between 0.01 and 16 voxels, not 0"),
        ({"step": -1.0}, "step must be between"),
        ({"step": NAN}, "step must be between 0.01 and 16 voxels, not nan"),
        ({"background": (1, 1, 1)}, "background must be four numbers within 0..1"),
        ({"background": (1, 1, 1, 1.5)}, "background must be four numbers within 0..1"),
        ({"background": (NAN, 1, 1, 1)}, "background must be four numbers within 0..1"),
        ({"fade": NAN}, "fade must be a slope of 0 or more, not nan"),
        ({"fade": -1.0}, "fade must be a slope of 0 or more, not -1.0"),
    ],
)
def test_what_cannot_be_rendered_is_said(options, message):
    volume = blob(8, 2.0)
    options = {"transfer_function": RAMP, **options}
    with pytest.raises(InputError, match=message):
        ig.render(volume, options.pop("transfer_function"), view(volume), **options)


def test_voxels_must_be_finite():
    values = np.ones((4, 4, 4), dtype=np.float32)
    values[1, 1, 1] = np.nan
    volume = ig.Volume.from_array(values, name="scan")
    with pytest.raises(InputError, match="scan: voxels are NaN or infinite"):
        ig.render(volume, RAMP, view(volume))
