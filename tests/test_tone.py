"""Tone: the layers share it out, and what is printed is what was asked for."""

from __future__ import annotations

from itertools import pairwise

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st
from scipy import ndimage
from test_hatching import MM, PIXELS, PLATE, each_style, grey, plain

from intaglio import GBuffer, Hatching, body_surface, draw, isosurface, read_volume, surface_camera
from intaglio.datasets import head
from intaglio.ink.hatching import darkness, tones
from intaglio.ink.styles import style
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL


@each_style
def test_tones_rise_one_after_the_other(name):
    plan = tones(style(name))
    for tone in plan:
        assert 0 <= tone.begin < tone.end <= 1
    for before, after in pairwise(plan):
        assert after.begin == pytest.approx(before.end)
    assert plan[0].begin == 0


@settings(deadline=None, max_examples=60)
@given(st.floats(0.3, 5), st.integers(1, 4), st.integers(0, 4), st.floats(0.05, 0.3), st.floats(0.1, 1))
def test_tones_of_any_layers_stay_within_paper_and_ink(separation, layers, crosshatch, thickest, opacity):
    plan = tones(
        Hatching(separation=separation, layers=layers, crosshatch=crosshatch, thickest=thickest, opacity=opacity, thinnest=0.01)
    )
    assert len(plan) <= layers + crosshatch
    ends = [tone.end for tone in plan]
    assert (np.diff(ends) >= 0).all()
    assert 0 < ends[0] <= ends[-1] <= 1
    for tone in plan:
        assert tone.begin <= tone.end
    # The ink of the first layer: a line of the greatest width every separation, as near as lines are laid.
    assert ends[0] == pytest.approx(min(1, thickest * opacity / separation), rel=0.2)


@each_style
def test_darkness_answers_light(name):
    hatching = plain(name)
    asked = [darkness(oracle.sheet((5, 5), light=light), hatching, MM)[2, 2] for light in np.linspace(0, 1, 21)]
    assert (np.diff(asked) <= 0).all()
    assert asked[0] == pytest.approx(tones(hatching)[-1].end)
    assert asked[-1] == 0
    empty = GBuffer.empty(oracle.sheet((5, 5)).camera)
    assert (darkness(empty, hatching, MM) == 0).all()


def test_hollows_are_darker():
    gb = oracle.sheet((9, 9), pixel=MM)
    flat = darkness(gb, Hatching(hollows=0.3), MM)[4, 4]
    gb.curvature[..., 1] = -0.5
    assert darkness(gb, Hatching(hollows=0.3), MM)[4, 4] > flat
    assert darkness(gb, Hatching(hollows=0.0), MM)[4, 4] == flat


@each_style
def test_printed_tone_is_requested_tone(name):
    """A ramp of flat sheets; the border of a sheet, where strokes end, does not count."""
    hatching = plain(name)
    inner = slice(50, -50)
    requested, printed = [], []
    for light in np.linspace(hatching.white, hatching.black, 10):
        gb = oracle.sheet((PIXELS, PIXELS), light=light)
        requested.append(darkness(gb, hatching, MM)[PIXELS // 2, PIXELS // 2])
        printed.append(grey(draw(gb, hatching, width_mm=PLATE), MM)[inner, inner].mean())
    assert (np.diff(printed) > 0).all()
    error = np.abs(np.array(printed) - requested)
    assert error.mean() < 0.025
    # Lines thinner than a pen can draw are left out or drawn as thin as it can; ink over ink is lost.
    assert error.max() < 0.06
    assert printed[0] == 0


@each_style
def test_a_ramp_prints_as_a_ramp(name):
    """One sheet from white to black: the mean of every eighth of it is as dark as asked, and darker than the last."""
    hatching = plain(name)
    width, height = 900, 300
    gb = oracle.sheet((height, width), light=np.broadcast_to(np.linspace(hatching.white, hatching.black, width), (height, width)))
    asked = darkness(gb, hatching, MM)
    printed = grey(draw(gb, hatching, width_mm=width * MM), MM)
    parts = [tone[20:-20, 10:-10].mean(axis=0).reshape(8, -1).mean(axis=1) for tone in (asked, printed)]
    assert (np.diff(parts[1]) > 0.01).all()
    np.testing.assert_allclose(*parts, atol=0.05)
    assert np.abs(parts[0] - parts[1]).mean() < 0.025


def assert_prints_what_is_asked(gb: GBuffer, name: str, mm: float) -> None:
    hatching = plain(name)
    asked = darkness(gb, hatching, mm).astype(np.float64)
    printed = grey(draw(gb, hatching, width_mm=gb.camera.size[0] * mm), mm)[: asked.shape[0], : asked.shape[1]]
    # Seen from as far that 3 mm flow together.
    near = ndimage.gaussian_filter(gb.mask.astype(float), 15)
    a, b = (ndimage.gaussian_filter(np.where(gb.mask, tone, 0.0), 15) / np.maximum(near, 1e-3) for tone in (asked, printed))
    inner = gb.mask & (near > 0.7)
    assert np.abs(a - b)[inner].mean() < 0.04
    # What lies between two contours nearer to one another than a line is wide cannot be as dark as it is asked to be.
    assert np.corrcoef(a[inner], b[inner])[0, 1] > (0.96 if hatching.thickest < 1.5 else 0.94)
    # Paper beside the body stays white, but for half the width of a stroke.
    beside = 2 + round(0.5 * hatching.thickest / mm)
    assert printed[ndimage.binary_erosion(~gb.mask, iterations=beside)].max() < 0.01
    # Tones are in order: where twelfths of them are asked for, so they are printed.
    step = np.clip(a[inner] / a[inner].max() * 12, 0, 11).astype(int)
    many = np.bincount(step, minlength=12)
    mean = np.bincount(step, b[inner], minlength=12)[many > 400] / many[many > 400]
    assert (np.diff(mean) > 0).all()


@each_style
@pytest.mark.parametrize("body", [oracle.Torus(15.0, 7.0), oracle.Sphere(18.0)], ids=["torus", "sphere"])
def test_printed_tone_is_requested_tone_on_round_bodies(name, body):
    volume = oracle.sampled(body.field, (48, 60, 60))
    camera = surface_camera(volume, 0.0, (1, 1, 3), 500)
    assert_prints_what_is_asked(isosurface(volume, 0.0, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL), name, 0.2)


@each_style
@pytest.mark.parametrize("scan", ["embedded", "volumes/ct_head.nii.gz"])
def test_printed_tone_is_requested_tone_on_a_head(name, scan, shared):
    volume = head() if scan == "embedded" else read_volume(shared(scan))
    iso = body_surface(volume)[0] if scan == "embedded" else 0.2
    camera = surface_camera(volume, iso, "anterior-left", 500)
    assert_prints_what_is_asked(isosurface(volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL), name, 0.2)
