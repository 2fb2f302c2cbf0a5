"""Fields and surfaces against the libraries that make them: same volume, same run; medians of rounds taken in turn."""

from __future__ import annotations

import time
from collections.abc import Callable
from typing import Any

import numpy as np
import pytest

import intaglio as ig
from intaglio.compute import thread_count


def waves(n: int) -> ig.Volume:
    """A field with a winding surface that fills the grid, about 1 in slope."""
    z, y, x = (np.arange(n, dtype=np.float32).reshape(shape) * (256 / n) for shape in ((n, 1, 1), (1, n, 1), (1, 1, n)))
    return ig.Volume.from_array((7 * (np.sin(x / 9) * np.sin(y / 8) * np.sin(z / 10) - 0.2)).astype(np.float32), 256 / n)


def ball(n: int) -> ig.Volume:
    z, y, x = (np.arange(n, dtype=np.float32).reshape(shape) - 0.49 * n for shape in ((n, 1, 1), (1, n, 1), (1, 1, n)))
    return ig.Volume.from_array(np.sqrt(x * x + y * y + z * z) - np.float32(0.31 * n))


FIELDS = {"ball": ball, "waves": waves}


@pytest.fixture(scope="module", params=FIELDS)
def make(request):
    return FIELDS[request.param]


def compare(benchmark: Any, rounds: int, ours: Callable[[], Any], **theirs: Callable[[], Any]) -> None:
    """Median seconds of each, one after the other in every round, so that all meet the same weather."""
    jobs = {"ours": ours, **theirs}
    seconds: dict[str, list[float]] = {name: [] for name in jobs}
    for turn in range(1 if benchmark.disabled else rounds + 1):
        for name, job in jobs.items():
            begun = time.perf_counter()
            job()
            if turn:
                seconds[name].append(time.perf_counter() - begun)
    if not benchmark.disabled:
        benchmark.extra_info |= {name: float(np.median(s)) for name, s in seconds.items()}
    benchmark.pedantic(ours, rounds=1)


def side(benchmark: Any, n: int) -> int:
    """Small when only tested."""
    return 48 if benchmark.disabled else n


@pytest.mark.parametrize("n", [256, 512])
def test_signed_distance(benchmark, make, n):
    """Ours gives both signs; edt and scipy the inside only."""
    edt = pytest.importorskip("edt")
    from scipy import ndimage

    volume = make(side(benchmark, n))
    mask = ig.Volume(volume.array < 0, volume.world_from_index)
    peers = {
        "edt": lambda: edt.edt(mask.array, anisotropy=(1, 1, 1), parallel=thread_count()),
        "edt sdf": lambda: edt.sdf(mask.array, anisotropy=(1, 1, 1), parallel=thread_count()),
    }
    if n == 256:
        peers["scipy"] = lambda: ndimage.distance_transform_edt(mask.array)
    compare(benchmark, 3, lambda: ig.signed_distance(mask), **peers)


def test_surface(benchmark, make):
    vtk = pytest.importorskip("vtk")
    measure = pytest.importorskip("skimage.measure")
    from vtk.util.numpy_support import numpy_to_vtk

    volume = make(side(benchmark, 256))
    z, y, x = volume.shape
    image = vtk.vtkImageData()
    image.SetDimensions(x, y, z)
    image.GetPointData().SetScalars(numpy_to_vtk(volume.array.ravel()))

    def flying_edges() -> None:
        contour = vtk.vtkFlyingEdges3D()
        contour.SetInputData(image)
        contour.SetValue(0, 0.0)
        contour.ComputeNormalsOn()
        contour.Update()

    compare(
        benchmark,
        5,
        lambda: ig.surface(volume),
        scikit_image=lambda: measure.marching_cubes(volume.array, 0.0),
        vtk_flying_edges=flying_edges,
    )


def test_redistance(benchmark, make):
    skfmm = pytest.importorskip("skfmm")
    volume = make(side(benchmark, 128))
    if not benchmark.disabled and make is ball:
        for name, found in (("our error", ig.redistance(volume).array), ("skfmm error", skfmm.distance(volume.array))):
            benchmark.extra_info[name] = float(np.abs(found - volume.array).max())
    compare(benchmark, 3, lambda: ig.redistance(volume), skfmm=lambda: skfmm.distance(volume.array))


def test_combine(benchmark, make):
    volume = make(side(benchmark, 256))
    turn = np.eye(4)
    turn[:2, :2] = [[0.8, -0.6], [0.6, 0.8]]
    other = ig.Volume(volume.array, turn @ volume.world_from_index)
    benchmark(ig.difference, volume, other, smooth=2.0)
