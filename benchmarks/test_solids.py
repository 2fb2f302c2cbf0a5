"""Meshes to voxels and distances, beside VTK, Open3D, libigl and mesh2sdf: the same mesh and grid, in the same run."""

from __future__ import annotations

import time
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest

import intaglio as ig
from intaglio.solid.scan_conversion import occupancy

DATA = Path(__file__).resolve().parents[1].parent / "shared" / "data" / "meshes"
SIZE, TRIAL = 256, 40


def split(mesh: ig.TriangleMesh) -> ig.TriangleMesh:
    """Every triangle cut into four by the middles of its sides."""
    t = mesh.triangles.astype(np.int64)
    ends = np.sort(np.concatenate([t[:, [0, 1]], t[:, [1, 2]], t[:, [2, 0]]]), axis=1)
    edges, which = np.unique(ends, axis=0, return_inverse=True)
    ab, bc, ca = which.reshape(3, -1) + len(mesh.vertices)
    a, b, c = t.T
    parts = [(a, ab, ca), (ab, b, bc), (ca, bc, c), (ab, bc, ca)]
    vertices = np.concatenate([mesh.vertices, mesh.vertices[edges].mean(axis=1)])
    return ig.TriangleMesh(vertices, np.concatenate([np.stack(p, axis=1) for p in parts]), f"{mesh.name}, split")


@pytest.fixture(scope="module", params=["bunny_watertight.obj", "armadillo.obj", "armadillo.obj, split", "skull.obj"])
def mesh(request):
    if request.param != "bunny_watertight.obj" and not request.config.option.benchmark_enable:
        pytest.skip("larger meshes are for timing")
    path = DATA / request.param.removesuffix(", split")
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the checkout")
    return split(ig.read_mesh(path)) if "split" in request.param else ig.read_mesh(path)


def cube(mesh: ig.TriangleMesh, benchmark: Any, size: int = SIZE) -> ig.Volume:
    """A cubic grid, the mesh's longest extent and 5 % on each side wide; a small one where nothing is timed."""
    size = size if benchmark.enabled else TRIAL
    low, high = mesh.vertices.min(axis=0), mesh.vertices.max(axis=0)
    side = 1.1 * (high - low).max()
    return ig.Volume.from_array(np.broadcast_to(np.False_, (size,) * 3), side / (size - 1), (low + high - side) / 2)


def seconds(function: Callable[[], Any], rounds: int = 1) -> tuple[float, Any]:
    """The least time of several rounds, and what came out."""
    best = np.inf
    for _ in range(rounds):
        begun = time.perf_counter()
        result = function()
        best = min(best, time.perf_counter() - begun)
    return float(best), result


def places(volume: ig.Volume, which: Any) -> np.ndarray:
    """(n, 3) float32 positions of chosen voxels."""
    z, y, x = (np.indices(volume.shape, dtype=np.float32, sparse=True)[k] for k in range(3))
    axes = [np.broadcast_to(c, volume.shape)[which].ravel() for c in (x, y, z)]
    return np.stack(axes, axis=-1) * volume.spacing.astype(np.float32) + volume.world_from_index[:3, 3].astype(np.float32)


def open3d_scene(mesh: ig.TriangleMesh):
    open3d = pytest.importorskip("open3d")
    scene = open3d.t.geometry.RaycastingScene()
    scene.add_triangles(mesh.vertices.astype(np.float32), mesh.triangles.astype(np.uint32))
    return scene


def vtk_stencil(mesh: ig.TriangleMesh, like: ig.Volume) -> Callable[[], np.ndarray]:
    vtk = pytest.importorskip("vtk")
    from vtk.util.numpy_support import numpy_to_vtk, numpy_to_vtkIdTypeArray, vtk_to_numpy

    poly, points, cells = vtk.vtkPolyData(), vtk.vtkPoints(), vtk.vtkCellArray()
    points.SetData(numpy_to_vtk(mesh.vertices, deep=True))
    rows = np.insert(mesh.triangles.astype(np.int64), 0, 3, axis=1)
    cells.ImportLegacyFormat(numpy_to_vtkIdTypeArray(rows.ravel(), deep=True))
    poly.SetPoints(points)
    poly.SetPolys(cells)
    n = like.shape[0]

    def run() -> np.ndarray:
        stencil = vtk.vtkPolyDataToImageStencil()
        stencil.SetInputData(poly)
        stencil.SetOutputSpacing(*like.spacing)
        stencil.SetOutputOrigin(*like.world_from_index[:3, 3])
        stencil.SetOutputWholeExtent(0, n - 1, 0, n - 1, 0, n - 1)
        image = vtk.vtkImageStencilToImage()
        image.SetInputConnection(stencil.GetOutputPort())
        image.SetOutputScalarTypeToUnsignedChar()
        image.Update()
        return vtk_to_numpy(image.GetOutput().GetPointData().GetScalars()).reshape(n, n, n)

    return run


def test_voxelize(benchmark, mesh):
    like = cube(mesh, benchmark)
    ig.voxelize(mesh, resolution=16)
    ours, voxels = seconds(lambda: ig.voxelize(mesh, like=like), 7)
    benchmark.pedantic(ig.voxelize, (mesh,), {"like": like}, rounds=1)
    vtk, other = seconds(vtk_stencil(mesh, like))
    scene = open3d_scene(mesh)
    points = places(like, np.s_[:])
    open3d, third = seconds(lambda: scene.compute_occupancy(points).numpy().reshape(like.shape))
    benchmark.extra_info |= {
        "triangles": len(mesh.triangles),
        "our seconds": ours,
        "vtk seconds": vtk,
        "open3d seconds": open3d,
        "times faster than vtk": vtk / ours,
        "times faster than open3d": open3d / ours,
        "voxels unlike vtk": int((voxels.array != (other > 0)).sum()),
        "voxels unlike open3d": int((voxels.array != (third > 0)).sum()),
    }
    # The rule for centres on the surface is each library's own; this mesh has few.
    assert (voxels.array != (third > 0)).mean() < 1e-4


@pytest.mark.parametrize("band", [0.01, 0.05, 0.1, "full"])
def test_distance(benchmark, mesh, band):
    """Open3D is given the band's voxels for free; of the full grid it gets every fourth voxel along each axis."""
    like = cube(mesh, benchmark)
    ig.distance_field(mesh, resolution=16)
    ours, field = seconds(lambda: ig.distance_field(mesh, like=like, band=band), 5)
    benchmark.pedantic(ig.distance_field, (mesh,), {"like": like, "band": band}, rounds=1)
    width = np.inf if band == "full" else band * np.ptp(mesh.vertices, axis=0).max() * (1 - 1e-6)
    which = np.s_[::4, ::4, ::4] if band == "full" else np.abs(field.array) < width
    points = places(like, which)
    scene = open3d_scene(mesh)
    open3d, other = seconds(lambda: scene.compute_signed_distance(points).numpy())
    open3d *= like.array.size / len(points) if band == "full" else 1
    error = np.abs(np.abs(field.array[which].ravel()) - np.abs(other))
    benchmark.extra_info |= {
        "triangles": len(mesh.triangles),
        "voxels in the band": int((np.abs(field.array) < width).sum()),
        "our seconds": ours,
        "open3d seconds": open3d,
        "times faster than open3d": open3d / ours,
        "largest difference, of the extent": float(error.max() / np.ptp(mesh.vertices, axis=0).max()),
    }
    assert error.max() < 1e-5 * np.ptp(mesh.vertices, axis=0).max()


def test_distance_elsewhere(benchmark):
    """libigl on a band of one percent, mesh2sdf on a full field of 128^3."""
    igl, mesh2sdf = pytest.importorskip("igl"), pytest.importorskip("mesh2sdf")
    path = DATA / "bunny_watertight.obj"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the checkout")
    mesh = ig.read_mesh(path)
    like = cube(mesh, benchmark)
    ig.distance_field(mesh, resolution=16)
    band, field = seconds(lambda: ig.distance_field(mesh, like=like, band=0.01), 5)
    points = places(like, np.abs(field.array) < 0.00999999 * np.ptp(mesh.vertices, axis=0).max()).astype(np.float64)
    libigl, _ = seconds(lambda: igl.signed_distance(points, mesh.vertices, mesh.triangles.astype(np.int64)))
    small = cube(mesh, benchmark, 128)
    full, _ = seconds(lambda: ig.distance_field(mesh, like=small, band="full"), 5)
    unit = (mesh.vertices - like.corners.mean(axis=0)) / np.ptp(like.corners, axis=0).max() * 2
    sdf, _ = seconds(lambda: mesh2sdf.core.compute(unit.astype(np.float32), mesh.triangles, small.shape[0]))
    benchmark.pedantic(ig.distance_field, (mesh,), {"like": like, "band": 0.01}, rounds=1)
    benchmark.extra_info |= {
        "our seconds, band": band,
        "libigl seconds, band": libigl,
        "our seconds, full 128": full,
        "mesh2sdf seconds, full 128": sdf,
    }


@pytest.mark.parametrize("size", [64, 128, 256, 512, 1024])
def test_growth_with_resolution(benchmark, size):
    if size > 64 and not benchmark.enabled:
        pytest.skip("larger grids are for timing")
    path = DATA / "bunny_watertight.obj"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the checkout")
    mesh = ig.read_mesh(path)
    like = cube(mesh, benchmark, size)
    ig.distance_field(mesh, resolution=16)
    benchmark.extra_info["voxels"] = seconds(lambda: occupancy(mesh, like.shape, like.world_from_index), 3)[0]
    if size <= 512:
        for band in (0.05, "full"):
            benchmark.extra_info[f"distance, {band}"] = seconds(lambda: ig.distance_field(mesh, like=like, band=band), 2)[0]  # noqa: B023
    benchmark.pedantic(occupancy, (mesh, like.shape, like.world_from_index), rounds=1)


@pytest.mark.parametrize("times", [0, 1, 2])
def test_growth_with_triangles(benchmark, times):
    if times and not benchmark.enabled:
        pytest.skip("larger meshes are for timing")
    path = DATA / "armadillo.obj"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the checkout")
    mesh = ig.read_mesh(path)
    for _ in range(times):
        mesh = split(mesh)
    like = cube(mesh, benchmark)
    ig.distance_field(mesh, resolution=16)
    benchmark.extra_info["triangles"] = len(mesh.triangles)
    benchmark.extra_info["voxels"] = seconds(lambda: ig.voxelize(mesh, like=like), 3)[0]
    for band in (0.01, 0.05, "full"):
        benchmark.extra_info[f"distance, {band}"] = seconds(lambda: ig.distance_field(mesh, like=like, band=band), 2)[0]  # noqa: B023
    benchmark.pedantic(ig.voxelize, (mesh,), {"like": like}, rounds=1)
