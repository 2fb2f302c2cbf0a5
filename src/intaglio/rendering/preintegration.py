"""Pre-integrated classification: what a short piece of a ray adds, from the values at its two ends."""

# K. Engel, M. Kraus, T. Ertl, "High-Quality Pre-Integrated Volume Rendering Using Hardware-Accelerated Pixel Shading", 2001.
# S. Röttger, M. Kraus, T. Ertl, "Hardware-Accelerated Volume and Isosurface Rendering Based on Cell-Projection", 2000.

from __future__ import annotations

import math

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel, strips
from intaglio.piecewise import interpolated
from intaglio.transfer_function import TransferFunction

Floats = NDArray[np.float64]

# Parts of a piece in which both colour and extinction change; each has one extinction.
PARTS = 16
# An optical depth that lets nothing through.
OPAQUE = 700.0


@kernel
def _fill(begin, end, depth, colours, cells, table):  # type: ignore[no-untyped-def]
    """Entries (i, i + gap) and (i + gap, i) for gaps from begin + 1 to end, of table (n, n, 4).

    depth (m,) optical depths of pieces if one cell is as long as the step; colours (m, 2, 4) their ends, of which the
    last component is 1 and gives opacity; cells (n,) the first piece of each cell, and m.
    A piece with one extinction, colour from a to b and depth t adds a (1 - e^-t) + (b - a) (1 - e^-t (1 + t)) / t.
    """
    n = len(table)
    clear = np.empty(n - 1)
    ahead = np.empty((4, n - 1))
    back = np.empty((4, n - 1))
    through = np.empty(n - 1)
    up = np.empty((4, n - 1))
    down = np.empty((4, n - 1))
    for gap in range(begin + 1, end + 1):
        for k in range(n - 1):
            t = 1.0
            ahead[:, k] = 0.0
            back[:, k] = 0.0
            for p in range(cells[k], cells[k + 1]):
                tau = min(depth[p] / gap, OPAQUE)
                gone = -math.expm1(-tau)
                share = gone / tau - 1.0 + gone if tau > 1e-4 else tau * (0.5 - tau / 3.0)
                for c in range(4):
                    a = colours[p, 0, c]
                    b = colours[p, 1, c]
                    ahead[c, k] += t * (a * gone + (b - a) * share)
                    back[c, k] = b * gone + (a - b) * share + (1.0 - gone) * back[c, k]
                t *= 1.0 - gone
            clear[k] = t
        count = n - gap
        through[:count] = 1.0
        up[:, :count] = 0.0
        down[:, :count] = 0.0
        for q in range(gap):
            for c in range(4):
                for i in range(count):
                    up[c, i] += through[i] * ahead[c, i + q]
                    down[c, i] = back[c, i + q] + clear[i + q] * down[c, i]
            for i in range(count):
                through[i] *= clear[i + q]
        for i in range(count):
            for c in range(3):
                table[i, i + gap, c] = up[c, i]
                table[i + gap, i, c] = down[c, i]
            table[i, i + gap, 3] = up[3, i]
            table[i + gap, i, 3] = up[3, i]


def _mean_extinction(a: Floats, b: Floats) -> Floats:
    """Mean of -ln(1 - opacity) over pieces along which opacity goes from a to b; inf where it is 1 throughout.

    With w = 1 - opacity, from w0 down to w0 (1 + r): 1 - ln(w0) - (1 + 1 / r) ln(1 + r).
    """
    low, high = np.minimum(a, b), np.maximum(a, b)
    with np.errstate(divide="ignore", invalid="ignore", over="ignore"):
        r = (low - high) / (1.0 - low)
        bend = np.where(r > -1e-8, -0.5 * r, np.where(r == -1, 1.0, 1.0 - (1.0 + 1.0 / r) * np.log1p(r)))
        return np.where(low == 1, np.inf, bend - np.log1p(-low))


def preintegrated_table(
    transfer_function: TransferFunction, low: float, high: float, size: int = 256, *, step: float
) -> NDArray[np.float32]:
    """(size, size, 4) float32 red, green, blue, opacity by [front, back], premultiplied: what `step` mm of a ray add.

    front and back are the values at the end nearer to the eye and at the other, of `size` from low to high, both
    included; between them the value changes evenly. Opacity is exact, however narrow a peak is; colour counts what the
    piece itself hides. Where front and back are the same it is the value's own colour and opacity.
    """
    samples = transfer_function.table(low, high, size, step=step)
    values = np.linspace(low, high, size)
    x, rgba = transfer_function.knots
    edges = np.unique(np.concatenate([values, x[(x > low) & (x < high)]]))
    start, stop = interpolated(x, rgba, edges[:-1]), interpolated(x, rgba, edges[1:], "left")
    changing = (start[:, 3] != stop[:, 3]) & (start[:, :3] != stop[:, :3]).any(axis=1)
    parts = np.where(changing, PARTS, 1)
    piece = np.repeat(np.arange(len(parts)), parts)
    within = np.arange(len(piece)) - np.repeat(np.cumsum(parts) - parts, parts)
    t = np.stack([within, within + 1]) / parts[piece]
    ends = start[piece] + t[..., None] * (stop - start)[piece]
    extinction = _mean_extinction(ends[0, :, 3], ends[1, :, 3])
    ends[:, :, 3] = 1.0
    # Finite, for an infinite length of what is clear would be no number.
    reach = min(step / transfer_function.reference_length, 1e100)
    length = (np.diff(edges) / (high - low) * (size - 1) / parts)[piece] * reach
    first = np.concatenate([np.searchsorted(edges[piece], values[:-1]), [len(piece)]])
    table = np.empty((size, size, 4))
    strips(_fill, size - 1, extinction * length, np.ascontiguousarray(ends.swapaxes(0, 1)), first, table, size=16)
    diagonal = np.arange(size)
    table[diagonal, diagonal, :3] = samples[:, :3] * samples[:, 3:]
    table[diagonal, diagonal, 3] = samples[:, 3]
    return table.astype(np.float32)
