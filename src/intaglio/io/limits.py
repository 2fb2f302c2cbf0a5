"""How much a file may ask for, judged before anything large is allocated."""

from __future__ import annotations

import math
from collections.abc import Sequence
from pathlib import Path

from intaglio.errors import InputError

# The deflate format cannot do better: 258 bytes from two bits.
DEFLATE_RATIO = 1032


def check_shape(name: str, shape: Sequence[int]) -> None:
    """Refuse what is no volume; shape (x, y, z)."""
    text = " x ".join(str(n) for n in shape)
    if any(n < 1 for n in shape) or not shape:
        raise InputError(f"{name}: number of voxels must be positive along each axis, not {text or 'missing'}; correct it")
    if len(shape) < 3 or any(n == 1 for n in shape):
        raise InputError(f"{name}: is a single image of {text} pixels, not a volume; give the whole series or stack")


def check_memory(name: str, promised: int, remedy: str = "crop or resample it, or check its header") -> None:
    """Refuse more bytes than the machine has free."""
    free = _free_memory()
    if promised > free:
        raise InputError(f"{name}: needs {readable(promised)} of memory, {readable(free)} are free; {remedy}")


def check_payload(name: str, promised: int, stored: int, *, deflated: bool = False) -> None:
    """Refuse a header that promises more bytes of voxels than the file can hold."""
    if deflated and promised > stored * DEFLATE_RATIO:
        raise InputError(
            f"{name}: expected {promised} bytes of voxels, {stored} compressed bytes cannot hold them; "
            "the file is truncated or its header wrong, get it again"
        )
    if not deflated and promised > stored:
        raise InputError(
            f"{name}: expected {promised} bytes of voxels, found {max(stored, 0)}; "
            "the file is truncated or its header wrong, get it again"
        )


def check_spacing(name: str, spacing: Sequence[float], remedy: str = "repair the header") -> None:
    """Refuse a distance of voxels that is none."""
    if len(spacing) != 3 or not all(math.isfinite(s) and s > 0 for s in spacing):
        raise InputError(f"{name}: spacing must be three positive numbers in mm, not {tuple(spacing)}; {remedy}")


def check_index(name: str, count: int, index: int | None) -> None:
    """Whether index picks one of count volumes; without it there must be only one."""
    if index is None and count > 1:
        raise InputError(f"{name}: holds {count} volumes; choose one with index=0..{count - 1}")
    if index is not None and not 0 <= index < count:
        raise InputError(f"{name}: index must be between 0 and {count - 1}, not {index!r}")


def readable(count: float) -> str:
    """Bytes for people."""
    for unit in ("bytes", "kB", "MB", "GB"):
        if count < 1000:
            return f"{count:.3g} {unit}"
        count /= 1000
    return f"{count:.4g} TB"


def _free_memory() -> float:
    try:
        for line in Path("/proc/meminfo").read_text(encoding="utf-8").splitlines():
            if line.startswith("MemAvailable:"):
                return int(line.split()[1]) * 1024.0
    except OSError:
        pass
    return math.inf
