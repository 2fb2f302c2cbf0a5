"""Several surfaces of one plate: where they are, what shows through what, and what a transfer function makes of a scan."""

from __future__ import annotations

import math
from dataclasses import replace
from functools import cache
from itertools import pairwise

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st

from intaglio import (
    Camera,
    Drawing,
    InputError,
    Part,
    TransferFunction,
    Volume,
    hatch,
    illustrate,
    isosurface,
    parts_camera,
    parts_of,
    read_volume,
    style,
    surface_camera,
)
from intaglio.parts import LIGHTEST, faded, ink_colour
from intaglio.solid.bodies import between, has_matter
from intaglio.solid.labels import label_distance

SHAPE = (56, 60, 64)
FINE = style("engraving", crosshatch=0, contour_shortest=0)


@cache
def nested() -> Volume:
    """0 outside, 100 within 24 mm, 200 within 12 mm."""
    return oracle.shells((24.0, 12.0), (0.0, 100.0, 200.0), SHAPE)


@cache
def hollow() -> Volume:
    """A shell of 300, 16 to 24 mm from the centre, around matter of 150; 0 outside."""
    return oracle.shells((24.0, 16.0), (0.0, 300.0, 150.0), SHAPE)


def camera(view="anterior", size=480) -> Camera:
    return Camera.looking(view, nested(), (size, size))


def points(drawing: Drawing, name: str) -> np.ndarray:
    """Of all the strokes of layers that begin with a name, in mm."""
    return np.concatenate([layer.strokes.points for layer in drawing.layers if layer.name.startswith(name)])


def length(drawing: Drawing, name: str = "") -> float:
    """In mm of the strokes of layers that begin with a name."""
    found = [
        np.linalg.norm(np.diff(s.points, axis=0), axis=1).sum()
        for la in drawing.layers
        if la.name.startswith(name)
        for s in la.strokes
    ]
    return float(sum(found))


def same(one: Drawing, other: Drawing) -> bool:
    return one._repr_svg_() == other._repr_svg_()


def radius_on_paper(drawing: Drawing, view: Camera, radius: float) -> tuple[np.ndarray, float]:
    """Centre of the picture and the radius of a ball there, in mm on paper."""
    mm = drawing.width_mm / view.size[0]
    return view.project([[0.0, 0.0, 0.0]])[0, :2] * mm, radius / view.pixel * mm


class TestBodies:
    @pytest.mark.parametrize(("low", "high", "radius"), [(-math.inf, 225, 16.0), (100, 225, 16.0)])
    @pytest.mark.parametrize("view", ["anterior", "left-superior"])
    def test_the_inner_wall_of_a_hollow_is_found_and_its_normals_point_out(self, low, high, radius, view):
        """From either side: cavities, and matter within denser matter; not the film around the shell."""
        volume = hollow() if low > -math.inf else oracle.shells((24.0, 16.0), (0.0, 450.0, 0.0), SHAPE)
        body = between(volume, low, high)
        gb = isosurface(body, 0.0, camera(view), inside="below")
        view_ = camera(view)
        y, x = np.nonzero(gb.mask)
        origin, direction = oracle.rays(view_, x + 0.5, y + 0.5)
        place = origin + gb.depth[gb.mask][:, None] * direction
        assert np.linalg.norm(place, axis=1) == pytest.approx(radius, abs=0.25)
        outwards = (gb.normal[gb.mask] * place).sum(axis=1) / np.linalg.norm(place, axis=1)
        assert outwards.min() > 0.97
        assert gb.mask.sum() * view_.pixel**2 == pytest.approx(math.pi * radius**2, rel=0.03)

    def test_matter_around_a_hollow_is_found_from_outside(self):
        gb = isosurface(between(hollow(), 225, 400), 0.0, camera(), inside="below")
        # Where the shell, in passing to 0 about 24 mm from the centre, has come down to 225.
        assert gb.mask.sum() * camera().pixel ** 2 == pytest.approx(math.pi * (24 - math.log(3) / 4) ** 2, rel=0.015)

    def test_a_film_is_no_matter(self):
        """Passing from 0 to 200, values between are met, but nothing is made of them."""
        assert not has_matter(oracle.shells((20.0,), (0.0, 200.0), SHAPE), 60, 140)
        with pytest.raises(InputError, match=r"no matter three voxels thick has values from 60 to 140"):
            between(oracle.shells((20.0,), (0.0, 200.0), SHAPE), 60, 140)

    def test_what_reaches_the_border_is_no_cavity(self):
        with pytest.raises(InputError, match=r"no cavity has values from -inf to 50"):
            between(nested(), -math.inf, 50)

    @pytest.mark.parametrize(("low", "high"), [(3, 1), (1, 1), (math.nan, 1), (-math.inf, -math.inf)])
    def test_ranges_run_upwards(self, low, high):
        with pytest.raises(InputError, match="a range must run from a smaller to a larger value"):
            between(nested(), low, high)

    @pytest.mark.parametrize("dtype", ["uint8", "int16", "float32"])
    @pytest.mark.parametrize("axes", [np.diag([3.0, 3.0, 3.0]), np.diag([-2.0, -2.0, 4.0])], ids=["cubes", "LPS"])
    def test_labels_have_no_steps(self, dtype, axes):
        """A ball of labels, in voxels of some mm: normals and curvatures are nearly those of the ball, where it stands."""
        shape, centre, radius = (40, 44, 48), np.array([7.0, -5.0, 3.0]), 30.0
        matrix = oracle.centred(shape, axes)
        z, y, x = np.indices(shape, dtype=np.float64)
        p = np.stack([x, y, z], axis=-1) @ matrix[:3, :3].T + matrix[:3, 3] - centre
        labels = np.where(np.linalg.norm(p, axis=-1) < radius, 5, 0)
        if dtype == "float32":
            with pytest.raises(InputError, match="labels must be whole numbers"):
                label_distance(Volume(labels.astype(dtype), matrix), (5,))
            return
        body = label_distance(Volume(labels.astype(dtype), matrix), (5,))
        view = Camera.looking("anterior", centre + radius * np.array([[-1, -1, -1], [1, 1, 1]]), 120)
        gb = isosurface(body, 0.0, view, inside="below")
        y, x = np.nonzero(gb.mask & (gb.facing > 0.4))
        origin, direction = oracle.rays(view, x + 0.5, y + 0.5)
        place = origin + gb.depth[y, x][:, None] * direction - centre
        distance = np.linalg.norm(place, axis=1)
        assert distance == pytest.approx(radius, abs=1.0)
        turn = np.degrees(np.arccos(np.clip((gb.normal[y, x] * place).sum(axis=1) / distance, -1, 1)))
        assert turn.mean() < 2.0
        assert turn.max() < 8.0
        assert gb.curvature[y, x].mean() == pytest.approx(1 / radius, rel=0.05)

    def test_thin_parts_and_gaps_of_labels_stay(self):
        labels = np.zeros((24, 24, 60), dtype=np.uint8)
        labels[11:13, 11:13, 4:56] = 1  # a rod of two voxels
        labels[:, :, 30:32] = 0  # and a gap of two
        body = label_distance(Volume.from_array(labels, (3.0, 3.0, 3.0)), (1,))
        gb = isosurface(body, 0.0, Camera.looking("anterior", body, 200), inside="below")
        rows = gb.mask.any(axis=0)
        runs = np.flatnonzero(np.diff(rows.astype(int)) == 1)
        assert len(runs) == 2
        assert rows.sum() == pytest.approx(50 * 3 / gb.camera.pixel, rel=0.06)

    def test_labels_that_are_not_there(self):
        labels = Volume.from_array(np.pad(np.full((4, 4, 4), 3, np.uint8), 3), name="organs")
        with pytest.raises(InputError, match=r"organs: label must be one of 3, not 4"):
            label_distance(labels, (3, 4))
        with pytest.raises(InputError, match="cover every voxel"):
            label_distance(Volume.from_array(np.ones((4, 4, 4), np.uint8)), (1,))


class TestPart:
    @pytest.mark.parametrize(
        ("wrong", "words"),
        [
            ({"opacity": 0.0}, "opacity of a part must be above 0, up to 1, not 0.0"),
            ({"opacity": 1.5}, "opacity of a part must be"),
            ({"iso": 1.0, "label": 2}, "an iso or a label, not both"),
            ({"colour": "red"}, "colour must be"),
            ({"style": "oil"}, "style must be one of"),
        ],
    )
    def test_is_checked(self, wrong, words):
        with pytest.raises(InputError, match=words):
            Part(volume=nested(), **wrong)

    def test_the_more_transparent_the_sparser_and_fainter(self):
        styles = [Part(volume=nested(), iso=50, style="pencil", opacity=a).hatching for a in (1.0, 0.7, 0.4, 0.1)]
        assert styles[0] == style("pencil")
        assert all(a.separation < b.separation and a.thickest > b.thickest for a, b in pairwise(styles))
        drawn = [illustrate([Part(volume=nested(), iso=50, opacity=a)], camera=camera()) for a in (1.0, 0.5, 0.2)]
        ink = [1 - d.image(50).array[..., :3].mean() for d in drawn]
        assert ink[0] > ink[1] > ink[2]

    def test_opacity_fades_every_layer(self):
        full, half = (
            illustrate([Part(volume=nested(), iso=50, opacity=a, lines_only=True)], camera=camera()) for a in (1.0, 0.25)
        )
        assert half.layers[-1].strokes.opacity == pytest.approx(0.5 * full.layers[-1].strokes.opacity)
        assert faded(full.layers[-1], 1.0) is full.layers[-1]


class TestIllustrate:
    def test_one_part_is_a_plain_hatching(self):
        view = surface_camera(nested(), 50.0, "anterior", 480)
        one = illustrate([Part(volume=nested(), iso=50.0)], camera=view, title="volume, iso 50")
        assert same(one, hatch(nested(), iso=50.0, camera=view))

    def test_an_inner_ball_is_seen_through_a_veil_and_stays_within_its_outline(self):
        view = camera()
        parts = [
            Part(volume=nested(), iso=150.0, style=FINE, name="core"),
            Part(volume=nested(), iso=50.0, style=FINE, opacity=0.4, name="skin"),
        ]
        drawing = illustrate(parts, camera=view, width_mm=60)
        alone = hatch(nested(), iso=150.0, camera=view, style=FINE, width_mm=60)
        centre, inner = radius_on_paper(drawing, view, 12.0)
        _, outer = radius_on_paper(drawing, view, 24.0)
        assert np.linalg.norm(points(drawing, "core") - centre, axis=1).max() < inner + 0.2
        assert length(drawing, "core") == pytest.approx(length(alone), rel=1e-3)
        far = np.linalg.norm(points(drawing, "skin: contour") - centre, axis=1)
        assert far == pytest.approx(outer, abs=0.3)
        assert all(layer.name.startswith(("core: ", "skin: ")) for layer in drawing.layers)

    def test_an_opaque_skin_hides_the_core(self):
        parts = [Part(volume=nested(), iso=150.0, name="core"), Part(volume=nested(), iso=50.0, name="skin")]
        drawing = illustrate(parts, camera=camera())
        assert length(drawing, "core") == 0
        assert length(drawing, "skin") > 0

    def test_what_stands_in_front_hides_what_is_behind_it_alone(self):
        """Two balls, one half before the other: strokes of the far one end a halo before the near one's outline."""
        near = oracle.sampled(oracle.Sphere(14.0, (-8.0, 20.0, 0.0)).field, (64, 80, 80))
        far = oracle.sampled(oracle.Sphere(14.0, (8.0, -20.0, 0.0)).field, (64, 80, 80))
        view = Camera.looking("anterior", near, (300, 240))
        parts = [Part(volume=far, iso=0.0, style=FINE, name="far"), Part(volume=near, iso=0.0, style=FINE, name="near")]
        plain, haloed = (illustrate(parts, camera=view, width_mm=75, halo=gap) for gap in (0.0, 1.0))
        mm = 75 / 300
        centre = view.project([[-8.0, 20.0, 0.0]])[0, :2] * mm
        radius = 14.0 / view.pixel * mm
        gap = [np.linalg.norm(points(d, "far") - centre, axis=1).min() - radius for d in (plain, haloed)]
        assert gap[0] == pytest.approx(0.0, abs=0.15)
        widest = 0.5 * max(layer.strokes.width.max() for layer in plain.layers if layer.name == "near: contour")
        assert 0.85 < gap[1] < 1.0 + widest + 0.15
        assert np.array_equal(points(plain, "near"), points(haloed, "near"))
        alone = illustrate(parts[:1], camera=view, width_mm=75)
        strokes = points(alone, "hatching")
        left = strokes[:, 0] < centre[0] - radius - 2
        assert left.any()
        assert np.isin(strokes[left, 0], points(plain, "far: hatching")[:, 0]).all()

    def test_parts_off_the_picture_draw_nothing_and_hide_nothing(self):
        away = Volume(nested().array, oracle.centred(SHAPE) + np.array([[0, 0, 0, 500.0], *[[0] * 4] * 3]))
        core = Part(volume=nested(), iso=150.0, name="core")
        drawing = illustrate([core, Part(volume=away, iso=50.0, name="away")], camera=camera())
        assert length(drawing, "away") == 0
        assert length(drawing, "core") == pytest.approx(length(illustrate([core], camera=camera())))

    def test_parts_of_two_volumes_are_all_in_the_picture(self):
        away = Volume(nested().array, oracle.centred(SHAPE) + np.array([[0, 0, 0, 80.0], *[[0] * 4] * 3]))
        view = parts_camera([Part(volume=nested(), iso=50.0), Part(volume=away, iso=50.0)], "anterior", 200)
        for x in (-24.0, 104.0):
            assert 0 < view.project([[x, 0.0, 0.0]])[0, 0] < view.size[0]

    def test_is_the_same_on_any_number_of_threads(self, monkeypatch):
        parts = [Part(volume=nested(), iso=150.0), Part(volume=nested(), iso=50.0, opacity=0.3)]
        drawn = []
        for threads in "12":
            monkeypatch.setenv("INTAGLIO_THREADS", threads)
            drawn.append(illustrate(parts, camera=camera(), seed=4))
        assert same(*drawn)

    def test_says_what_is_wrong(self):
        with pytest.raises(InputError, match="parts must hold at least one Part"):
            illustrate([])
        with pytest.raises(InputError, match="halo must be between 0 and 20 mm, not -1"):
            illustrate([Part(volume=nested(), iso=50.0)], halo=-1)
        with pytest.raises(InputError, match="width_mm must be between"):
            illustrate([Part(volume=nested(), iso=50.0)], width_mm=1)


class TestTransferFunction:
    function = TransferFunction.from_points(
        [(20, "#e0a080", 0.0), (60, "#e0a080", 0.2), (90, "#e0a080", 0.0), (130, "#ffffff", 0.0), (200, "#ffffff", 0.8)]
    )

    def test_its_surfaces_are_parts(self):
        skin, core = parts_of(nested(), self.function)
        assert (skin.iso, skin.lines_only, skin.opacity) == (20, True, 0.25)
        assert (core.iso, core.lines_only, core.opacity) == (130, False, 1.0)
        assert skin.colour != core.colour

    def test_they_are_drawn(self):
        view = camera()
        drawing = hatch(nested(), transfer_function=self.function, camera=view, style=FINE, width_mm=60)
        centre, inner = radius_on_paper(drawing, view, 13.0)
        assert np.linalg.norm(points(drawing, "iso 130") - centre, axis=1).max() < inner + 0.3
        assert length(drawing, "iso 20: contour") > 0
        assert length(drawing, "iso 20: hatching") == 0
        assert same(drawing, hatch(nested(), transfer_function=self.function, camera=view, style=FINE, width_mm=60))

    def test_a_hollow_in_denser_matter_is_a_surface_of_its_own(self):
        """Opacity of values below 225 shows the matter within the shell, and not the air around it."""
        function = TransferFunction.from_points(
            [(0, "#a03020", 0.6), (170, "#a03020", 0.6), (225, "#a03020", 0.0), (290, "#404040", 0.3)]
        )
        volume = oracle.shells((24.0, 16.0), (0.0, 300.0, 150.0), SHAPE)
        cavity, shell = parts_of(volume, function)
        assert cavity.iso == (-math.inf, 225)
        assert (cavity.opacity, shell.lines_only) == (1.0, True)
        assert np.ptp(cavity.body[0].corners, axis=0).max() < 44

    def test_matter_between_two_surfaces_is_entered_from_denser_matter_too(self):
        function = TransferFunction.from_points(
            [
                (20, "#808080", 0.0),
                (40, "#808080", 0.1),
                (60, "#808080", 0.0),
                (150, "#a03020", 0.5),
                (225, "#404040", 0.0),
                (300, "#404040", 0.2),
            ]
        )
        film, inner, shell = parts_of(hollow(), function)
        assert film.iso == 20
        assert inner.iso == (60, 225)
        assert shell.iso == 225

    @pytest.mark.parametrize(
        "values",
        [
            [(0, "#ffffff", 0.0), (300, "#ffffff", 0.0)],
            [(0, "#ffffff", 0.5)],
            [(900, "#ffffff", 0.0), (950, "#ffffff", 1.0)],
            [(-50, "#ffffff", 0.0), (300, "#ffffff", 1.0)],
            [(0, "#ffffff", 0.5), (50, "#ffffff", 0.0)],
        ],
    )
    def test_without_surfaces_it_is_refused(self, values):
        with pytest.raises(InputError, match=r"no maximum that begins between .*with iso="):
            hatch(nested(), transfer_function=TransferFunction.from_points(values))

    def test_iso_and_transfer_function_exclude_each_other(self):
        with pytest.raises(InputError, match="iso must not be given with a transfer function"):
            hatch(nested(), iso=50.0, transfer_function=self.function)

    def test_one_surface_alone_is_opaque(self):
        (part,) = parts_of(nested(), TransferFunction.from_points([(20, "#e0a080", 0.0), (60, "#e0a080", 0.2)]))
        assert (part.opacity, part.lines_only) == (1.0, False)

    @settings(deadline=None, max_examples=100)
    @given(st.tuples(*[st.floats(0, 1)] * 3))
    def test_colours_are_dark_enough_for_paper(self, colour):
        text = ink_colour(colour)
        r, g, b = (int(text[i : i + 2], 16) / 255 for i in (1, 3, 5))
        assert 0.2126 * r + 0.7152 * g + 0.0722 * b <= LIGHTEST + 0.01
        # The hue's order stays, but for rounding.
        order = np.argsort(colour)
        assert (np.diff(np.array((r, g, b))[order]) >= -0.005).all()
        dark = ink_colour(colour, "#101010")
        assert [int(dark[i : i + 2], 16) / 255 for i in (1, 3, 5)] == pytest.approx(colour, abs=0.003)


class TestRealScans:
    def test_the_canal_of_a_tooth_lies_within_it(self, shared):
        tooth = read_volume(shared("volumes/tooth.nhdr"))
        canal, whole = Part(volume=tooth, iso=(-math.inf, 600)), Part(volume=tooth, iso=600)
        view = parts_camera([whole], "anterior", 200)
        inner, outer = (isosurface(p.body[0], p.body[1], view, inside=p.body[2], islands=0.01) for p in (canal, whole))
        assert 1000 < inner.mask.sum() < outer.mask.sum() / 2
        assert (outer.depth[inner.mask] < inner.depth[inner.mask]).mean() > 0.99

    def test_a_brain_in_another_orientation_lies_within_its_head(self, shared):
        head, labels = read_volume(shared("volumes/mr_head.nii.gz")), read_volume(shared("volumes/mr_head_labels.nrrd"))
        coarse = labels.world_from_index @ np.diag([2.0, 2.0, 2.0, 1.0])
        labels = Volume(labels.array[::2, ::2, ::2], coarse)
        brain, skin = Part(volume=labels, label=1), Part(volume=head, iso=60.0)
        view = parts_camera([skin], "left", 160)
        inner, outer = (isosurface(p.body[0], p.body[1], view, inside=p.body[2], islands=0.01) for p in (brain, skin))
        assert inner.mask.any()
        assert (outer.depth[inner.mask] < inner.depth[inner.mask] + 2.0).mean() > 0.97

    def test_organs_lie_where_the_scan_has_them(self, shared):
        labels = read_volume(shared("volumes/ct_abdomen_labels.nii.gz"))
        liver, kidneys = (Part(volume=labels, label=which).corners.mean(axis=0) for which in (5, (2, 3)))
        assert liver[0] > kidneys[0]  # on the right
        assert liver[1] > kidneys[1]  # and before them


def test_small_labels_are_no_dust():
    labels = np.zeros((40, 60, 60), np.uint8)
    labels[4:36, 4:36, 4:36] = 1
    labels[18:21, 50:53, 50:53] = 1
    alone = Volume.from_array(labels)
    view = parts_camera([Part(volume=alone, label=1)], "superior", 100)
    drawn = [
        isosurface(p.body[0], 0.0, view, inside="below", islands=p.smallest).mask.sum()
        for p in (Part(volume=alone, label=1), Part(volume=alone, label=1, islands=0.01))
    ]
    assert drawn[0] > drawn[1] + 10


def test_replaced_parts_keep_their_rest():
    part = Part(volume=nested(), iso=50.0, name="skin")
    assert replace(part, opacity=0.5).title == "skin"
    assert Part(volume=nested(), iso=(20.0, 90.0)).title == "20 to 90"
    assert Part(volume=nested(), iso=(-math.inf, 90.0)).title == "cavities to 90"
    assert Part(volume=nested(), iso=(20.0, math.inf)).body == (nested(), 20.0, "above")
