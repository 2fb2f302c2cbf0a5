"""Voxels from a stream, slice by slice into their final place."""

from __future__ import annotations

import gzip
import io
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import IO, TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError

if TYPE_CHECKING:
    from intaglio.compute import Progress


@contextmanager
def opened(path: Path, *, deflated: bool) -> Iterator[IO[bytes]]:
    """The file's bytes, inflated if need be; a damaged stream becomes an InputError."""
    try:
        with path.open("rb") as file:
            if deflated:
                with gzip.GzipFile(fileobj=file) as inflated:
                    yield io.BufferedReader(inflated, 1 << 20)
            else:
                yield file
    except (EOFError, zlib.error, gzip.BadGzipFile) as error:
        raise InputError(f"{path.name}: the gzip stream is damaged or truncated ({error}); get the file again") from None


def is_gzip(path: Path) -> bool:
    """Whether the file begins as a gzip stream."""
    with path.open("rb") as file:
        return file.read(2) == b"\x1f\x8b"


def check_zlib(path: Path, begin: int) -> None:
    """Inflate a zlib stream for its checksum alone; MetaImage's reader passes over damage."""
    inflater = zlib.decompressobj()
    try:
        with path.open("rb") as file:
            file.seek(begin)
            data = file.read(1 << 20)
            while data and not inflater.eof:
                inflater.decompress(data, 1 << 22)
                data = inflater.unconsumed_tail or file.read(1 << 20)
    except zlib.error as error:
        raise InputError(f"{path.name}: the compressed voxels are damaged ({error}); get the file again") from None
    if not inflater.eof:
        raise InputError(f"{path.name}: the compressed voxels are truncated; get the file again")


def skip(stream: IO[bytes], count: int) -> int:
    """Pass over count bytes; returns how many there were."""
    left = count
    while left > 0:
        got = len(stream.read(min(left, 1 << 20)))
        if got == 0:
            break
        left -= got
    return count - left


def read_slices(
    stream: IO[bytes],
    shape: tuple[int, int, int],
    stored: np.dtype[Any],
    *,
    name: str,
    slope: float = 1.0,
    intercept: float = 0.0,
    progress: Progress | None = None,
) -> NDArray[Any]:
    """An array of shape (z, y, x) in native byte order from the stream's next bytes; value = slope * stored + intercept.

    The type stays as stored unless it is scaled: then float32, or float64 for types of 32 bits or more
    that float32 cannot hold. At no time is there a second copy of more than one slice.
    """
    native = stored.newbyteorder("=")
    scaled = slope != 1.0 or intercept != 0.0
    wide = native.itemsize > 4 or (native.itemsize == 4 and native.kind != "f")
    array = np.empty(shape, (np.float64 if wide else np.float32) if scaled else native)
    buffer = np.empty(shape[1:], stored)
    size = buffer.nbytes
    for k, target in enumerate(array):
        here = buffer if scaled or stored != native else target
        got = stream.readinto(here.data.cast("B"))  # type: ignore[attr-defined]
        if got != size:
            raise InputError(
                f"{name}: expected {size * shape[0]} bytes of voxels, found {size * k + got}; the file is truncated, get it again"
            )
        if scaled:
            with np.errstate(all="ignore"):  # the caller looks for what is not finite
                np.multiply(here, array.dtype.type(slope), out=target, casting="unsafe")
                np.add(target, array.dtype.type(intercept), out=target)
        elif here is buffer:
            target[...] = here
        if progress:
            progress(k + 1, shape[0])
    return array
