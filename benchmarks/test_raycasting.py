"""Direct volume rendering against VTK's ray casters: same volume, transfer function, picture size and step, same run.

The error of each is against its own picture at an eighth of the step: what is compared is the integral, not the light model.
"""

from __future__ import annotations

import time
from pathlib import Path

import numpy as np
import pytest

import intaglio as ig

DATA = Path(__file__).parents[2] / "shared" / "data" / "volumes"
SIZE = 512
# Value as a part of the range, colour, opacity per voxel.
FUNCTIONS = {
    "surface": [
        (0.0, (0.9, 0.7, 0.5), 0.0),
        (0.18, (0.9, 0.7, 0.5), 0.0),
        (0.28, (0.9, 0.7, 0.5), 0.7),
        (1.0, (1.0, 1.0, 0.95), 0.95),
    ],
    "fog": [
        (0.0, (0.5, 0.6, 1.0), 0.0),
        (0.02, (0.5, 0.6, 1.0), 0.0),
        (0.3, (0.9, 0.7, 0.5), 0.012),
        (1.0, (1.0, 1.0, 0.95), 0.04),
    ],
}


def blobs() -> ig.Volume:
    """256 cubed float32: a lumpy ball in empty space."""
    n = 256
    axis = np.linspace(-1, 1, n, dtype=np.float32)
    z, y, x = axis[:, None, None], axis[None, :, None], axis[None, None, :]
    wave = np.sin(19 * x + 2 * y) * np.sin(18 * y - 3 * z) * np.sin(17 * z + x)
    return ig.Volume.from_array(np.clip(1.1 - 1.2 * np.sqrt(x * x + y * y + z * z) + 0.12 * wave, 0, 1).astype(np.float32))


@pytest.fixture(scope="module", params=["ct_head", "engine", "bonsai", "float256"])
def volume(request):
    if request.param == "float256":
        return blobs()
    path = DATA / f"{request.param}.nii.gz"
    if not path.exists():
        pytest.skip(f"{path.name} is not beside the checkout")
    return ig.read_volume(path)


def transfer_function(volume: ig.Volume, name: str) -> ig.TransferFunction:
    low, high = volume.range
    points = [(low + part * (high - low), colour, opacity) for part, colour, opacity in FUNCTIONS[name]]
    return ig.TransferFunction.from_points(points)


def vtk_frame(volume: ig.Volume, name: str, camera: ig.Camera, step: float, mapper_name: str):
    """A function that draws a frame anew and returns its seconds, and one that returns the picture (h, w, 3)."""
    import vtk
    from vtk.util.numpy_support import numpy_to_vtk, vtk_to_numpy

    z, y, x = volume.shape
    image = vtk.vtkImageData()
    image.SetDimensions(x, y, z)
    image.GetPointData().SetScalars(numpy_to_vtk(np.ascontiguousarray(volume.array).ravel(), deep=True))
    low, high = volume.range
    colour, opacity = vtk.vtkColorTransferFunction(), vtk.vtkPiecewiseFunction()
    for part, rgb, alpha in FUNCTIONS[name]:
        value = low + part * (high - low)
        colour.AddRGBPoint(value, *rgb)
        opacity.AddPoint(value, alpha)
    look = vtk.vtkVolumeProperty()
    look.SetColor(colour)
    look.SetScalarOpacity(opacity)
    look.SetInterpolationTypeToLinear()
    look.ShadeOn()
    mapper = getattr(vtk, mapper_name)()
    mapper.SetInputData(image)
    mapper.SetSampleDistance(step)
    mapper.SetAutoAdjustSampleDistances(0)
    if hasattr(mapper, "SetInteractiveSampleDistance"):
        mapper.SetInteractiveSampleDistance(step)
        mapper.SetImageSampleDistance(1.0)
    actor = vtk.vtkVolume()
    actor.SetMapper(mapper)
    actor.SetProperty(look)
    matrix = vtk.vtkMatrix4x4()
    for i in range(4):
        for j in range(4):
            matrix.SetElement(i, j, volume.world_from_index[i, j])
    actor.SetUserMatrix(matrix)
    renderer = vtk.vtkRenderer()
    renderer.SetBackground(1, 1, 1)
    renderer.AddVolume(actor)
    window = vtk.vtkRenderWindow()
    window.SetOffScreenRendering(1)
    window.SetSize(*camera.size)
    window.AddRenderer(renderer)
    eye = renderer.GetActiveCamera()
    eye.ParallelProjectionOn()
    eye.SetPosition(*camera.eye)
    eye.SetFocalPoint(*(camera.eye + camera.forward))
    eye.SetViewUp(*camera.up)
    eye.SetParallelScale(camera.pixel * camera.size[1] / 2)
    renderer.ResetCameraClippingRange()

    def frame() -> float:
        actor.Modified()
        look.Modified()
        eye.Modified()
        begun = time.perf_counter()
        window.Render()
        return time.perf_counter() - begun

    def picture():
        grab = vtk.vtkWindowToImageFilter()
        grab.SetInput(window)
        grab.ReadFrontBufferOff()
        grab.Update()
        pixels = vtk_to_numpy(grab.GetOutput().GetPointData().GetScalars()).reshape(camera.size[1], camera.size[0], -1)
        return pixels[::-1, :, :3].astype(np.float32) / 255

    frame()
    return frame, picture


@pytest.mark.parametrize("name", list(FUNCTIONS))
@pytest.mark.parametrize("classify", ["post", "preintegrated", "pre"])
def test_render(benchmark, volume, name, classify):
    camera = ig.Camera.looking("anterior-left", at=volume, size=(SIZE, SIZE))
    tf = transfer_function(volume, name)
    benchmark(ig.render, volume, tf, camera, classify=classify)


@pytest.mark.parametrize("name", list(FUNCTIONS))
def test_against_vtk_on_software_gl(benchmark, volume, name):
    """VTK's GPU mapper, which PyVista takes too, on whatever draws OpenGL here: without a graphics card, the processor."""
    pytest.importorskip("vtk")
    camera = ig.Camera.looking("anterior-left", at=volume, size=(SIZE, SIZE))
    tf = transfer_function(volume, name)
    frame, _ = vtk_frame(volume, name, camera, 0.5 * float(volume.spacing.min()), "vtkOpenGLGPUVolumeRayCastMapper")
    theirs = float(np.median([frame() for _ in range(3)]))
    benchmark.pedantic(ig.render, (volume, tf, camera), rounds=3, warmup_rounds=1)
    if benchmark.stats:
        ours = float(benchmark.stats.stats.median)
        benchmark.extra_info |= {"vtk seconds": theirs, "our seconds": ours, "times faster": theirs / ours}


@pytest.mark.parametrize("name", list(FUNCTIONS))
def test_against_vtk(benchmark, volume, name):
    pytest.importorskip("vtk")
    camera = ig.Camera.looking("anterior-left", at=volume, size=(SIZE, SIZE))
    tf = transfer_function(volume, name)
    step = 0.5 * float(volume.spacing.min())
    mapper = "vtkFixedPointVolumeRayCastMapper"
    frame, picture = vtk_frame(volume, name, camera, step, mapper)
    _, converged = vtk_frame(volume, name, camera, step / 8, mapper)
    ig.render(volume, tf, camera)
    ours, theirs = [], []
    # By turns, so that what else the machine does meets both.
    for _ in range(9):
        begun = time.perf_counter()
        image = ig.render(volume, tf, camera)
        ours.append(time.perf_counter() - begun)
        theirs.append(frame())
    benchmark.pedantic(ig.render, (volume, tf, camera), rounds=1)
    reference = ig.render(volume, tf, camera, step=0.0625)
    benchmark.extra_info |= {
        "vtk seconds": float(np.median(theirs)),
        "our seconds": float(np.median(ours)),
        "times faster": float(np.median(theirs) / np.median(ours)),
        "our error": float(np.sqrt(np.mean((image.array[..., :3] - reference.array[..., :3]) ** 2))),
        "vtk error": float(np.sqrt(np.mean((picture() - converged()) ** 2))),
        "pictures differ": float(np.sqrt(np.mean((picture() - image.array[..., :3]) ** 2))),
    }
