"""Streamlines: evenly spaced, covering, kept to where they may go."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage
from scipy.spatial import cKDTree

from intaglio import InputError, isosurface, read_volume, surface_camera
from intaglio.ink.direction import direction_field
from intaglio.ink.streamlines import Streamlines, streamlines

SIZE = (150, 180)


def doubled(angle):
    return np.stack([np.cos(2 * angle), np.sin(2 * angle)]).astype(np.float32)


def centres(size=SIZE):
    y, x = np.indices(size) + 0.5
    return x, y


def uniform(angle=0.3, size=SIZE):
    return doubled(np.full(size, angle))


def rotational(size=SIZE):
    x, y = centres(size)
    return doubled(np.arctan2(y - size[0] / 2, x - size[1] / 2) + np.pi / 2)


def smooth_noise(seed=0, size=SIZE, scale=25.0):
    """Double angles that turn slowly, but for singularities of both kinds."""
    rng = np.random.default_rng(seed)
    c, s = (ndimage.gaussian_filter(rng.normal(size=size), scale, mode="nearest") for _ in range(2))
    return doubled(np.arctan2(s, c) / 2)


def spiral(size=SIZE):
    """Winding in by a fifth of the radius a round."""
    x, y = centres(size)
    return doubled(np.arctan2(y - size[0] / 2, x - size[1] / 2) + np.pi / 2 - 0.03)


FIELDS = {"uniform": uniform(), "rotational": rotational(), "spiral": spiral(), "noise": smooth_noise()}
each_field = pytest.mark.parametrize("name", FIELDS)
each_separation = pytest.mark.parametrize(("separation", "test"), [(2.5, 0.6), (5.0, 0.5), (9.0, 0.8), (20.0, 0.6)])


def split(lines: Streamlines) -> list[np.ndarray]:
    return [lines.points[a:b].astype(np.float64) for a, b in zip(lines.offsets[:-1], lines.offsets[1:], strict=True)]


def owners(lines: Streamlines) -> np.ndarray:
    return np.repeat(np.arange(len(lines)), np.diff(lines.offsets))


def nearest_other(lines: Streamlines, within: float) -> float:
    """Least distance of points of different lines, if it is below `within`."""
    owner = owners(lines)
    pairs = cKDTree(lines.points).query_pairs(within, output_type="ndarray")
    pairs = pairs[owner[pairs[:, 0]] != owner[pairs[:, 1]]]
    return float(np.linalg.norm(lines.points[pairs[:, 0]] - lines.points[pairs[:, 1]], axis=1).min(initial=np.inf))


def pixel(points) -> tuple[np.ndarray, np.ndarray]:
    return points[:, 1].astype(int), points[:, 0].astype(int)


@each_separation
@each_field
def test_lines_keep_their_distance(name, separation, test):
    lines = streamlines(FIELDS[name], separation, test=test)
    assert len(lines) > 3
    # Every point is tested against all that there are, in float32.
    assert nearest_other(lines, separation) >= test * separation - 1e-3


def test_nearest_other_is_brute_force():
    lines = streamlines(smooth_noise(3, (50, 60), 10), 6.0)
    parts = split(lines)
    brute = min(oracle.gap(parts[i], parts[j]) for i in range(len(parts)) for j in range(i))
    assert nearest_other(lines, 12.0) == pytest.approx(brute, abs=1e-6)


@each_separation
@each_field
def test_lines_cover_the_picture(name, separation, test):
    lines = streamlines(FIELDS[name], separation, test=test)
    x, y = centres()
    distance = cKDTree(lines.points).query(np.stack([x.ravel(), y.ravel()], axis=1))[0]
    assert (distance > 2 * separation).mean() < 0.01
    # Half way between two lines as far apart as may be, before another one fits.
    assert np.mean(distance) < 0.6 * separation


REAL = [("ct_head.nii.gz", 0.2, "anterior"), ("engine.nii.gz", 80.0, (0.5, 0.6, 0.5))]


@pytest.mark.parametrize("separation", [4.0, 9.0])
@pytest.mark.parametrize(("name", "iso", "view"), REAL, ids=[name.split(".")[0] for name, _, _ in REAL])
def test_lines_on_scans_keep_their_distance_and_cover_them(name, iso, view, separation, shared):
    volume = read_volume(shared(f"volumes/{name}"))
    gb = isosurface(volume, iso, surface_camera(volume, iso, view, 400))
    lines = streamlines(direction_field(gb, 18.0), separation, allowed=gb.mask, edge=gb.edge, test=0.45)
    assert nearest_other(lines, 0.6 * separation) >= 0.45 * separation - 1e-3
    y, x = np.nonzero(gb.mask)
    far = cKDTree(lines.points).query(np.stack([x, y], axis=1) + 0.5)[0] > 2 * separation
    border = gb.mask & ~(gb.edge >= 0).any(axis=2)
    border[:, 1:] &= ~(gb.edge[:, :-1, 0] >= 0)
    border[1:] &= ~(gb.edge[:-1, :, 1] >= 0)
    inner = ndimage.distance_transform_edt(border)[y, x] > 2 * separation
    assert far.mean() < 0.01
    assert far[inner].mean() < 1e-3


@each_field
def test_gaps_are_filled_in_their_middle(name):
    """Between lines a separation apart, lines at half of it run in the middle, and one in every gap."""
    first = streamlines(FIELDS[name], 8.0, test=0.5)
    second = streamlines(FIELDS[name], 4.0, test=0.5, beside=first.points)
    both = np.concatenate([first.points, second.points])
    # As many again, as near as gaps are even; points of both are a pixel apart.
    assert 0.7 < len(second.points) / len(first.points) < 1.35
    x, y = centres()
    distance = cKDTree(both).query(np.stack([x.ravel(), y.ravel()], axis=1))[0]
    assert (distance > 4.0).mean() < 0.02


@each_field
def test_total_length_is_about_one_line_every_separation(name):
    for separation in (4.0, 8.0):
        lines = streamlines(FIELDS[name], separation)
        length = sum(np.linalg.norm(np.diff(p, axis=0), axis=1).sum() for p in split(lines))
        assert 0.7 < length * separation / np.prod(SIZE) < 1.15


@each_separation
@each_field
def test_a_line_does_not_come_back_to_itself(name, separation, test):
    lines = streamlines(FIELDS[name], separation, test=test)
    step = np.linalg.norm(lines.points[1] - lines.points[0])
    lag = 3 * separation / step + 4
    for line in split(lines):
        pairs = cKDTree(line).query_pairs(test * separation - 1.01 * step, output_type="ndarray")
        assert (np.abs(pairs[:, 0] - pairs[:, 1]) <= lag).all()


def test_circles_stay_circles_and_end_when_they_close():
    lines = split(streamlines(rotational(), 6.0))
    centre = np.array(SIZE[::-1]) / 2
    for line in lines:
        radius = np.linalg.norm(line - centre, axis=1)
        if radius.mean() < 5:
            continue  # a few pixels from the singularity the field is not smooth
        # Bilinear angles and the midpoint rule: a part of a pixel in a round.
        assert np.ptp(radius) < 0.1
        assert len(line) < 2 * np.pi * radius.mean() + 2
    whole = [line for line in lines if 8 < np.linalg.norm(line[0] - centre) < 70]
    turned = [np.unwrap(np.arctan2(*(line - centre).T[::-1])) for line in whole]
    assert max(np.ptp(t) for t in turned) < 2 * np.pi + 0.1


@pytest.mark.parametrize("degrees", [0, 17, 45, 90, 133])
def test_a_uniform_field_gives_straight_lines(degrees):
    angle = np.radians(degrees)
    along = np.array([np.cos(angle), np.sin(angle)])
    for line in split(streamlines(uniform(angle), 7.0)):
        across = (line - line[0]) @ (-along[1], along[0])
        # float32 positions of up to 180 pixels, added up over 200 steps.
        assert np.abs(across).max() < 2e-3
        assert (np.abs(np.diff(line @ along)) > 0.99).all()


@each_field
@pytest.mark.parametrize("step", [0.4, 1.0])
def test_points_are_a_step_apart(name, step):
    for line in split(streamlines(FIELDS[name], 6.0, step=step)):
        # float32 positions of up to 180 pixels.
        np.testing.assert_allclose(np.linalg.norm(np.diff(line, axis=0), axis=1), step, atol=5e-5)


@each_field
def test_lines_follow_the_field(name):
    field = FIELDS[name]
    for line in split(streamlines(field, 6.0)):
        step = np.diff(line, axis=0)
        middle = (line[1:] + line[:-1]) / 2
        c, s = (ndimage.map_coordinates(f, [middle[:, 1] - 0.5, middle[:, 0] - 0.5], order=1, mode="nearest") for f in field)
        angle = 2 * np.arctan2(step[:, 1], step[:, 0])
        agree = (c * np.cos(angle) + s * np.sin(angle)) / np.maximum(np.hypot(c, s), 1e-9)
        # Twice the angle; within 3 degrees but near singularities, where a step turns by more.
        assert np.quantile(agree, 0.1) > np.cos(np.radians(6))


@each_field
def test_no_line_turns_back(name):
    for line in split(streamlines(FIELDS[name], 5.0)):
        step = np.diff(line, axis=0)
        assert ((step[1:] * step[:-1]).sum(axis=1) > 0.5).all()


@each_field
def test_lines_stay_where_they_are_allowed(name):
    x, y = centres()
    allowed = (np.hypot(x - 60, y - 70) < 50) & (np.hypot(x - 60, y - 70) > 20) | (x > 140)
    lines = streamlines(FIELDS[name], 4.0, allowed=allowed)
    assert allowed[pixel(lines.points)].all()
    inside = np.stack([x[allowed], y[allowed]], axis=1)
    distance = cKDTree(lines.points).query(inside)[0]
    assert (distance > 8.0).mean() < 0.01


@each_field
def test_no_line_crosses_an_edge(name):
    x, y = centres()
    side = (np.hypot(x - 80, y - 80) < 45).astype(int) + 2 * (x + 0.3 * y > 130)
    edge = np.full((*SIZE, 2), np.nan, dtype=np.float32)
    edge[:, :-1, 0][side[:, 1:] != side[:, :-1]] = 0.5
    edge[:-1, :, 1][side[1:] != side[:-1]] = 0.5
    lines = streamlines(FIELDS[name], 4.0, edge=edge)
    for line in split(lines):
        assert len(np.unique(side[pixel(line)])) == 1
    free = streamlines(FIELDS[name], 4.0)
    assert any(len(np.unique(side[pixel(line)])) > 1 for line in split(free))


@each_field
def test_lines_beside_others_run_between_them(name):
    first = streamlines(FIELDS[name], 12.0)
    second = streamlines(FIELDS[name], 6.0, test=0.7, beside=first.points)
    assert len(second) > 0
    assert cKDTree(first.points).query(second.points)[0].min() >= 0.7 * 6.0 - 1e-3
    both = np.concatenate([first.points, second.points])
    x, y = centres()
    assert (cKDTree(both).query(np.stack([x.ravel(), y.ravel()], axis=1))[0] > 12.0).mean() < 0.01
    alone = streamlines(FIELDS[name], 6.0, test=0.7)
    assert 0.3 < len(second.points) / len(alone.points) < 0.75


def test_singularities_and_empty_places_end_a_line():
    field = uniform(0.0)
    field[:, :, 80:100] = 0.0
    lines = streamlines(field, 5.0)
    x = lines.points[:, 0]
    # Half a pixel of the first empty column is still pulled along by interpolation.
    assert not ((x > 82) & (x < 98)).any()
    for line in split(lines):
        assert (line[:, 0] < 90).all() or (line[:, 0] > 90).all()


@each_field
def test_lines_are_no_shorter_than_asked(name):
    for shortest in (3.0, 30.0):
        lines = streamlines(FIELDS[name], 6.0, shortest=shortest)
        assert all(len(line) - 1 >= shortest - 1 for line in split(lines))


@each_field
def test_same_input_gives_the_same_lines(name):
    a, b = (streamlines(FIELDS[name].copy(), 4.0) for _ in range(2))
    np.testing.assert_array_equal(a.points, b.points)
    np.testing.assert_array_equal(a.offsets, b.offsets)


def test_nothing_comes_of_nothing():
    for lines in (
        streamlines(np.zeros((2, 40, 30), dtype=np.float32), 4.0),
        streamlines(uniform(size=(40, 30)), 4.0, allowed=np.zeros((40, 30), dtype=bool)),
        streamlines(uniform(size=(1, 1)), 4.0),
    ):
        assert len(lines) == 0
        assert lines.points.shape == (0, 2)
        assert lines.offsets.tolist() == [0]


@settings(deadline=None, max_examples=60)
@given(
    size=st.tuples(st.integers(1, 40), st.integers(1, 40)),
    separation=st.floats(1, 90),
    test=st.floats(0.1, 1),
    step=st.floats(0.2, 1.0),
    seed=st.integers(0, 99),
    holes=st.floats(0, 1),
)
def test_any_field_gives_lines_within_bounds(size, separation, test, step, seed, holes):
    rng = np.random.default_rng(seed)
    field = doubled(rng.uniform(0, np.pi, size)) if seed % 3 == 0 else smooth_noise(seed, size, 5.0)
    allowed = rng.random(size) >= holes
    lines = streamlines(field, separation, allowed=allowed, test=test, step=step)
    assert lines.points.dtype == np.float32
    assert lines.offsets[0] == 0
    assert lines.offsets[-1] == len(lines.points)
    assert (np.diff(lines.offsets) >= 2).all()
    assert np.isfinite(lines.points).all()
    assert allowed[pixel(lines.points)].all()
    if len(lines) > 1:
        # Lines begin a separation from others but for 2 %, which rounding may take.
        assert nearest_other(lines, separation) >= min(test, 0.98) * separation - 1e-3


@pytest.mark.parametrize(
    ("field", "options", "message"),
    [
        (np.zeros((40, 30), dtype=np.float32), {}, r"field must be \(2, height, width\), not \(40, 30\)"),
        (np.zeros((3, 40, 30), dtype=np.float32), {}, r"field must be \(2, height, width\)"),
        (uniform(), {"separation": 0.9}, r"separation must be at least 1 pixel, not 0\.9"),
        (uniform(), {"separation": np.nan}, "separation must be at least 1 pixel, not nan"),
        (uniform(), {"test": 0.05}, r"test must be between 0\.1 and 1, not 0\.05"),
        (uniform(), {"test": 1.2}, r"test must be between 0\.1 and 1, not 1\.2"),
    ],
)
def test_what_makes_no_sense_is_refused(field, options, message):
    with pytest.raises(InputError, match=message):
        streamlines(field, **{"separation": 5.0, **options})
