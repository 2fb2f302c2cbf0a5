"""Every example makes a picture, with and without real scans."""

from __future__ import annotations

import importlib
import sys
from pathlib import Path

import pytest

import intaglio as ig

EXAMPLES = Path(__file__).parent.parent / "examples"
DATA = EXAMPLES.parent.parent / "shared" / "data"
NAMES = sorted(p.stem for p in EXAMPLES.glob("*.py") if p.stem != "gallery" and p.stem[0] != "_")


@pytest.fixture(autouse=True)
def _path(monkeypatch):
    monkeypatch.setattr(sys, "path", [str(EXAMPLES), *sys.path])


def ink(plate: ig.Drawing | ig.Image) -> float:
    """Part of the picture that is not paper."""
    image = plate.image(40) if isinstance(plate, ig.Drawing) else plate
    paper = image.array[0, 0, :3]
    return float((abs(image.array[..., :3] - paper).max(axis=2) > 0.05).mean())


@pytest.mark.parametrize("name", NAMES)
@pytest.mark.parametrize("data", [None, DATA], ids=["embedded", "scans"])
def test_example(name, data):
    if data is not None and not data.is_dir():
        pytest.skip("shared/data is not beside the checkout")
    example = importlib.import_module(name)
    assert example.__doc__
    assert example.__doc__.strip().endswith(".")
    assert 0.05 < ink(example.make(data, 900)) < 0.95


def test_gallery_lists_them_all():
    gallery = importlib.import_module("gallery")
    assert [e.__name__ for e in gallery.examples()] == NAMES


def test_gallery_pictures_stay_small():
    gallery = importlib.import_module("gallery")
    example = importlib.import_module("pen_and_ink_head")
    assert len(gallery.reading_size(example.make(None, 900))) < 300_000
