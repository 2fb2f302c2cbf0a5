"""Drawing: strokes and dots on paper, in millimetres; and Image, its raster sibling."""

from __future__ import annotations

import re
from collections.abc import Iterable, Iterator
from dataclasses import dataclass, field
from functools import cached_property
from os import PathLike

import numpy as np
from numpy.typing import NDArray

from intaglio.brush import PEN, brush_named
from intaglio.errors import InputError

Floats = NDArray[np.float32]


@dataclass(frozen=True, eq=False)
class Stroke:
    """One movement of the pen: points (n, 2) in mm, width (n,) in mm and opacity (n,) along it."""

    points: Floats
    width: Floats
    opacity: Floats


@dataclass(frozen=True, eq=False)
class Strokes:
    """Many strokes, packed: stroke i is points[offsets[i]:offsets[i + 1]], and so on.

    points (n, 2) mm, y down; width (n,) mm; opacity (n,) 0..1; offsets (m + 1,) int64, first 0, last n.
    Every stroke has at least two points.
    """

    points: Floats
    width: Floats
    opacity: Floats
    offsets: NDArray[np.int64]

    def __post_init__(self) -> None:
        n = len(self.points)
        assert self.points.shape == (n, 2) and self.width.shape == (n,) and self.opacity.shape == (n,)
        assert len(self.offsets) > 0 and self.offsets[0] == 0 and self.offsets[-1] == n
        assert (np.diff(self.offsets) >= 2).all()

    @classmethod
    def of(cls, strokes: Iterable[Stroke]) -> Strokes:
        """Pack single strokes."""
        many = list(strokes)
        if not many:
            return cls.none()
        return cls(
            np.concatenate([s.points for s in many]).astype(np.float32),
            np.concatenate([s.width for s in many]).astype(np.float32),
            np.concatenate([s.opacity for s in many]).astype(np.float32),
            np.concatenate([[0], np.cumsum([len(s.points) for s in many])]).astype(np.int64),
        )

    @classmethod
    def none(cls) -> Strokes:
        empty = np.zeros(0, dtype=np.float32)
        return cls(np.zeros((0, 2), dtype=np.float32), empty, empty, np.zeros(1, dtype=np.int64))

    def __len__(self) -> int:
        return len(self.offsets) - 1

    def __getitem__(self, i: int) -> Stroke:
        part = slice(self.offsets[i], self.offsets[i + 1])
        return Stroke(self.points[part], self.width[part], self.opacity[part])

    def __iter__(self) -> Iterator[Stroke]:
        return (self[i] for i in range(len(self)))


@dataclass(frozen=True, eq=False)
class Dots:
    """Round dots: points (n, 2) in mm, diameter (n,) in mm, opacity (n,)."""

    points: Floats
    diameter: Floats
    opacity: Floats

    @classmethod
    def none(cls) -> Dots:
        empty = np.zeros(0, dtype=np.float32)
        return cls(np.zeros((0, 2), dtype=np.float32), empty, empty)

    def __len__(self) -> int:
        return len(self.points)


@dataclass(frozen=True, eq=False)
class Layer:
    """What one pen draws: a tone, or a kind of line. Colour is "#rrggbb".

    brush  what its strokes are drawn with in pictures: "pen", a name of `BRUSHES`, or an image file as the tip
    """

    name: str
    strokes: Strokes = field(default_factory=Strokes.none)
    dots: Dots = field(default_factory=Dots.none)
    colour: str = "#000000"
    brush: str = PEN

    def __post_init__(self) -> None:
        check_colour(self.colour)
        brush_named(self.brush)


@dataclass(frozen=True, eq=False)
class Drawing:
    """A plate: layers from the bottom up, on paper of a size in mm. Saves as SVG, PDF or PNG.

    grain  roughness of the paper, 0..1, on which brushes catch in pictures
    """

    layers: tuple[Layer, ...]
    width_mm: float
    height_mm: float
    paper: str = "#ffffff"
    title: str = ""
    grain: float = 0.0

    def __post_init__(self) -> None:
        check_colour(self.paper)
        if not 0 <= self.grain <= 1:
            raise InputError(f"grain must be between 0 and 1, not {self.grain!r}")
        if not (0 < self.width_mm < 1e5 and 0 < self.height_mm < 1e5):
            raise InputError(f"paper must have a positive size in mm, not {self.width_mm!r} x {self.height_mm!r}")

    def save(self, path: str | PathLike[str], *, dpi: float = 300.0, plotter: bool = False) -> None:
        """Write .svg, .pdf or .png, chosen by the extension; the file appears only when it is complete.

        dpi      of a PNG
        plotter  SVG: plain polylines of one width a layer instead of filled strokes
        """
        from intaglio.io.plates import save_drawing

        save_drawing(self, path, dpi=dpi, plotter=plotter)

    def image(self, dpi: float = 150.0) -> Image:
        """The plate as pixels, antialiased."""
        from intaglio.io.raster import rasterize_drawing

        return rasterize_drawing(self, dpi)

    def _repr_svg_(self) -> str:
        from intaglio.io.svg import svg_text

        return svg_text(self)

    def _repr_png_(self) -> bytes:
        return self.image()._repr_png_()


@dataclass(frozen=True, eq=False)
class Image:
    """RGBA picture: array (height, width, 4) float32, 0..1, display colours, alpha not multiplied in."""

    array: Floats
    dpi: float = 150.0

    def __post_init__(self) -> None:
        assert self.array.ndim == 3 and self.array.shape[2] == 4

    @cached_property
    def bytes8(self) -> NDArray[np.uint8]:
        """(height, width, 4) uint8."""
        return (np.clip(self.array, 0.0, 1.0) * 255.0 + 0.5).astype(np.uint8)

    def save(self, path: str | PathLike[str], *, bits: int = 8) -> None:
        """Write a PNG of 8 or 16 bits; the file appears only when it is complete."""
        from intaglio.io.plates import save_image

        save_image(self, path, bits=bits)

    def _repr_png_(self) -> bytes:
        from intaglio.io.png import png_bytes

        return png_bytes(self)


def check_colour(colour: str) -> None:
    if not re.fullmatch(r"#[0-9a-fA-F]{6}", colour):
        raise InputError(f'colour must be "#rrggbb", not {colour!r}')
