"""Turntables: lines move with the surface, go where it hides, and are otherwise left alone."""

from __future__ import annotations

import weakref
from dataclasses import replace
from itertools import islice

import numpy as np
import oracle
import PIL.Image
import pytest
from scipy import ndimage
from scipy.spatial import cKDTree

from intaglio import Camera, Drawing, InputError, Part, TransferFunction, illustrate, isosurface, read_volume, turntable
from intaglio.animation import _cameras, _turn
from intaglio.datasets import head
from intaglio.ink.carry import bent, carried
from intaglio.ink.direction import direction_field
from intaglio.ink.streamlines import Streamlines, streamlines
from intaglio.ink.styles import style
from intaglio.io.moving import save_moving
from intaglio.plate import HALO, illustrated

SPHERE = oracle.Sphere(18.0)


@pytest.fixture(scope="module")
def ball():
    return oracle.sampled(SPHERE.field, (48, 48, 48))


def seen(volume, degrees, size=240, projection="orthographic", iso=0.0):
    first = Camera.looking((0, 1, 0.4), volume, (size, size), projection=projection)
    turn = _turn(degrees)
    camera = replace(first, eye=turn @ first.eye, forward=turn @ first.forward, up=turn @ first.up)
    return isosurface(volume, iso, camera)


def lines_on(gb, separation=6.0):
    return streamlines(direction_field(gb, 10.0), separation, allowed=gb.mask, edge=gb.edge, test=0.5)


def lengths(lines: Streamlines) -> np.ndarray:
    return np.array(
        [
            np.linalg.norm(np.diff(lines.points[a:b], axis=0), axis=1).sum()
            for a, b in zip(lines.offsets, lines.offsets[1:], strict=False)
        ]
    )


def test_seen_from_the_same_place_lines_stay(ball):
    gb = seen(ball, 0)
    lines = lines_on(gb)
    again = carried(lines, gb, gb)
    # But for what lies on the last pixels before the contour.
    assert lengths(again).sum() > 0.97 * lengths(lines).sum()
    # Between points a pixel apart on a bent line: an eighth of the bend.
    assert cKDTree(lines.points).query(again.points)[0].max() < 0.55
    long = np.isin(lines.number, again.number)
    assert lengths(lines)[long].sum() > 0.97 * lengths(lines).sum()


@pytest.mark.parametrize("projection", ["orthographic", "perspective"])
@pytest.mark.parametrize("degrees", [3.0, -20.0])
def test_lines_turn_with_the_body(ball, degrees, projection):
    """Points of the sphere that a line runs through are where the turned camera sees them."""
    before, now = (seen(ball, a, projection=projection) for a in (0.0, degrees))
    lines = lines_on(before)
    moved = carried(lines, before, now)
    origin, ray = oracle.rays(before.camera, lines.points[:, 0], lines.points[:, 1])
    # The near crossing of a ray with a sphere about 0.
    b, c = (origin * ray).sum(axis=1), (origin**2).sum(axis=1) - SPHERE.radius**2
    a = (ray**2).sum(axis=1)
    deep = b * b - a * c
    sure = deep > 4.0 * a  # not where rays graze it
    at = origin + ((-b - np.sqrt(np.maximum(deep, 0.0))) / a)[:, None] * ray
    expected = now.camera.project(at[sure])[:, :2]
    distance = cKDTree(expected).query(moved.points)[0]
    facing = now.facing[moved.points[:, 1].astype(int), moved.points[:, 0].astype(int)]
    # Half a step, stretched by the turn; the surface of voxels is a hundredth of one off.
    assert np.quantile(distance[facing > 0.4], 0.95) < 0.9
    step = np.linalg.norm(lines.points[1] - lines.points[0])
    inside = np.ones(len(moved.points) - 1, bool)
    inside[moved.offsets[1:-1] - 1] = False
    np.testing.assert_allclose(np.linalg.norm(np.diff(moved.points, axis=0), axis=1)[inside], step, atol=0.1)


def test_what_is_hidden_or_out_of_view_goes():
    near, far = oracle.Sphere(6.0, (0.0, 14.0, 0.0)), oracle.Sphere(10.0, (0.0, -6.0, 0.0))
    volume = oracle.sampled(lambda p: np.maximum(near.field(p), far.field(p)), (48, 60, 48))
    aside, front = seen(volume, 40), seen(volume, 0)
    lines = lines_on(aside, 5.0)
    moved = carried(lines, aside, front)
    y, x = moved.points[:, 1].astype(int), moved.points[:, 0].astype(int)
    assert front.mask[y, x].all()
    # From the front, the near sphere covers the middle of the far one; its lines are not seen through it.
    assert 0.3 < lengths(moved).sum() / lengths(lines).sum() < 0.9
    # From behind, the top alone is seen again.
    assert len(carried(lines, aside, seen(volume, 180)).points) < 0.4 * len(lines.points)


def test_kept_lines_stay_as_they_are(ball):
    gb = seen(ball, 0)
    field = direction_field(gb, 10.0)
    options = {"allowed": gb.mask, "edge": gb.edge, "test": 0.5}
    lines = streamlines(field, 6.0, **options)
    again = streamlines(field, 6.0, kept=lines, **options)
    assert set(lines.number[lengths(lines) > 40]) <= set(again.number)
    assert cKDTree(again.points).query(lines.points[np.repeat(lengths(lines) > 40, np.diff(lines.offsets))])[0].max() < 1e-3
    assert (~np.isin(again.number, lines.number)).sum() < 0.2 * len(lines)
    owner = np.repeat(np.arange(len(again)), np.diff(again.offsets))
    pairs = cKDTree(again.points).query_pairs(3.0, output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    assert np.linalg.norm(again.points[pairs[:, 0]] - again.points[pairs[:, 1]], axis=1).min(initial=9) >= 3.0 - 1e-3
    # Each number once, but for lines cut in pieces; new ones take what is free.
    assert again.number.max() < max(len(again), lines.number.max() + 1)


def test_kept_lines_that_no_longer_follow_the_field_go(ball):
    gb = seen(ball, 0)
    field = direction_field(gb, 10.0)
    across = streamlines(-field, 6.0, allowed=gb.mask, test=0.5)  # twice the angle: the other way is across
    again = streamlines(field, 6.0, allowed=gb.mask, test=0.5, kept=across)
    # Hardly a point of them is left but where the two cross.
    assert (cKDTree(across.points).query(again.points)[0] < 1e-3).mean() < 0.01


@pytest.mark.parametrize("aside", [8.0, 22.0, 35.0])
def test_lines_turn_back_to_a_field_that_they_leave(ball, aside):
    """Up to 20 degrees they stay; beyond, they turn by the rest, about their middles."""
    gb = seen(ball, 0)
    field = direction_field(gb, 10.0)
    lines = lines_on(gb)
    c, s = np.cos(np.radians(2 * aside)), np.sin(np.radians(2 * aside))
    moved = bent(lines, np.stack([c * field[0] - s * field[1], s * field[0] + c * field[1]]).astype(np.float32))
    inner = np.concatenate([np.arange(a + 25, b - 26) for a, b in zip(lines.offsets, lines.offsets[1:], strict=False)])
    old, new = (np.arctan2(*(p[inner + 1] - p[inner]).T[::-1]) for p in (lines.points, moved.points))
    turned = np.degrees(np.angle(np.exp(1j * (new - old).astype(float))))
    assert np.median(turned) == pytest.approx(max(aside - 20.0, 0.0), abs=1.0)
    shift = np.add.reduceat(moved.points - lines.points, lines.offsets[:-1], axis=0) / np.diff(lines.offsets)[:, None]
    assert np.abs(shift).max() < 0.5


def ink(drawing: Drawing, kind: str) -> np.ndarray:
    """What layers of a kind cover, at 127 dpi, less their tones."""
    layers = tuple(replace(layer, colour="#000000", brush="pen") for layer in drawing.layers if kind in layer.name)
    picture = 1 - replace(drawing, layers=layers, paper="#ffffff").image(127).array[..., 0].astype(float)
    return picture - ndimage.gaussian_filter(picture, 6)


def moved_alike(parts, kind, of=0, kept=True, degrees=5.0):
    """Correlation of a second picture's ink with that of the first, moved with the surface of a part; less their tones.

    1 for strokes that stay on the surface; 0 for those that are drawn afresh, but for what the surface tells.
    """
    frames, pictures = [], []
    for seed, camera in enumerate(_cameras(parts, (0, 1, 0.2), 300, [0.0, degrees], {})):
        # At 0.2 mm, a pixel is one of the picture.
        options = {"width_mm": 0.2 * camera.size[0], "halo": HALO, "seed": 0 if kept else seed}
        frames.append(illustrated(parts, camera, before=frames[-1] if frames and kept else None, **options))
        w, h = camera.size
        pictures.append(ink(frames[-1].drawing, kind)[:h, :w])
    first, second = (frame.surfaces[of] for frame in frames)
    # Beside a contour, the nearest depth: ink lies on both sides of it.
    before, now = (ndimage.minimum_filter(gb.depth, 5) for gb in (first, second))
    y, x = np.nonzero(np.isfinite(now))
    origin, ray = oracle.rays(second.camera, x + 0.5, y + 0.5)
    place = first.camera.project(origin + now[y, x][:, None] * ray)
    at = [place[:, 1] - 0.5, place[:, 0] - 0.5]
    near = np.abs(ndimage.map_coordinates(before, at, order=0) - place[:, 2]) < 5.0 * first.camera.pixel
    old = ndimage.map_coordinates(pictures[0], at, order=1)
    return np.corrcoef(old[near], pictures[1][y, x][near])[0, 1]


@pytest.mark.parametrize("name", ["pen-and-ink", "engraving"])
def test_strokes_stay_on_a_real_head(shared, name):
    """Five degrees on, most ink is where the surface took it; drawn afresh, hardly any is but by chance."""
    head = [Part(volume=read_volume(shared("volumes/ct_head.nii.gz")), iso=0.2, style=name)]
    assert moved_alike(head, "hatching") > 0.45
    assert moved_alike(head, "hatching", kept=False) < 0.25


def test_contours_by_hand_and_several_surfaces_do_not_boil(shared):
    """A degree on, strokes of a hand lie nearly as exact contours do; those by another chance do not."""
    volume = read_volume(shared("volumes/ct_head.nii.gz"))
    parts = [
        Part(volume=volume, iso=0.55, name="skull", style="engraving"),
        Part(volume=volume, iso=0.2, name="skin", style="charcoal", opacity=0.5, lines_only=True),
    ]
    exact = [parts[0], replace(parts[1], style=style("charcoal", hand=None))]
    by_hand, afresh = (moved_alike(parts, "skin: contour", 1, kept, 1.0) for kept in (True, False))
    exactly = moved_alike(exact, "skin: contour", 1, degrees=1.0)
    assert by_hand > exactly - 0.12
    assert afresh < by_hand - 0.1
    assert moved_alike(parts, "skull: hatching", 0, degrees=1.0) > 0.5
    # By chance, as much as there is ink.
    assert moved_alike(parts, "skull: hatching", 0, False, 1.0) < 0.33


def nested(outer=1.0, inner=1.0):
    """A ball in a larger one, as Parts of these opacities."""
    small, large = (oracle.sampled(oracle.Sphere(r).field, (48, 48, 48)) for r in (9.0, 18.0))
    return [
        Part(volume=small, iso=0.0, style="pencil", name="inner", opacity=inner),
        Part(volume=large, iso=0.0, style="engraving", name="outer", opacity=outer, lines_only=outer < 1),
    ]


TURN = {"frames": 3, "degrees": 20.0, "size": 160, "width_mm": 40.0}


def test_each_plate_is_an_illustration_of_all_parts():
    parts = nested(outer=0.5)
    plates = list(turntable(parts, **TURN, halo=0.2, paper="#eeeedd"))
    cameras = _cameras(parts, "anterior", 160, [0.0, 20 / 3, 40 / 3], {})
    alone = illustrate(parts, camera=cameras[0], width_mm=40.0, halo=0.2, paper="#eeeedd", title=plates[0].title)
    assert plates[0]._repr_svg_() == alone._repr_svg_()
    for plate in plates:
        strokes = {layer.name: len(layer.strokes) for layer in plate.layers}
        assert min(strokes[name] for name in ("inner: hatching 1", "inner: contour", "outer: contour")) > 0
        assert plate.paper == "#eeeedd"


def test_what_opaque_parts_hide_is_cut_in_every_plate():
    aside = oracle.Sphere(9.0, (26.0, 0.0, 0.0))
    beside = Part(volume=oracle.sampled(aside.field, (30, 30, 80)), iso=0.0, style="pencil", name="beside")
    parts = [*nested(), beside]
    for camera, plate in zip(
        _cameras(parts, "anterior", 160, [0.0, 60.0, 120.0], {}), turntable(parts, **TURN | {"degrees": 180.0}), strict=True
    ):
        mm = 40.0 / camera.size[0]
        layers = {layer.name: layer.strokes for layer in plate.layers}
        assert sum(len(s) for name, s in layers.items() if name.startswith("inner")) == 0
        middle, other = camera.project(np.array([[0.0, 0.0, 0.0], [26.0, 0.0, 0.0]]))
        points = np.concatenate([s.points for name, s in layers.items() if name.startswith("beside")]) / mm
        inside = np.linalg.norm(points - middle[:2], axis=1) < 18.0 / camera.pixel - 6
        # Behind, where the viewer has walked round, the larger ball covers it.
        assert inside.any() == (other[2] < middle[2])


def test_a_volume_turns_as_it_is_hatched_and_parts_say_it_all(ball):
    function = TransferFunction.from_points(
        [(v, "#604020", a) for v, a in ((-2.0, 0.0), (0.0, 1.0), (2.0, 0.0), (6.0, 0.0), (9.0, 1.0))]
    )
    plate = next(turntable(ball, transfer_function=function, **TURN))
    assert len({layer.name.split(":")[0] for layer in plate.layers}) == 2
    with pytest.raises(InputError, match="'style' must not be given with Parts"):
        turntable(nested(), style="pencil")
    with pytest.raises(InputError, match="parts must hold at least one Part"):
        turntable([])
    with pytest.raises(InputError, match="halo must be between 0 and 20"):
        turntable(ball, iso=0.0, halo=-1)


def test_plates_come_one_by_one_and_the_same_again(monkeypatch):
    seen: list[tuple[int, int]] = []
    options = {"frames": 3, "degrees": 15, "size": 150, "width_mm": 40, "style": "pencil", "seed": 5}
    runs = []
    for threads in "12":
        monkeypatch.setenv("INTAGLIO_THREADS", threads)
        runs.append([d._repr_svg_() for d in turntable(head(), **options, progress=lambda *at: seen.append(at))])
    assert runs[0] == runs[1]
    assert seen == [(1, 3), (2, 3), (3, 3)] * 2
    assert len(set(runs[0])) == 3
    assert next(iter(turntable(head(), **options | {"seed": 6})))._repr_svg_() != runs[0][0]


def test_the_body_is_in_the_picture_all_round(ball):
    box = oracle.sampled(lambda p: 5.0 - np.abs(p / (4.0, 1.0, 2.0)).max(axis=-1), (40, 30, 60))
    for plate in turntable(box, iso=0.0, frames=5, size=120, width_mm=30, separation=1.5):
        points = np.concatenate([layer.strokes.points for layer in plate.layers])
        assert (points > 0.3).all()
        assert (points < (plate.width_mm - 0.3, plate.height_mm - 0.3)).all()


@pytest.mark.parametrize(
    ("options", "message"),
    [
        ({"frames": 0}, "frames must be a whole number between 1 and 3600, not 0"),
        ({"frames": 2.5}, "frames must be a whole number"),
        ({"degrees": 0}, "degrees must be a number other than 0"),
        ({"style": "crayon"}, "style must be one of"),
    ],
)
def test_what_makes_no_sense_is_refused_at_once(ball, options, message):
    with pytest.raises(InputError, match=message):
        turntable(ball, iso=0.0, **options)


def test_moving_files(ball, tmp_path):
    plates = list(turntable(ball, iso=0.0, frames=3, size=100, width_mm=30, separation=1.5))
    for name in ("a.gif", "b.png"):
        assert save_moving(plates, tmp_path / name, dpi=100, rate=10) == 3
        with PIL.Image.open(tmp_path / name) as picture:
            assert picture.n_frames == 3
            assert picture.info["duration"] == 100
            assert picture.size == (118, round(plates[0].height_mm / 25.4 * 100))
    assert save_moving(islice(plates, 2), tmp_path / "new" / "folder", dpi=50) == 2
    assert sorted(p.name for p in (tmp_path / "new" / "folder").iterdir()) == ["0001.png", "0002.png"]
    for path, options, message in (
        (tmp_path / "c.gif", {"rate": 0}, "rate must be between 1 and 50"),
        (tmp_path / "c.svg", {}, "output must end in .gif or .png"),
        (tmp_path / "none" / "c.gif", {}, "does not exist"),
        (tmp_path / "a.gif" / "x", {}, "cannot be made"),
    ):
        with pytest.raises(InputError, match=message):
            save_moving(plates, path, **options)
    with pytest.raises(InputError, match="no drawings"):
        save_moving([], tmp_path / "d.gif")
    with pytest.raises(InputError, match="must be equally large"):
        save_moving([plates[0], replace(plates[0], height_mm=20.0)], tmp_path / "d.png")
    assert not list(tmp_path.glob("d.*"))
    assert not list(tmp_path.glob(".*"))


def test_moving_files_hold_the_pictures(ball, tmp_path):
    """Frame by frame the pixels of the plates: all of them in a PNG, within a few greys in a GIF."""
    plates = list(turntable(ball, iso=0.0, frames=3, size=100, width_mm=30, separation=1.5, ink="#803010"))
    for name, off in (("a.gif", 12), ("b.png", 0)):
        save_moving(plates, tmp_path / name, dpi=100)
        with PIL.Image.open(tmp_path / name) as picture:
            for k, plate in enumerate(plates):
                picture.seek(k)
                pixels = np.asarray(picture.convert("RGB")).astype(int)
                assert np.abs(pixels - plate.image(100).bytes8[..., :3]).max() <= off


def test_pictures_are_written_one_by_one(ball, tmp_path):
    """However many there are, no more than two drawings are held."""
    held: list[weakref.ref] = []
    most = []

    def drawings():
        plate = next(turntable(ball, iso=0.0, size=60, width_mm=30, separation=2.0))
        for k in range(12):
            one = replace(plate, title=str(k))
            held.append(weakref.ref(one))
            most.append(sum(r() is not None for r in held))
            yield one

    for name in ("a.gif", "b.png", "folder"):
        assert save_moving(drawings(), tmp_path / name, dpi=50) == 12
    assert max(most) <= 2


def test_an_interrupted_turn_leaves_no_file(ball, tmp_path):
    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        save_moving(turntable(ball, iso=0.0, frames=4, size=80, width_mm=30, separation=2.0, progress=stop), tmp_path / "a.gif")
    assert list(tmp_path.iterdir()) == []
