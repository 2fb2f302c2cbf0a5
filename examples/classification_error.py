"""Error of pre-, post- and pre-integrated classification over the rate of samples, against 64 a voxel."""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

import intaglio as ig
from intaglio.drawing import Layer, Stroke, Strokes

RATES = (0.5, 0.707, 1.0, 1.414, 2.0, 2.83, 4.0, 5.66, 8.0)
COLOURS = {"pre": "#a63d2f", "post": "#2f5d7c", "preintegrated": "#3d3a36"}
INK = "#3d3a36"

# Letters of single strokes, as an engraver would cut them: x to the right, y up, x-height 4, capitals 6.
GLYPHS = {
    "0": ["1,0 0,1 0,5 1,6 2,6 3,5 3,1 2,0 1,0"],
    "1": ["0,4.8 1.5,6 1.5,0"],
    "2": ["0,5 1,6 2,6 3,5 3,4 0,0 3,0"],
    "4": ["2.2,0 2.2,6 0,2 3,2"],
    "5": ["3,6 0.3,6 0,3.3 1.5,3.7 3,2.7 3,1 2,0 1,0 0,0.8"],
    "8": ["1,3.2 0.2,4 0.2,5.2 1,6 2,6 2.8,5.2 2.8,4 2,3.2 1,3.2 0,2.2 0,0.9 1,0 2,0 3,0.9 3,2.2 2,3.2"],
    "6": ["2.8,5.3 2,6 1,6 0,5 0,1 1,0 2,0 3,1 3,2.4 2,3.4 1,3.4 0,2.6"],
    ".": ["0.4,0 0.6,0.3"],
    "%": ["0,0 4,6", "0.4,4.6 1,5.6 1.6,4.6 1,3.6 0.4,4.6", "2.4,1.4 3,2.4 3.6,1.4 3,0.4 2.4,1.4"],
    "-": ["0.3,2.2 2.3,2.2"],
    "/": ["0,-0.5 2,6.5"],
    "a": ["3,4 1.2,4 0,3 0,1 1,0 2,0 3,1", "3,4 3,0"],
    "b": ["0,6.5 0,0", "0,1 1,0 2,0 3,1 3,3 2,4 1,4 0,3"],
    "d": ["3,6.5 3,0", "3,1 2,0 1,0 0,1 0,3 1,4 2,4 3,3"],
    "e": ["0,2 3,2 3,3 2,4 1,4 0,3 0,1 1,0 2,0 3,0.7"],
    "f": ["2.4,6.4 1.6,6.4 1,5.6 1,0", "0,4 2.2,4"],
    "g": ["3,4 3,-1.2 2,-2 1,-2 0.2,-1.4", "3,1 2,0 1,0 0,1 0,3 1,4 2,4 3,3"],
    "i": ["0.5,4 0.5,0", "0.5,5.6 0.5,5.9"],
    "k": ["0,6.5 0,0", "2.8,4 0,1.5", "1,2.4 3,0"],
    "l": ["0.5,6.5 0.5,0"],
    "n": ["0,4 0,0", "0,2.8 1,4 2,4 3,3 3,0"],
    "o": ["1,0 0,1 0,3 1,4 2,4 3,3 3,1 2,0 1,0"],
    "p": ["0,4 0,-2", "0,1 1,0 2,0 3,1 3,3 2,4 1,4 0,3"],
    "r": ["0,4 0,0", "0,2.6 1,4 2.2,4"],
    "s": ["3,3.3 2,4 1,4 0.2,3.2 1,2.2 2,1.9 2.9,1 2,0 1,0 0,0.7"],
    "t": ["1,5.6 1,0.8 1.6,0 2.4,0", "0,4 2.2,4"],
    "u": ["0,4 0,1 1,0 2,0 3,1", "3,4 3,0"],
    "v": ["0,4 1.5,0 3,4"],
    "y": ["0,4 1.5,0.4", "3,4 0.8,-2"],
    "x": ["0,4 3,0", "3,4 0,0"],
    "c": ["3,3.3 2,4 1,4 0,3 0,1 1,0 2,0 3,0.7"],
    "h": ["0,6.5 0,0", "0,2.8 1,4 2,4 3,3 3,0"],
    "m": ["0,4 0,0", "0,3 0.8,4 1.4,4 2,3.2 2,0", "2,3.2 2.8,4 3.4,4 4,3.2 4,0"],
}


def line(points: object, width: float = 0.25) -> Stroke:
    p = np.asarray(points, dtype=np.float32)
    return Stroke(p, np.full(len(p), width, np.float32), np.ones(len(p), np.float32))


def lettering(text: str, x: float, y: float, height: float = 2.2, align: float = 0.0, width: float = 0.22) -> list[Stroke]:
    """Single strokes on a base line at y mm; align 0 begins at x, 1 ends there."""
    scale, at, strokes = height / 6, 0.0, []
    for letter in text:
        shapes = [np.array([[float(c) for c in point.split(",")] for point in s.split()]) for s in GLYPHS.get(letter, [])]
        strokes += [shape * (1, -1) + (at, 0) for shape in shapes]
        at += max((shape[:, 0].max() for shape in shapes), default=1.2) + 1.4
    left = x - align * (at - 1.4) * scale
    return [line(s * scale + (left, y), width) for s in strokes]


class Figure:
    """Axes on paper: marks as (position 0..1, text), curves in parts of the frame, y up."""

    width, height, left, right, top, bottom = 120.0, 80.0, 16.0, 30.0, 6.0, 14.0

    def __init__(self, across: list[tuple[float, str]], up: list[tuple[float, str]], x_title: str, y_title: str) -> None:
        (x0, y0), (x1, y1) = self.place([(0, 0)])[0], self.place([(1, 1)])[0]
        ink = [line([(x0, y1 - 2), (x0, y0), (x1 + 2, y0)], 0.3)]
        for part, text in across:
            x = self.place([(part, 0)])[0, 0]
            ink += [line([(x, y0), (x, y0 + 1.2)]), *lettering(text, x, y0 + 4.6, align=0.5)]
        for part, text in up:
            y = self.place([(0, part)])[0, 1]
            ink += [line([(x0 - 1.2, y), (x0, y)]), *lettering(text, x0 - 2.2, y + 1.1, align=1.0)]
        ink += lettering(x_title, x1, y0 + 10, align=1.0) + lettering(y_title, x0 + 2, y1 - 1.5)
        self.layers = [Layer("axes", Strokes.of(ink), colour=INK)]

    def place(self, points: object) -> NDArray[np.float64]:
        p = np.asarray(points, dtype=np.float64)
        across, up = self.width - self.left - self.right, self.height - self.top - self.bottom
        return np.stack([self.left + across * p[:, 0], self.height - self.bottom - up * p[:, 1]], axis=1)

    def curve(self, points: object, name: str, colour: str, width: float = 0.55, marks: bool = False) -> None:
        p = self.place(points)
        ink = [line(p, width)]
        if marks:
            turn = np.linspace(0, 2 * np.pi, 17)
            ink += [line(q + 0.5 * np.stack([np.cos(turn), np.sin(turn)], axis=1), 0.5) for q in p]
        ink += lettering(name, p[-1, 0] + 2, p[-1, 1] + 0.8)
        self.layers.append(Layer(name, Strokes.of(ink), colour=colour))

    def drawing(self, title: str) -> ig.Drawing:
        return ig.Drawing(tuple(self.layers), self.width, self.height, title=title)


def errors() -> dict[str, list[float]]:
    """Root mean square over the picture of a soft ball under a sawtooth of sixteen teeth."""
    n = 24
    z, y, x = np.mgrid[:n, :n, :n] - (n - 1) / 2
    volume = ig.Volume.from_array(np.exp(-(x**2 + y**2 + z**2) / 72).astype(np.float32))
    points: list[tuple[float, str, float]] = []
    for i in range(16):
        colour = ("#d04030", "#f0e0b0", "#3060a0")[i % 3]
        points += [(i / 16, colour, 0.0), ((i + 1) / 16, colour, 0.1)]
    function = ig.TransferFunction.from_points(points)
    camera = ig.Camera.looking((0.3, 1.0, 0.2), volume, 96)
    want = ig.render(volume, function, camera, lit=False, step=1 / 64).array
    return {
        when: [
            float(np.sqrt(((ig.render(volume, function, camera, classify=when, lit=False, step=1 / r).array - want) ** 2).mean()))
            for r in RATES
        ]
        for when in ("pre", "post", "preintegrated")
    }


def make(data: Path | None, size: int) -> ig.Drawing:
    across = [(np.log2(2 * r) / 4, text) for r, text in ((0.5, "0.5"), (1, "1"), (2, "2"), (4, "4"), (8, "8"))]
    up = [(np.log10(e / 0.0005) / 2, text) for e, text in ((0.0005, "0.05 %"), (0.005, "0.5 %"), (0.05, "5 %"))]
    figure = Figure(across, up, "samples a voxel", "error")
    for name, off in errors().items():
        points = [(np.log2(2 * r) / 4, np.log10(e / 0.0005) / 2) for r, e in zip(RATES, off, strict=True)]
        figure.curve(points, name, COLOURS[name], marks=True)
    return figure.drawing("Error of classification over the rate of samples")
