"""Contours by hand: chains in order without false connections, strokes that keep their rules, chance from one seed."""

from __future__ import annotations

from dataclasses import replace
from itertools import pairwise

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st
from scipy.ndimage import gaussian_filter
from test_contours import disks

from intaglio import Camera, Drawing, GBuffer, Hand, InputError, contour, draw_lines, isosurface, read_volume, surface_camera
from intaglio.drawing import Strokes
from intaglio.ink.beginnings import Beginnings, Lines, begun, surface_on_the_left
from intaglio.ink.following import follow
from intaglio.ink.hand import bezier, drawn_by_hand, hand_strokes
from intaglio.ink.strokes import arc_length
from intaglio.ink.styles import style
from intaglio.plate import ISLANDS

MM = 0.2
# A hand that follows its line exactly.
STEADY = Hand(deviation=0, perturbation=0, lengthening=0, translation=0, rotation=0)


def drawn_line(distance: np.ndarray) -> np.ndarray:
    """A soft line in a picture, from every pixel's distance to its middle."""
    return np.exp(-0.5 * (distance / 1.4) ** 2).astype(np.float32)


def grid(size: int):
    y, x = np.indices((size, size)) + 0.5
    return x, y


def parts(points, offsets) -> list[np.ndarray]:
    return [points[a:b].astype(float) for a, b in pairwise(offsets)]


def strokes_of(gb: GBuffer, hand: Hand, seed: int = 0) -> Strokes:
    return hand_strokes(gb, hand, MM, width=0.4, seed=seed)


@given(st.floats(12, 40), st.floats(45, 55), st.floats(45, 55))
@settings(deadline=None, max_examples=25)
def test_a_circle_is_one_closed_chain_finer_than_a_pixel(radius, cx, cy):
    x, y = grid(100)
    points, offsets, start = follow(drawn_line(np.hypot(x - cx, y - cy) - radius), least=0.3, scan=8)
    (chain,) = parts(points, offsets)
    assert start.tolist() == [1]
    assert (chain[0] == chain[-1]).all()
    # A curved line's blurred middle lies inside it by about s^2 / 2r.
    np.testing.assert_allclose(np.hypot(*(chain - (cx, cy)).T), radius, atol=0.2)
    step = np.linalg.norm(np.diff(chain, axis=0), axis=1)
    assert step.max() < 3.4
    turns = np.unwrap(np.arctan2(*(chain - (cx, cy)).T[::-1]))
    assert abs(turns[-1] - turns[0]) == pytest.approx(2 * np.pi, abs=1e-3)
    # In order: it never turns back.
    assert (np.diff(turns) * np.sign(turns[-1] - turns[0]) > 0).all()


def test_branches_are_chains_of_their_own_that_begin_on_the_line():
    """A T: one bar, and one stem that begins on it."""
    x, y = grid(80)
    bar = np.where((x > 10) & (x < 70), np.abs(y - 20), 99)
    stem = np.where((y > 20) & (y < 70), np.abs(x - 40), 99)
    points, offsets, start = follow(drawn_line(np.minimum(bar, stem)), least=0.3, scan=200)
    chains = sorted(parts(points, offsets), key=lambda c: np.ptp(c[:, 0]), reverse=True)
    assert len(chains) <= 3
    total = sum(np.linalg.norm(np.diff(c, axis=0), axis=1).sum() for c in chains)
    assert total == pytest.approx(60 + 50, rel=0.1)
    for chain in chains:
        assert np.linalg.norm(np.diff(chain, axis=0), axis=1).max() < 3.4


@pytest.mark.parametrize("gap", [4.0, 6.0, 9.0])
def test_neighbouring_lines_are_never_connected(gap):
    """What Gerl's strokes did: they jumped from one line to the next."""
    x, y = grid(120)
    lines = [np.abs(y - (30 + k * gap) - 0.15 * x) for k in range(5)]
    points, offsets, _ = follow(drawn_line(np.min(lines, axis=0)), least=0.5, scan=16)
    chains = parts(points, offsets)
    assert len(chains) == 5
    for chain in chains:
        level = chain[:, 1] - 0.15 * chain[:, 0]
        assert np.ptp(level) < 1.0


def test_crossing_lines_go_straight_on():
    x, y = grid(100)
    image = drawn_line(np.minimum(np.abs(x - y), np.abs(x + y - 100)) / np.sqrt(2))
    points, offsets, _ = follow(image, least=0.3, scan=11)
    for chain in parts(points, offsets):
        # Each stays on its own diagonal, but for the blurred crossing.
        off = np.minimum(np.abs(chain[:, 0] - chain[:, 1]), np.abs(chain.sum(axis=1) - 100))
        assert off.max() < 3
        ends = chain[-1] - chain[0]
        assert len(chain) < 12 or abs(abs(ends[0]) - abs(ends[1])) < 0.15 * np.abs(ends).max()


@given(st.integers(0, 2**31), st.floats(0, 3))
@settings(deadline=None, max_examples=20)
def test_noise_gives_chains_whose_points_are_used_once(seed, sigma):
    image = gaussian_filter(np.random.default_rng(seed).random((60, 70)).astype(np.float32), sigma)
    points, offsets, start = follow(image, least=float(np.median(image)), scan=5)
    assert offsets[-1] == len(points)
    assert len(start) == len(offsets) - 1
    assert (np.diff(start) >= 0).all()
    for chain in parts(points, offsets):
        assert np.linalg.norm(np.diff(chain, axis=0), axis=1).max(initial=0) < 3.4


@pytest.mark.parametrize("size", [(1, 1), (1, 40), (40, 1), (2, 2), (3, 3)])
def test_pictures_too_small_for_lines(size):
    points, offsets, start = follow(np.ones(size, dtype=np.float32), least=0.1, scan=1)
    assert (len(points), offsets.tolist(), len(start)) == (0, [0], 0)


@given(st.integers(2, 16), st.integers(0, 1000))
@settings(deadline=None, max_examples=30)
def test_bezier_curves(n, seed):
    """Ends, tangents at them, and straight control polygons: the curve's own laws."""
    rng = np.random.default_rng(seed)
    control = rng.normal(size=(3, n, 2))
    t = np.linspace(0, 1, 65)
    curve = bezier(control, t)
    np.testing.assert_allclose(curve[:, [0, -1]], control[:, [0, -1]], atol=1e-12)
    near = bezier(control, np.array([1e-6]))[:, 0]
    np.testing.assert_allclose((near - control[:, 0]) / 1e-6, (n - 1) * (control[:, 1] - control[:, 0]), rtol=1e-3, atol=1e-3)
    even = np.linspace(0, 1, n)[None, :, None] * np.array([3.0, -1.0])
    np.testing.assert_allclose(bezier(even, t)[0], t[:, None] * np.array([3.0, -1.0]), atol=1e-12)
    # Within the hull: no coordinate beyond those of the control points.
    assert (curve.min(axis=1) >= control.min(axis=1) - 1e-12).all()
    assert (curve.max(axis=1) <= control.max(axis=1) + 1e-12).all()


def disk() -> GBuffer:
    return disks((200, 200), (100.0, 100.0, 70.0, 50.0))


def test_a_steady_hand_follows_the_contour():
    strokes = strokes_of(disk(), STEADY)
    radius = np.hypot(*(strokes.points / MM - 100).T)
    # The near surface's pixels beside the jump, half a pixel inside; Bézier curves cut corners by a little.
    assert radius.min() > 66
    assert radius.max() < 70.5
    angle = np.sort(np.arctan2(*(strokes.points / MM - 100).T))
    assert np.diff(angle).max() < 0.05


@pytest.mark.parametrize("increment", [2, 4, 6, 10])
@pytest.mark.parametrize("interval", [0.3, 0.6, 1.5])
def test_strokes_begin_every_increment(increment, interval):
    hand = replace(STEADY, increment=increment, interval=interval, lengthening=0)
    strokes = strokes_of(disk(), hand)
    around = 2 * np.pi * 69.5 * MM
    # All round a loop, which has neither beginning nor end.
    assert len(strokes) == pytest.approx(around / (increment * interval), abs=0.5 + 0.01 * around / (increment * interval))
    firsts = strokes.points[strokes.offsets[:-1]]
    angle = np.sort(np.arctan2(*(firsts / MM - 100).T))
    apart = 69.5 * MM * np.diff(angle, append=angle[0] + 2 * np.pi)
    np.testing.assert_allclose(apart, increment * interval, rtol=0.1)
    length = arc_length(strokes.points, strokes.offsets)[strokes.offsets[1:] - 1]
    assert length.max() <= 15 * interval * 1.01


def test_strokes_do_not_pass_corners():
    """A square's contour is broken at its corners by the limit of turning."""
    gb = oracle.sheet((160, 160))
    gb.depth[:] = np.inf
    gb.depth[30:130, 30:130] = 50.0
    oracle.mark_edges(gb, np.isfinite(gb.depth))
    sharp = strokes_of(gb, replace(STEADY, turn=30.0, interval=0.3))
    for stroke in sharp:
        across = np.ptp(stroke.points, axis=0)
        assert min(across) < 0.5
    assert len(sharp) > 4


@pytest.mark.parametrize(
    ("change", "reach"),
    [
        ({"deviation": 1.5}, 1.5),
        ({"perturbation": 0.8}, 0.8 * np.sqrt(2)),
        ({"translation": 0.9}, 0.9),
        ({"lengthening": 1.2}, 1.2),
    ],
    ids=lambda v: next(iter(v)) if isinstance(v, dict) else "",
)
def test_the_hand_leaves_its_line_by_no_more_than_it_may(change, reach):
    steady, loose = (strokes_of(disk(), hand) for hand in (STEADY, replace(STEADY, **change)))
    assert len(steady) == len(loose)
    off = [np.linalg.norm(a.points[[0, -1]] - b.points[[0, -1]], axis=1) for a, b in zip(steady, loose, strict=True)]
    # Bézier curves begin and end on their control points.
    first, last = np.array(off).T
    assert last.max() <= reach + 1e-4
    assert last.max() > 0.3 * reach
    if "deviation" in change or "lengthening" in change:
        assert first.max() < 1e-4
    if "translation" in change:
        np.testing.assert_allclose(first, last, atol=1e-4)


def test_strokes_turn_about_their_beginning():
    steady, loose = (strokes_of(disk(), hand) for hand in (STEADY, replace(STEADY, rotation=13.0)))
    turns = []
    for a, b in zip(steady, loose, strict=True):
        np.testing.assert_allclose(a.points[0], b.points[0], atol=1e-4)
        u, v = (s.points[-1].astype(float) - s.points[0] for s in (a, b))
        assert np.linalg.norm(u) == pytest.approx(np.linalg.norm(v), rel=1e-3)
        turns.append(np.degrees(np.arctan2(u[0] * v[1] - u[1] * v[0], u @ v)))
    assert np.abs(turns).max() <= 13.01
    assert np.ptp(turns) > 13


def test_strokes_are_lighter_in_the_light_and_on_dark_paper_in_the_dark():
    for bright in (False, True):
        widths = []
        for light in (0.1, 0.9):
            gb = disks((200, 200), (100.0, 100.0, 70.0, 50.0))
            gb.light[..., 1] = light
            gb.light[..., [0, 2]] = 0
            lit = GBuffer(**{name: getattr(gb, name) for name in gb.__dataclass_fields__})
            widths.append(float(hand_strokes(lit, STEADY, MM, width=0.4, bright=bright).width.max()))
        assert (widths[1] > widths[0]) is bright


def test_a_seed_decides_every_byte(monkeypatch):
    gb = disk()
    a = strokes_of(gb, Hand(), 7)
    monkeypatch.setenv("INTAGLIO_THREADS", "3")
    b, c = strokes_of(gb, Hand(), 7), strokes_of(gb, Hand(), 8)
    assert a.points.tobytes() == b.points.tobytes()
    assert a.width.tobytes() == b.width.tobytes()
    assert a.points.tobytes() != c.points.tobytes()


def drawn(gb: GBuffer, kept: Beginnings | None = None, hand: Hand | None = None) -> tuple[Strokes, Beginnings]:
    return drawn_by_hand(gb, hand or Hand(), MM, width=0.4, kept=kept)


def test_seen_again_a_hand_does_the_same():
    """From the same place, strokes begin where they did, by the same chance; also if beginnings come in another order."""
    gb = disks((200, 200), (70.0, 100.0, 50.0, 50.0), (130.0, 90.0, 50.0, 70.0))
    first, kept = drawn(gb)
    order = np.random.default_rng(0).permutation(len(kept.number))
    again, found = drawn(gb, Beginnings(kept.place[order], kept.way[order], kept.number[order]))
    assert found.number.tolist() == sorted(kept.number.tolist())
    # To the next point of the line, a pixel away; and chains differ by nothing else.
    assert np.abs(found.place - kept.place).max() < 0.8
    assert len(again) == len(first)
    other, _ = drawn(gb, Beginnings(kept.place, kept.way, kept.number[::-1].copy()))
    same, unlike = (
        np.mean([np.linalg.norm(a.points[-1] - b.points[-1]) for a, b in zip(first, strokes, strict=True)])
        for strokes in (again, other)
    )
    assert same < 0.15
    assert unlike > 3 * same


def test_strokes_stay_on_a_contour_that_moves_and_grows():
    """A disk that slides by 4 pixels and grows by a tenth: nearly all strokes stay, each where it was on the circle."""
    _, before = drawn(disks((240, 240), (110.0, 120.0, 80.0, 50.0)), hand=STEADY)
    now, after = drawn(disks((240, 240), (114.0, 120.0, 88.0, 50.0)), before, STEADY)
    common = np.intersect1d(before.number, after.number)
    assert len(common) >= 0.9 * len(before.number)
    angle = []
    for found, x in ((before, 110.0), (after, 114.0)):
        gb = oracle.sheet((240, 240))
        place = gb.camera.project(found.place)[np.argsort(found.number)[np.isin(np.sort(found.number), common)]]
        angle.append(np.arctan2(place[:, 1] - 120.0, place[:, 0] - x))
    assert np.abs(np.angle(np.exp(1j * (angle[0] - angle[1])))).max() < np.radians(6)
    # The circle stays covered.
    around = np.sort(np.arctan2(*(now.points / MM - (114.0, 120.0)).T))
    assert np.diff(around).max() < 0.05


def test_contours_run_with_the_surface_on_their_left():
    gb = disk()
    turn = np.linspace(0, 2 * np.pi, 300)
    circle = (100 + 70 * np.stack([np.cos(turn), np.sin(turn)], axis=1)).astype(np.float32)
    for points in (circle, circle[::-1].copy()):
        x, y = surface_on_the_left(points, np.array([0, 300]), gb).T - 100
        # Counter-clockwise for one who looks at it, where y runs down.
        assert (x[:-1] * y[1:] - x[1:] * y[:-1]).sum() < 0


@given(st.integers(0, 2**31), st.integers(1, 4), st.floats(5, 300), st.booleans(), st.floats(1, 40), st.floats(1, 80))
@settings(deadline=None, max_examples=100)
def test_beginnings_leave_no_gap_and_do_not_crowd(seed, many, length, loop, step, reach):
    """Whatever is carried over: strokes are neither nearer than half a step nor farther than one and a half."""
    rng = np.random.default_rng(seed)
    turn = np.linspace(0, 2 * np.pi, 50)
    line = length / (2 * np.pi) * np.stack([np.cos(turn), np.sin(turn)], axis=1) if loop else np.stack([turn, turn], axis=1)
    line = (line * (length / np.linalg.norm(np.diff(line, axis=0), axis=1).sum())).astype(np.float32)
    lines = Lines(np.concatenate([line] * many), 50 * np.arange(many + 1), np.full(many, loop))
    old = [(int(rng.integers(many)), float(rng.uniform(0, lines.length[0])), k) for k in range(rng.integers(30))]
    rng.shuffle(old)
    of, along, number = begun(lines, step, reach, 0.6, [(int(a), float(b), int(c)) for a, b, c in old])
    assert len(set(number.tolist())) == len(number)
    assert number.max() < max(len(number), len(old))
    for k in range(many):
        at = np.sort(along[of == k])
        gaps = np.diff(at, append=at[0] + lines.length[k]) if loop else np.diff(at)
        assert len(at) > 0
        if len(gaps) > 1 or not loop:
            assert (gaps >= 0.5 * step - 1e-3).all()
        assert (gaps <= 1.5 * step + 1e-3).all()
        if not loop:
            assert at[0] == 0
            assert at[-1] + max(reach, step) >= lines.length[k] - 1e-3


def test_more_passes_close_gaps():
    gb = oracle.sheet((100, 200))
    gb.depth[:] = np.inf
    gb.depth[50:, :] = 50.0
    oracle.mark_edges(gb, np.isfinite(gb.depth))
    for k in range(4):
        gb.edge[:, k::20] = np.nan
    few, many = (len(strokes_of(gb, replace(STEADY, passes=n, shortest=0.5, points=16, increment=16))) for n in (0, 6))
    assert many < few


def test_specks_are_not_drawn():
    gb = disks((120, 120), *((x, y, 1.2, 50.0) for x in range(10, 120, 20) for y in range(10, 120, 20)))
    assert len(strokes_of(gb, replace(STEADY, shortest=4.0))) == 0


ODD = {
    "empty": lambda: GBuffer.empty(oracle.sheet((30, 40)).camera),
    "picture of one pixel": lambda: oracle.sheet((1, 1)),
    "one row": lambda: oracle.sheet((1, 60)),
    "one column": lambda: oracle.sheet((60, 1)),
    "flat": lambda: oracle.sheet((60, 80)),
    "one pixel": lambda: disks((20, 20), (10.5, 10.5, 0.6, 50.0)),
}


@pytest.mark.parametrize("case", ODD)
def test_odd_pictures(case):
    strokes = strokes_of(ODD[case](), Hand(shortest=0))
    assert np.isfinite(strokes.points).all()


@pytest.mark.parametrize(
    ("parameters", "message"),
    [
        ({"points": 17}, "hand's points must be between 2 and 16, not 17"),
        ({"interval": 0}, "hand's interval must be between 0.1 and 20, not 0"),
        ({"rotation": float("nan")}, "hand's rotation must be between 0 and 90, not nan"),
    ],
)
def test_parameters_that_make_no_sense_are_refused(parameters, message):
    with pytest.raises(InputError, match=message):
        Hand(**parameters)


def sound(drawing: Drawing) -> bool:
    names = [layer.name for layer in drawing.layers]
    return "contour" in names and not any("hatching" in name for name in names)


def test_contour_draws_no_hatching_and_takes_a_hand():
    ball = oracle.sampled(oracle.Sphere(12.0).field, (32, 32, 32))
    camera = Camera.looking("anterior", ball, 200)
    exact = contour(ball, iso=0.0, camera=camera, width_mm=40)
    by_hand = contour(ball, iso=0.0, camera=camera, width_mm=40, hand=Hand())
    assert sound(exact)
    assert sound(by_hand)
    assert len(exact.layers[-1].strokes) == 1
    assert len(by_hand.layers[-1].strokes) > 5


@pytest.mark.parametrize(
    ("file", "iso"),
    [("ct_head.nii.gz", 0.2), ("engine.nii.gz", 80.0), ("tooth.nhdr", 500.0), ("bonsai.nii.gz", 40.0), ("mr_head.nii.gz", 90.0)],
)
def test_real_scans_have_their_contours_covered(file, iso, shared):
    """Nearly all of the outline, which is exact, has a stroke beside it; and strokes lie on contours."""
    volume = read_volume(shared(f"volumes/{file}"))
    camera = surface_camera(volume, iso, (0.3, 0.9, 0.3), 400)
    gb = isosurface(volume, iso, camera, islands=ISLANDS)
    strokes = hand_strokes(gb, STEADY, 0.4, width=0.4)
    drawn = np.zeros(gb.depth.shape, dtype=bool)
    x, y = (strokes.points / 0.4).T.astype(int)
    drawn[np.clip(y, 0, drawn.shape[0] - 1), np.clip(x, 0, drawn.shape[1] - 1)] = True
    near = gaussian_filter(drawn.astype(np.float32), 2.5) > 0.01
    outline = np.zeros_like(drawn)
    for side in (0, 1):
        jump = (gb.edge[..., side] >= 0) & (gb.mask != np.roll(gb.mask, -1, 1 - side))
        outline |= jump
    assert near[outline].mean() > (0.85 if "bonsai" in file else 0.95)
    plate = draw_lines(gb, style("pencil"), width_mm=160)
    assert sound(plate)
