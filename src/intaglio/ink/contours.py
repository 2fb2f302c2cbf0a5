"""Occluding contours: where depth jumps, as polylines of sub-pixel accuracy; and the contour image."""

# W. Lorensen, H. Cline, "Marching cubes", 1987: its two-dimensional kin links the crossings.
# G. Kindlmann et al., "Curvature-based transfer functions for direct volume rendering", 2003 (thickness).

from __future__ import annotations

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from intaglio.compute import kernel
from intaglio.gbuffer import GBuffer


@dataclass(frozen=True, eq=False)
class Contours:
    """Polylines in pixels: line i is offsets[i]:offsets[i + 1] of the arrays.

    points (n, 2) float32, x right, y down; jump (n,) mm of depth from the near surface to what is behind, inf for
    the background; light (n,) brightness of the near surface.
    """

    points: NDArray[np.float32]
    jump: NDArray[np.float32]
    light: NDArray[np.float32]
    offsets: NDArray[np.int64]

    def __len__(self) -> int:
        return len(self.offsets) - 1


@kernel
def _link(edge, depth, number, links):  # type: ignore[no-untyped-def]
    """links[number[2 (y w + x) + side]] = the one or two crossings that follow it, -1 for none.

    Every square of four pixel centres has up to four crossings on its sides. Two are joined. Of more, those with the
    background behind them are joined first, so that the outline stays whole; then those whose near surfaces are most
    alike in depth: a contour that ends behind another does not turn into it.
    """
    h, w = depth.shape
    node = np.empty(4, dtype=np.int64)
    near = np.empty(4)
    closed = np.empty(4)
    for y in range(h - 1):
        for x in range(w - 1):
            n = 0
            for side in range(4):
                # Top, bottom, left, right.
                ey = y + (1 if side == 1 else 0)
                ex = x + (1 if side == 3 else 0)
                way = 0 if side < 2 else 1
                if edge[ey, ex, way] >= 0.0:
                    node[n] = number[2 * (ey * w + ex) + way]
                    a = depth[ey, ex]
                    b = depth[ey + way, ex + 1 - way]
                    near[n] = min(a, b)
                    closed[n] = 0.0 if max(a, b) == np.inf else 1e6
                    n += 1
            while n >= 2:
                best = np.inf
                p = 0
                q = 1
                for a in range(n):
                    for b in range(a + 1, n):
                        unlike = abs(near[a] - near[b]) + closed[a] + closed[b]
                        if unlike < best:
                            best = unlike
                            p = a
                            q = b
                i = node[p]
                j = node[q]
                links[i, 0 if links[i, 0] < 0 else 1] = j
                links[j, 0 if links[j, 0] < 0 else 1] = i
                # Drop both; q > p, so q first.
                for gone in (q, p):
                    n -= 1
                    node[gone] = node[n]
                    near[gone] = near[n]
                    closed[gone] = closed[n]


@kernel
def _follow(links, used, order, offsets):  # type: ignore[no-untyped-def]
    """Chains: from loose ends first, then loops, which repeat their first crossing at the end."""
    n = 0
    lines = 0
    for loops in range(2):
        for start in range(len(links)):
            if used[start] or (loops == 0 and links[start, 0] >= 0 and links[start, 1] >= 0):
                continue
            at = start
            while at >= 0 and not used[at]:
                used[at] = True
                order[n] = at
                n += 1
                a = links[at, 0]
                b = links[at, 1]
                at = a if a >= 0 and not used[a] else b
            if loops == 1:
                order[n] = start
                n += 1
            lines += 1
            offsets[lines] = n
    return n, lines


def chains(crossing: NDArray[np.float32], depth: NDArray[np.float32]) -> tuple[NDArray[np.int64], NDArray[np.int64]]:
    """Join crossings (h, w, 2), laid out as the G-buffer's `edge`, to lines: their numbers 2 (y w + x) + side, and offsets."""
    h, w = depth.shape
    nodes = np.flatnonzero(crossing.reshape(-1) >= 0.0)
    number = np.full(2 * h * w, -1, dtype=np.int32)
    number[nodes] = np.arange(len(nodes))
    links = np.full((len(nodes), 2), -1, dtype=np.int64)
    order = np.empty(2 * len(nodes), dtype=np.int64)
    offsets = np.zeros(len(nodes) + 1, dtype=np.int64)
    _link(crossing, depth, number, links)
    n, lines = _follow(links, np.zeros(len(nodes), dtype=bool), order, offsets)
    return nodes[order[:n]], offsets[: lines + 1].copy()


def places(order: NDArray[np.int64], crossing: NDArray[np.float32]) -> NDArray[np.float32]:
    """(n, 2) image positions of numbered crossings, in pixels."""
    side = order % 2
    y, x = np.divmod(order // 2, crossing.shape[1])
    part = crossing[y, x, side]
    return np.stack([x + 0.5 + part * (1 - side), y + 0.5 + part * side], axis=1).astype(np.float32)


def occluding_contours(gb: GBuffer) -> Contours:
    """Every visible line where a surface ends before another or before the background, without false connections."""
    order, offsets = chains(gb.edge, gb.depth)
    side = order % 2
    y, x = np.divmod(order // 2, gb.depth.shape[1])
    y2, x2 = y + side, x + 1 - side
    here, there = gb.depth[y, x], gb.depth[y2, x2]
    light = np.where(here < there, gb.brightness[y, x], gb.brightness[y2, x2])
    jump = np.full(len(order), np.inf, dtype=np.float32)
    inner = np.isfinite(here) & np.isfinite(there)
    jump[inner] = np.abs(here - there)[inner]
    return Contours(places(order, gb.edge), jump, light.astype(np.float32), offsets)


def contour_image(gb: GBuffer, thickness: float = 1.5) -> NDArray[np.float32]:
    """(h, w) float32, 1 on contours `thickness` pixels wide, 0 elsewhere.

    |n.v| <= sqrt(T k (2 - T k)) with k the normal curvature along the view and T the thickness in mm at that depth
    (Kindlmann et al. 2003), which keeps the width constant where a fixed bound on n.v would blacken flat regions.
    """
    t = np.clip(thickness * gb.pixel_mm * gb.view_curvature, 0.0, 1.0)
    limit = np.sqrt(t * (2.0 - t))
    return (gb.mask & (np.abs(gb.facing) <= limit)).astype(np.float32)
