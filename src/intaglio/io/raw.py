"""Raw voxels: shape, type and spacing come from the caller."""

from __future__ import annotations

from collections.abc import Sequence
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import ArrayLike, DTypeLike, NDArray

from intaglio.errors import InputError
from intaglio.io.geometry import NO_ORIENTATION, Matrix, world_from_index
from intaglio.io.limits import check_memory, check_payload, check_shape, check_spacing
from intaglio.io.payload import is_gzip, opened, read_slices

if TYPE_CHECKING:
    from intaglio.compute import Progress

Raw = tuple[Sequence[int], DTypeLike, ArrayLike]


def read_raw(path: Path, raw: Raw, *, progress: Progress | None = None) -> tuple[NDArray[Any], Matrix, list[str]]:
    """Array (z, y, x), world_from_index and notes of a .raw or .raw.gz file; raw as in read_volume."""
    name = path.name
    try:
        shape, kind, spacing = raw
        x, y, z = (int(n) for n in shape)
        stored = np.dtype(kind)
        step = [float(s) for s in np.broadcast_to(np.asarray(spacing, dtype=np.float64), (3,))]
    except (TypeError, ValueError) as error:
        raise InputError(f"{name}: raw must be ((x, y, z), dtype, spacing), not {raw!r} ({error})") from None
    if stored.kind not in "biuf" or stored.itemsize > 8:
        raise InputError(f"{name}: raw dtype must be a number type such as '<i2', '>u2' or 'f4', not {kind!r}")
    check_shape(name, (x, y, z))
    check_spacing(name, step, "correct raw=")
    expected = x * y * z * stored.itemsize
    found = path.stat().st_size
    deflated = is_gzip(path)
    remedy = f"{x} x {y} x {z} voxels of {stored.str} do not fill the file; correct raw="
    if deflated:
        check_payload(name, expected, found, deflated=True)
    elif expected != found:
        raise InputError(f"{name}: expected {expected} bytes of voxels, found {found}; {remedy}")
    check_memory(name, expected)
    with opened(path, deflated=deflated) as stream:
        array = read_slices(stream, (z, y, x), stored, name=name, progress=progress)
        if stream.read(1):
            raise InputError(f"{name}: expected {expected} bytes of voxels, found more; {remedy}")
    return array, world_from_index(step), [NO_ORIENTATION]
