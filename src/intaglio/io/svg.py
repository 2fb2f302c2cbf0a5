"""SVG: a plate as vector paths in millimetres, one Inkscape layer for each layer of the drawing."""

# W3C, "Scalable Vector Graphics (SVG) 1.1 (Second Edition)", 2011.

from __future__ import annotations

import html
import re
from collections.abc import Iterator
from itertools import pairwise

import numpy as np

from intaglio.drawing import Drawing, Layer
from intaglio.io.outline import UNIT, layer_paths
from intaglio.io.simplify import dot_nodes, simplified, stroke_nodes

PLOTTER_TOLERANCE = 0.02  # mm


def svg_text(drawing: Drawing, *, plotter: bool = False) -> str:
    """The whole file; equal drawings give equal text.

    Strokes of varying width are filled outlines, others lines with round caps. With `plotter` every stroke is a
    plain line as wide as the layer's median, without opacity, in the drawing's order, and there is no paper.
    """
    width, height = f"{drawing.width_mm:.6g}", f"{drawing.height_mm:.6g}"
    lines = [
        '<?xml version="1.0" encoding="UTF-8"?>',
        '<svg xmlns="http://www.w3.org/2000/svg" xmlns:inkscape="http://www.inkscape.org/namespaces/inkscape"'
        f' width="{width}mm" height="{height}mm" viewBox="0 0 {width} {height}">',
        f"<title>{_escaped(drawing.title)}</title>",
    ]
    if not plotter:
        lines += [
            '<g inkscape:groupmode="layer" inkscape:label="paper" id="paper">',
            f'<rect width="{width}" height="{height}" fill="{drawing.paper}"/>',
            "</g>",
        ]
    for number, layer in enumerate(drawing.layers, start=1):
        lines.append(
            f'<g inkscape:groupmode="layer" inkscape:label="{_escaped(layer.name)}" id="layer{number}" transform="scale({UNIT})">'
        )
        lines += _plotter_layer(layer) if plotter else _layer(layer)
        lines.append("</g>")
    lines.append("</svg>\n")
    return "\n".join(lines)


def _layer(layer: Layer) -> Iterator[str]:
    paths = layer_paths(layer)
    if len(paths):
        commands = _commands(paths.points, paths.offsets)
        style = np.stack([paths.opacity, paths.width], axis=1)
        fresh = np.flatnonzero((np.diff(style, axis=0, prepend=-1.0) != 0).any(axis=1))
        yield f'<g fill="{layer.colour}" stroke="{layer.colour}" stroke-linecap="round" stroke-linejoin="round">'
        for begin, end in zip(fresh.tolist(), [*fresh[1:].tolist(), len(paths)], strict=True):
            opacity, width = style[begin].tolist()
            yield _group(opacity, width)
            close = '"/>' if width else 'z"/>'
            yield "\n".join([f'<path d="m{d}{close}' for d in commands[begin:end]])
            yield "</g>"
        yield "</g>"
    if len(layer.dots):
        nodes = dot_nodes(layer)
        level = np.round(nodes[:, 3], 2)
        yield f'<g fill="{layer.colour}">'
        for opacity in np.unique(level[level > 0]).tolist():
            yield f'<g fill-opacity="{_short(opacity)}">' if opacity < 1 else "<g>"
            x, y = np.rint(nodes[level == opacity, :2].T / UNIT).astype(int).tolist()
            radius = np.round(nodes[level == opacity, 2] / UNIT, 1).tolist()
            yield "\n".join([f'<circle cx="{a}" cy="{b}" r="{r:g}"/>' for a, b, r in zip(x, y, radius, strict=True)])
            yield "</g>"
        yield "</g>"


def _group(opacity: float, width: float) -> str:
    if width:
        attributes = f' fill="none" stroke-width="{width / UNIT:.6g}"'
        return f'<g{attributes} stroke-opacity="{_short(opacity)}">' if opacity < 1 else f"<g{attributes}>"
    return f'<g stroke="none" fill-opacity="{_short(opacity)}">' if opacity < 1 else '<g stroke="none">'


def _plotter_layer(layer: Layer) -> Iterator[str]:
    nodes, dots = stroke_nodes(layer), dot_nodes(layer) / [UNIT, UNIT, UNIT, 1]
    wide = 2 * float(np.median(nodes[:, 2])) / UNIT if len(nodes) else 1.0
    nodes[:, 2:] = 0
    nodes, offsets = simplified(nodes, layer.strokes.offsets, PLOTTER_TOLERANCE)
    ends = 'stroke-linecap="round" stroke-linejoin="round"'
    yield f'<g fill="none" stroke="{layer.colour}" stroke-width="{max(wide, 1.0):.4g}" {ends}>'
    yield "\n".join([f'<path d="m{d}"/>' for d in _commands(np.rint(nodes[:, :2] / UNIT).astype(np.int32), offsets)])
    # The pen's own width is part of a dot.
    yield "\n".join([f'<circle cx="{x:.0f}" cy="{y:.0f}" r="{max(r - wide / 2, 1):.0f}"/>' for x, y, r, _ in dots.tolist()])
    yield "</g>"


def _commands(points: np.ndarray, offsets: np.ndarray) -> list[str]:
    """Relative coordinates of each path, to be put behind an "m"."""
    steps = np.diff(points, axis=0, prepend=np.int32(0))
    steps[offsets[:-1]] = points[offsets[:-1]]
    numbers = list(map(str, steps.ravel().tolist()))
    ends = (2 * offsets).tolist()
    return [" ".join(numbers[i:j]).replace(" -", "-") for i, j in pairwise(ends)]


def _short(number: float) -> str:
    """0.25 as .25"""
    return f"{number:.2f}".rstrip("0").lstrip("0")


def legible(text: str) -> str:
    """Without what neither XML nor UTF-8 can hold: control characters and halves of surrogate pairs."""
    return re.sub(r"[^\t\n\r -\ud7ff\ue000-\ufffd\U00010000-\U0010ffff]", "", text)


def _escaped(text: str) -> str:
    return html.escape(legible(text))
