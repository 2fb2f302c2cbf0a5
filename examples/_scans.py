"""Where the pictures' scans come from: a folder of real scans if there is one, else the embedded head."""

from __future__ import annotations

import tarfile
import tempfile
from pathlib import Path

import intaglio as ig
from intaglio.datasets import head


def scan(data: Path | None, name: str) -> tuple[ig.Volume, bool]:
    """A volume from data/volumes, and whether it is the one that was asked for; the embedded head otherwise.

    A ".tar.xz" is unpacked to a temporary folder and read as the series in it.
    """
    path = None if data is None else data / "volumes" / name
    if path is None or not path.exists():
        return head(), False
    if path.suffix != ".xz":
        return ig.read_volume(path), True
    with tempfile.TemporaryDirectory() as folder, tarfile.open(path) as archive:
        archive.extractall(folder, filter="data")
        return ig.read_volume(folder), True
