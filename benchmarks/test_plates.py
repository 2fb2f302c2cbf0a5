"""From a volume in memory to strokes and to files, stage by stage; the reference is Gerl's table (GeForce 7600 GT, 512 px)."""

from __future__ import annotations

from pathlib import Path

import pytest

import intaglio as ig
from intaglio.ink.styles import style
from intaglio.plate import PLATE_LIGHTS, PLATE_MATERIAL

DATA = Path(__file__).parents[2] / "shared" / "data" / "volumes"
SCANS = {"engine": ("engine.nii.gz", 80.0, (0.5, 0.6, 0.5)), "ct_head": ("ct_head.nii.gz", 0.2, "anterior")}


@pytest.fixture(scope="module", params=list(SCANS))
def scan(request):
    name, iso, view = SCANS[request.param]
    if not (DATA / name).exists():
        pytest.skip(f"{name} is not beside the checkout")
    return ig.read_volume(DATA / name), iso, view


@pytest.mark.parametrize("size", [512, 1024])
def test_gbuffer(benchmark, scan, size):
    volume, iso, view = scan
    camera = ig.surface_camera(volume, iso, view, (size, size))
    benchmark(ig.isosurface, volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL, islands=0.01)


@pytest.mark.parametrize("size", [512, 1024])
@pytest.mark.parametrize("name", ig.styles())
def test_strokes(benchmark, scan, name, size):
    volume, iso, view = scan
    camera = ig.surface_camera(volume, iso, view, (size, size))
    gb = ig.isosurface(volume, iso, camera, lights=PLATE_LIGHTS, material=PLATE_MATERIAL)
    plate = benchmark(ig.draw, gb, style(name))
    benchmark.extra_info["strokes"] = sum(len(layer.strokes) for layer in plate.layers)


@pytest.mark.parametrize("size", [512, 1024])
@pytest.mark.parametrize("name", ig.styles())
def test_volume_to_plate(benchmark, scan, name, size):
    volume, iso, view = scan

    def run():
        camera = ig.surface_camera(volume, iso, view, (size, size))
        return ig.hatch(volume, iso=iso, camera=camera, style=name)

    benchmark(run)


@pytest.mark.parametrize("extension", ["svg", "pdf", "png"])
def test_saving(benchmark, scan, tmp_path, extension):
    volume, iso, view = scan
    plate = ig.hatch(volume, iso=iso, camera=ig.surface_camera(volume, iso, view, 1024), style="pen-and-ink")
    path = tmp_path / f"plate.{extension}"
    benchmark(plate.save, path, dpi=160)
    benchmark.extra_info["bytes"] = path.stat().st_size
