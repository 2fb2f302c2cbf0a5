"""A ramp of light as three styles hatch it, and the printed tone over the one asked for."""

from dataclasses import replace
from pathlib import Path

import numpy as np
from classification_error import Figure, lettering

import intaglio as ig
from intaglio.drawing import Drawing, Layer, Strokes
from intaglio.ink.hatching import darkness
from intaglio.ink.styles import Hatching, style

COLOURS = {"pen-and-ink": "#3d3a36", "engraving": "#2f5d7c", "pencil": "#a63d2f"}
WIDTH, HEIGHT, MM = 500, 90, 0.2
BINS = 24


def sheet(hatching: Hatching) -> ig.GBuffer:
    """Flat, level with the picture, lit from nothing on the right to more than paper needs on the left."""
    forward = np.array([0.0, -1.0, 0.0])
    gb = ig.GBuffer.empty(ig.Camera(np.zeros(3), forward, np.array([0.0, 0.0, 1.0]), (WIDTH, HEIGHT), MM))
    gb.depth[:] = 100.0
    gb.normal[:] = -forward
    gb.direction[:] = gb.camera.right
    gb.light[..., 1] = np.linspace(hatching.white, hatching.black, WIDTH)
    return gb


def make(data: Path | None, size: int) -> ig.Drawing:
    across, up = ([(t / 0.7, f"{t:.1f}") for t in marks] for marks in ((0.0, 0.2, 0.4, 0.6), (0.2, 0.4, 0.6)))
    figure = Figure(across, up, "tone asked for", "tone printed")
    figure.curve([(0, 0), (1, 1)], "", "#b5b0a8", 0.3)
    layers = []
    for row, (name, colour) in enumerate(COLOURS.items()):
        hatching = style(name, ink="#000000", paper="#ffffff", contour=0.0, valley=0.0, ridge=0.0)
        gb = sheet(hatching)
        plate = ig.draw(gb, hatching, width_mm=WIDTH * MM)
        top = 6.0 + row * (HEIGHT * MM + 7.0)
        for layer in plate.layers:
            moved = replace(layer.strokes, points=layer.strokes.points + np.float32([10.0, top]))
            layers.append(Layer(f"{name} {layer.name}", moved, colour=style(name).ink))
        layers.append(Layer(name, Strokes.of(lettering(name, 10.0, top + HEIGHT * MM + 3.6)), colour=colour))
        # Away from the ends of lines at the sheet's border.
        inner = slice(15, -15)
        asked, printed = (
            tone[inner, inner].mean(axis=0)[: (WIDTH - 30) // BINS * BINS].reshape(BINS, -1).mean(axis=1)
            for tone in (darkness(gb, hatching, MM), 1 - plate.image(25.4 / MM).array[:HEIGHT, :WIDTH, 0])
        )
        figure.curve(np.stack([asked, printed], axis=1) / 0.7, "", colour, marks=True)
    below = 6.0 + len(COLOURS) * (HEIGHT * MM + 7.0)
    chart = figure.drawing("")
    for layer in chart.layers:
        moved = replace(layer.strokes, points=layer.strokes.points + np.float32([0.0, below]))
        layers.append(Layer(f"chart {layer.name}", moved, colour=layer.colour))
    return Drawing(tuple(layers), chart.width_mm, below + chart.height_mm, title="Tone asked for and printed")
