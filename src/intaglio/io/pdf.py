"""PDF: a plate as one page of its size, the same paths as in SVG, a layer of the drawing being a PDF layer."""

# ISO 32000-1, "Portable Document Format, part 1: PDF 1.7", 2008.

from __future__ import annotations

from collections.abc import Iterator
from datetime import UTC, datetime

import numpy as np

from intaglio.drawing import Drawing, Layer
from intaglio.io.outline import UNIT, layer_paths
from intaglio.io.simplify import dot_nodes
from intaglio.io.svg import legible

MM = 72 / 25.4  # points
# A circle of four Bezier curves, true to 0.03 % of its radius.
ARM = 0.5519
QUARTER = np.array([(1, ARM), (ARM, 1), (0, 1)])
CIRCLE = np.concatenate([[(1, 0)], QUARTER, QUARTER @ [(0, 1), (-1, 0)], -QUARTER, QUARTER @ [(0, -1), (1, 0)]])
DISC = "%g %g m" + 4 * " %g %g %g %g %g %g c" + " f"
LARGEST_MM = 200 * 25.4  # beyond 14,400 points a page is not portable (ISO 32000-1, annex C)


def pdf_bytes(drawing: Drawing) -> bytes:
    """The whole file; equal drawings give equal bytes. A plate larger than 5080 mm is scaled down by a whole number."""
    from fpdf import FPDF

    shrink = max(1.0, np.ceil(max(drawing.width_mm, drawing.height_mm) / LARGEST_MM))
    pdf = FPDF(unit="mm", format=(drawing.width_mm / shrink, drawing.height_mm / shrink))
    pdf.set_creation_date(datetime(2000, 1, 1, tzinfo=UTC))
    pdf.set_producer("intaglio")
    pdf.set_title(legible(drawing.title))
    pdf.set_margin(0)
    pdf.set_auto_page_break(False)
    pdf.add_page()
    with pdf.optional_content(label="paper"):
        pdf.set_fill_color(drawing.paper)
        pdf.rect(0, 0, pdf.w, pdf.h, style="F")
    scale = MM * UNIT / shrink
    for layer in drawing.layers:
        with pdf.optional_content(label=legible(layer.name)), pdf.local_context(fill_color=layer.colour):
            # Whole numbers of UNIT from the upper left corner.
            pdf._out(f"{scale:.8f} 0 0 {-scale:.8f} 0 {pdf.h_pt:.4f} cm")
            for opacity, operators in _layer(layer):
                with pdf.local_context(fill_opacity=opacity):
                    pdf._out(operators)
    return bytes(pdf.output())


def _layer(layer: Layer) -> Iterator[tuple[float, str]]:
    """Operators that fill everything of one opacity, for each opacity."""
    # Outlines only: many viewers draw no line thinner than a pixel, which would spoil the tone of fine hatching.
    paths = layer_paths(layer, lines=False)
    numbers = list(map(str, paths.points.ravel().tolist()))
    vertices = [f"{x} {y}" for x, y in zip(numbers[::2], numbers[1::2], strict=True)]
    ends = paths.offsets.tolist()
    dots = dot_nodes(layer)
    level = np.round(dots[:, 3], 2)
    for opacity in np.unique(np.concatenate([paths.opacity, level[level > 0]])).tolist():
        lines = [
            f"{vertices[ends[i]]} m {' l '.join(vertices[ends[i] + 1 : ends[i + 1]])} l f"
            for i in np.flatnonzero(paths.opacity == opacity).tolist()
        ]
        x, y, r, _ = dots[level == opacity].T[:, :, None] / UNIT
        corners = np.stack([x + r * CIRCLE[:, 0], y + r * CIRCLE[:, 1]], axis=2).round(1)
        lines += [DISC % tuple(row) for row in corners.reshape(-1, 2 * len(CIRCLE)).tolist()]
        yield opacity, "\n".join(lines)
