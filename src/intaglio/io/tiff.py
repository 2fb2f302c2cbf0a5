"""Whether a TIFF is whole: libtiff drops the pages that a truncated file has lost."""

# Aldus Corporation, "TIFF Revision 6.0", 1992.

from __future__ import annotations

import struct
from pathlib import Path

from intaglio.errors import InputError

_WIDTH, _HEIGHT = 256, 257
_OFFSETS, _COUNTS = (273, 324), (279, 325)  # of strips, of tiles
_INTEGERS = {3: "H", 4: "I", 16: "Q"}
_MOST_PAGES = 1 << 20


def check_tiff(path: Path) -> None:
    """Follow the pages of a TIFF; refuse one that points beyond its end, and pages of several sizes."""
    whole = path.stat().st_size
    with path.open("rb") as file:

        def at(offset: int, layout: str) -> tuple[int, ...]:
            file.seek(offset)
            size = struct.calcsize(layout)
            if not 0 < offset <= whole - size:
                raise InputError(
                    f"{path.name}: points to byte {offset + size}, the file holds {whole}; it is truncated, get it again"
                )
            return struct.unpack(layout, file.read(size))

        start = file.read(16)
        order = {b"II": "<", b"MM": ">"}.get(start[:2], "")
        kind = struct.unpack(order + "H", start[2:4])[0] if order and len(start) == 16 else 0
        if kind not in (42, 43):
            raise InputError(f"{path.name}: is not a TIFF file (no TIFF magic); check its name")
        count, word, inline = ("H", "I", 4) if kind == 42 else ("Q", "Q", 8)
        entry = struct.calcsize("=HH" + word) + inline
        page = at(4 if kind == 42 else 8, order + word)[0]
        seen: set[int] = set()
        sizes: set[tuple[int, ...]] = set()
        while page:
            if page in seen or len(seen) > _MOST_PAGES:
                raise InputError(f"{path.name}: pages follow each other in a circle; the file is broken")
            seen.add(page)
            n = at(page, order + count)[0]
            first = page + struct.calcsize("=" + count)
            found: dict[int, tuple[int, ...]] = {}
            for k in range(n):
                where = first + k * entry
                tag, code, values = at(where, order + "HH" + word)
                if tag in (_WIDTH, _HEIGHT, *_OFFSETS, *_COUNTS) and code in _INTEGERS and 0 < values <= whole:
                    layout = f"{order}{values}{_INTEGERS[code]}"
                    place = where + entry - inline
                    found[tag] = at(place if struct.calcsize(layout) <= inline else at(place, order + word)[0], layout)
            for offsets, counts in zip(_OFFSETS, _COUNTS, strict=True):
                for begin, size in zip(found.get(offsets, ()), found.get(counts, ()), strict=False):
                    if size:
                        at(begin + size - 1, order + "B")
            sizes.add(found.get(_WIDTH, ()) + found.get(_HEIGHT, ()))
            if len(sizes) > 1:
                raise InputError(f"{path.name}: pages have several sizes, {sorted(sizes)}; keep one")
            page = at(first + n * entry, order + word)[0]
