"""Kernels, tiles and threads: the one place that knows numba and the thread pool."""

from __future__ import annotations

import hashlib
import os
import shutil
from collections.abc import Callable, Iterator
from concurrent.futures import Future, ThreadPoolExecutor, as_completed
from contextlib import contextmanager
from functools import cache
from pathlib import Path
from typing import Any

import numba
import numba.core.event as numba_event
import numpy as np
from llvmlite import ir
from numba import types
from numba.core import cgutils
from numba.extending import intrinsic

from intaglio.errors import InputError

Progress = Callable[[int, int], None]

FASTMATH = {"contract", "reassoc", "arcp", "nsz"}


@cache
def _cache_folder() -> str:
    """A folder for compiled kernels that changes with the source of all modules that may hold them.

    numba looks only at the file a kernel stands in, not at the helpers that it inlines from others.
    """
    package = Path(__file__).parent
    stamp = hashlib.sha256(numba.__version__.encode())
    for source in sorted(package.rglob("*.py")):
        text = source.read_bytes()
        if b"intaglio.compute import" in text:
            stamp.update(str(source).encode() + text)
    try:
        root = Path(os.environ.get("XDG_CACHE_HOME") or Path.home() / ".cache") / "intaglio" / "kernels"
        folder = root / stamp.hexdigest()[:16]
        folder.mkdir(parents=True, exist_ok=True)
        folder.touch()
        for old in sorted(root.iterdir(), key=lambda f: f.stat().st_mtime)[:-8]:
            shutil.rmtree(old, ignore_errors=True)
    except (OSError, RuntimeError):  # nowhere to write, or no home
        return ""
    return str(folder)


def _jit(function: Callable[..., Any], **options: Any) -> Callable[..., Any]:
    folder = _cache_folder()
    before = numba.config.CACHE_DIR
    numba.config.CACHE_DIR = folder or before
    try:
        jit = numba.njit(nogil=True, cache=bool(folder), error_model="numpy", fastmath=FASTMATH, **options)
        compiled: Callable[..., Any] = jit(function)
        return compiled
    finally:
        numba.config.CACHE_DIR = before


def kernel(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a function of arrays and numbers: no interpreter lock, cached on disk, vectorizable float arithmetic."""
    return _jit(function)


def helper(function: Callable[..., Any]) -> Callable[..., Any]:
    """Compile a small function that kernels call; LLVM inlines it, so that the caller's loops can vectorize."""
    return _jit(function, forceinline=True)


# Room for a packet of 32, one value more, and a vector more.
LANES = 48


@intrinsic  # type: ignore[untyped-decorator]
def _stack(typing: Any) -> Any:
    def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
        return cgutils.alloca_once(builder, ir.FloatType(), size=LANES)

    return types.CPointer(types.float32)(), code


@helper
def lanes():  # type: ignore[no-untyped-def]
    """A float32 array of LANES on the kernel's stack, not cleared.

    LLVM knows that nothing else points to it. A loop that gathers from a volume and writes to such arrays becomes vector
    code; written to arrays of numpy's, which might overlap the volume, it stays scalar and takes twice the time.
    """
    return numba.carray(_stack(), (LANES,))


def _floats(context: Any, builder: Any, array_type: Any, array: Any, index: Any, count: int) -> Any:
    """`count` float32 from `index` on, from loads of 32 or 64 bits where the voxels are narrower than that."""
    voxel = array_type.dtype
    data = cgutils.create_struct_proxy(array_type)(context, builder, value=array).data
    bits = voxel.bitwidth
    out = []
    if bits * 2 > 64:
        for i in range(count):
            pointer = builder.gep(data, [builder.add(index, ir.Constant(index.type, i))])
            out.append(context.cast(builder, builder.load(pointer), voxel, types.float32))
        return out
    together = min(count, 64 // bits)
    wide = ir.IntType(together * bits)
    for start in range(0, count, together):
        pointer = builder.gep(data, [builder.add(index, ir.Constant(index.type, start))])
        word = builder.load(builder.bitcast(pointer, wide.as_pointer()), align=bits // 8)
        for i in range(together):
            part = builder.trunc(builder.lshr(word, ir.Constant(wide, i * bits)), ir.IntType(bits))
            if isinstance(voxel, types.Float):
                out.append(builder.bitcast(part, ir.FloatType()))
            elif voxel.signed:
                out.append(builder.sitofp(part, ir.FloatType()))
            else:
                out.append(builder.uitofp(part, ir.FloatType()))
    return out


def _reader(count: int) -> Any:
    @intrinsic  # type: ignore[untyped-decorator]
    def read(typing: Any, voxels: Any, index: Any) -> Any:
        result = types.UniTuple(types.float32, count)

        def code(context: Any, builder: Any, signature: Any, args: Any) -> Any:
            array, start = args
            return context.make_tuple(builder, result, _floats(context, builder, signature.args[0], array, start, count))

        return result(voxels, index), code

    return read


# Neighbouring voxels of a row read at once, which is less than half the work: pair(voxels, i) = float32 of voxels[i] and
# voxels[i + 1], quad(voxels, i) of four. Voxels are flat and little-endian.
pair = _reader(2)
quad = _reader(4)


class _CompileListener(numba_event.Listener):  # type: ignore[misc]
    def __init__(self, announce: Callable[[], None]) -> None:
        self.announce: Callable[[], None] | None = announce

    def on_start(self, event: Any) -> None:
        announce, self.announce = self.announce, None
        if announce:
            announce()

    def on_end(self, event: Any) -> None:
        pass


@contextmanager
def announcing_compilation(announce: Callable[[], None]) -> Iterator[None]:
    """Call `announce` once if anything has to be compiled inside; loading from the cache does not count."""
    with numba_event.install_listener("numba:compile", _CompileListener(announce)):
        yield


def thread_count() -> int:
    """Threads that `tiles` uses: INTAGLIO_THREADS, else the cores this process may run on."""
    text = os.environ.get("INTAGLIO_THREADS", "")
    if not text:
        return len(os.sched_getaffinity(0)) if hasattr(os, "sched_getaffinity") else os.cpu_count() or 1
    if not text.isdecimal() or int(text) < 1:
        raise InputError(f"INTAGLIO_THREADS must be a positive number, not {text!r}")
    return int(text)


@cache
def _pool(threads: int) -> ThreadPoolExecutor:
    return ThreadPoolExecutor(threads, thread_name_prefix="intaglio")


def each(function: Callable[..., Any], jobs: list[tuple[Any, ...]], *, progress: Progress | None = None) -> None:
    """Call function(*job) for every job on the thread pool, in any order; jobs must write to disjoint places.

    progress(done, total) is called from this thread; an exception from it, or Ctrl-C, drops the jobs that
    have not begun, waits for those that have, and is raised.
    """
    total = len(jobs)
    threads = thread_count()
    if progress:
        progress(0, total)
    if threads == 1 or total <= 1:
        for done, job in enumerate(jobs):
            function(*job)
            if progress:
                progress(done + 1, total)
        return
    pool = _pool(threads)
    futures: list[Future[Any]] = []
    try:
        futures.extend(pool.submit(function, *job) for job in jobs)
        for done, future in enumerate(as_completed(futures)):
            future.result()
            if progress:
                progress(done + 1, total)
    except BaseException:
        for future in futures:
            future.cancel()
        for future in futures:
            if not future.cancelled():
                future.exception()
        raise


def tiles(
    function: Callable[..., Any], shape: tuple[int, int], *args: Any, tile: int = 32, progress: Progress | None = None
) -> None:
    """Call function(y0, y1, x0, x1, *args) for every tile of a (height, width) image on the thread pool."""
    height, width = shape
    jobs = [
        (y, min(y + tile, height), x, min(x + tile, width), *args) for y in range(0, height, tile) for x in range(0, width, tile)
    ]
    each(function, jobs, progress=progress)


def strips(function: Callable[..., Any], length: int, *args: Any, size: int = 1, progress: Progress | None = None) -> None:
    """Call function(begin, end, *args) for every strip of a range on the thread pool."""
    each(function, [(i, min(i + size, length), *args) for i in range(0, length, size)], progress=progress)


def frozen(array: Any) -> Any:
    """A contiguous read-only view: one numba type, so one compilation, for every array of a dtype and dimension."""
    view = np.ascontiguousarray(array).view()
    view.flags.writeable = False
    return view
