"""Make every example's picture at full size, docs/gallery/NAME.png, for one of them NAME.svg beside it, and a page of them."""

from __future__ import annotations

import importlib
import io
import sys
import time
from pathlib import Path
from types import ModuleType

import numpy as np
from PIL import Image as Picture

import intaglio as ig

HERE = Path(__file__).parent
ROOT = HERE.parent
WIDTH = 900
AS_SVG = "pen_and_ink_head"


def examples() -> list[ModuleType]:
    """The modules that make a picture."""
    names = sorted(p.stem for p in HERE.glob("*.py") if p.stem != "gallery" and p.stem[0] != "_")
    return [importlib.import_module(name) for name in names]


def data_folder() -> Path | None:
    """Real scans, if they lie beside the checkout."""
    folder = ROOT.parent / "shared" / "data"
    return folder if folder.is_dir() else None


def reading_size(plate: ig.Drawing | ig.Image, limit: int = 420_000) -> bytes:
    """A PNG of reading size, in as many greys or colours as stay below the limit of bytes."""
    image = plate.image(25.4 * 2 * WIDTH / plate.width_mm) if isinstance(plate, ig.Drawing) else plate
    picture = Picture.fromarray(image.bytes8[..., :3])
    picture = picture.resize((WIDTH, round(WIDTH * picture.height / picture.width)), Picture.Resampling.LANCZOS)
    pixels = np.asarray(picture).astype(int)
    if np.ptp(pixels, axis=2).max() < 12:
        picture = picture.convert("L")
    for colours in (256, 128, 64, 32, 16, 8):
        out = io.BytesIO()
        picture.quantize(colours, dither=Picture.Dither.NONE).save(out, "PNG", optimize=True)
        if out.tell() < limit:
            break
    return out.getvalue()


def page(modules: list[ModuleType]) -> str:
    """What the gallery shows, in words."""
    parts = [
        f"![{m.__name__}]({m.__name__}.png)\n\n{m.__doc__} [`{m.__name__}.py`](../../examples/{m.__name__}.py)\n" for m in modules
    ]
    return "# Gallery\n\nEach picture is one file in `examples/`; `make gallery` draws them all.\n\n" + "\n".join(parts)


def main(names: list[str]) -> None:
    """All pictures and the page of them, or some pictures by name."""
    folder = ROOT / "docs" / "gallery"
    folder.mkdir(parents=True, exist_ok=True)
    modules = examples()
    unknown = set(names) - {m.__name__ for m in modules}
    if unknown:
        sys.exit(f"no example is called {', '.join(sorted(unknown))}")
    for example in modules:
        if names and example.__name__ not in names:
            continue
        begun = time.perf_counter()
        plate = example.make(data_folder(), 1400)
        (folder / f"{example.__name__}.png").write_bytes(reading_size(plate))
        if example.__name__ == AS_SVG:
            assert isinstance(plate, ig.Drawing)
            plate.save(folder / f"{example.__name__}.svg")
        print(f"{example.__name__:<24}{time.perf_counter() - begun:6.2f} s  {example.__doc__}", flush=True)
    (folder / "README.md").write_text(page(modules), encoding="utf-8")


if __name__ == "__main__":
    sys.path.insert(0, str(HERE))
    main(sys.argv[1:])
