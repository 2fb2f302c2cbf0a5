"""A coarse picture at once, finer ones while one waits."""

from __future__ import annotations

from collections.abc import Iterator, Sequence
from dataclasses import replace
from typing import Any

import numpy as np

from intaglio.camera import Camera
from intaglio.drawing import Image
from intaglio.errors import InputError
from intaglio.rendering.raycast import render
from intaglio.transfer_function import TransferFunction
from intaglio.volume import Volume


def refinements(
    volume: Volume,
    transfer_function: TransferFunction | None,
    camera: Camera,
    *,
    factors: Sequence[int] = (4, 2, 1),
    step: float = 0.5,
    **options: Any,
) -> Iterator[Image]:
    """Pictures of camera.size that get better: each with a ray for `factor` x `factor` pixels, enlarged.

    A picture is rendered when it is asked for, so whoever moves the camera stops asking; `progress=` cancels one that
    has begun, by raising. With a factor of 1 the picture is that of `render`; others take at most twice its step.
    """
    if not factors or not all(isinstance(f, int) and 1 <= f <= 64 for f in factors):
        raise InputError(f"factors must be whole numbers between 1 and 64, not {tuple(factors)!r}")
    width, height = camera.size
    for factor in factors:
        if factor == 1:
            yield render(volume, transfer_function, camera, step=step, **options)
            continue
        size = (-(-width // factor), -(-height // factor))
        coarse = replace(camera, size=size, pixel=camera.pixel * factor)
        array = render(volume, transfer_function, coarse, step=step * min(factor, 2), **options).array
        # Both pictures have the camera's axis in their middle.
        top, left = (size[1] * factor - height) // 2, (size[0] * factor - width) // 2
        array = _enlarged(_enlarged(array, factor, 0), factor, 1)
        yield Image(np.ascontiguousarray(array[top : top + height, left : left + width]))


def _enlarged(array: np.ndarray, factor: int, axis: int) -> np.ndarray:
    """Linear interpolation between pixel centres along one axis."""
    n = array.shape[axis]
    place = np.clip((np.arange(n * factor) + 0.5) / factor - 0.5, 0, n - 1)
    i = np.minimum(place.astype(np.int64), max(n - 2, 0))
    shape = [1] * array.ndim
    shape[axis] = -1
    u = (place - i).astype(np.float32).reshape(shape)
    return np.take(array, i, axis) * (1 - u) + np.take(array, np.minimum(i + 1, n - 1), axis) * u
