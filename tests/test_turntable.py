"""Turntables: lines move with the surface, go where it hides, and are otherwise left alone."""

from __future__ import annotations

from dataclasses import replace
from itertools import islice

import numpy as np
import oracle
import PIL.Image
import pytest
from scipy.spatial import cKDTree

from intaglio import Camera, InputError, isosurface, read_volume, turntable
from intaglio.animation import _turn
from intaglio.datasets import head
from intaglio.ink.carry import carried
from intaglio.ink.direction import direction_field
from intaglio.ink.hatching import hatched
from intaglio.ink.streamlines import Streamlines, streamlines
from intaglio.ink.styles import style
from intaglio.io.moving import save_moving

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
    assert not np.isin(again.number, across.number).any()


def moved_alike(volume, iso, kept, view=(0, 1, 0.2), name="pen-and-ink"):
    """Correlation of a second picture's ink with that of the first, moved with the surface; less their tones."""
    from scipy import ndimage

    from intaglio import Drawing

    first = Camera.looking(view, volume, 300)
    hatching = style(name)
    lines, pictures, buffers = [], [], []
    for degrees in (0.0, 5.0):
        turn = _turn(degrees)
        gb = isosurface(volume, iso, replace(first, eye=turn @ first.eye, forward=turn @ first.forward, up=turn @ first.up))
        before = [carried(layer, buffers[-1], gb) for layer in lines] if kept else []
        layers, lines = hatched(gb, hatching, 0.2, kept=before)
        w, h = gb.camera.size
        pictures.append(1 - Drawing(tuple(layers), w * 0.2, h * 0.2).image(127).array[:h, :w, 0].astype(float))
        buffers.append(gb)
    y, x = np.nonzero(buffers[1].mask)
    origin, ray = oracle.rays(buffers[1].camera, x + 0.5, y + 0.5)
    place = buffers[0].camera.project(origin + buffers[1].depth[y, x][:, None] * ray)
    near = np.abs(ndimage.map_coordinates(buffers[0].depth, [place[:, 1] - 0.5, place[:, 0] - 0.5], order=0) - place[:, 2]) < 2
    old, new = (p - ndimage.gaussian_filter(p, 6) for p in pictures)
    old = ndimage.map_coordinates(old, [place[:, 1] - 0.5, place[:, 0] - 0.5], order=1)[near]
    return np.corrcoef(old, new[y, x][near])[0, 1]


@pytest.mark.parametrize("name", ["pen-and-ink", "engraving"])
def test_strokes_stay_on_a_real_head(shared, name):
    """Five degrees on, most ink is where the surface took it; drawn afresh, hardly any is but by chance."""
    volume = read_volume(shared("volumes/ct_head.nii.gz"))
    assert moved_alike(volume, 0.2, True, name=name) > 0.55
    assert moved_alike(volume, 0.2, False, name=name) < 0.25


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


def test_an_interrupted_turn_leaves_no_file(ball, tmp_path):
    def stop(done, total):
        if done == 2:
            raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        save_moving(turntable(ball, iso=0.0, frames=4, size=80, width_mm=30, separation=2.0, progress=stop), tmp_path / "a.gif")
    assert list(tmp_path.iterdir()) == []
