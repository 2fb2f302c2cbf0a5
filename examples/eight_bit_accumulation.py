"""What accumulating in eight bits loses of the opacity of many thin slices, in percent of the true one."""

from pathlib import Path

import numpy as np
from classification_error import Figure

import intaglio as ig

SLICES = 200
OPACITIES = ((0.005, "#a63d2f"), (0.01, "#b5803a"), (0.02, "#2f5d7c"), (0.05, "#3d3a36"))


def lost(opacity: float) -> list[float]:
    """Of 1 - (1 - a)^n, front to back: each sum is cut to 255ths, as a frame buffer does."""
    true, kept, out = 0.0, 0, [0.0]
    for _ in range(SLICES):
        true += (1 - true) * opacity
        kept += int((255 - kept) * opacity)
        out.append(1 - kept / 255 / true)
    return out


def make(data: Path | None, size: int) -> ig.Drawing:
    top = 0.8
    figure = Figure(
        [(n / SLICES, str(n)) for n in (0, 50, 100, 150, 200)],
        [(e / top, f"{round(100 * e)} %") for e in (0.0, 0.2, 0.4, 0.6, 0.8)],
        "slices",
        "opacity lost",
    )
    for opacity, colour in OPACITIES:
        points = [(n / SLICES, e / top) for n, e in enumerate(lost(opacity))][1:]
        figure.curve(np.array(points), f"{100 * opacity:g} % each", colour)
    return figure.drawing("Error of accumulation in eight bits")
