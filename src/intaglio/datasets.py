"""Data that come with the package."""

from __future__ import annotations

from dataclasses import replace
from importlib.resources import as_file, files

from intaglio.io.volumes import read_volume
from intaglio.volume import Volume

_SIDES = "left and right are assumed: the scan does not tell them"


def head() -> Volume:
    """An MRI of a head with the brain laid open: (84, 128, 128) uint8, spacing 2, 2, 1.946 mm, sagittal slices.

    From the UNC Chapel Hill Volume Rendering Test Data Set by way of VolPack; source and licence stand in
    intaglio/data. Face anterior, vertex superior; which side is left is not known.
    """
    with as_file(files("intaglio").joinpath("data", "head.nii.gz")) as path:
        volume = read_volume(path)
    return replace(volume, name="head", notes=(*volume.notes, _SIDES))
