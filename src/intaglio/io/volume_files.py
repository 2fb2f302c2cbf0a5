"""write_volume: a volume as NIfTI, NRRD or MetaImage, placed where it is in the patient."""

from __future__ import annotations

import os
import secrets
from pathlib import Path
from typing import TYPE_CHECKING

import numpy as np

from intaglio.errors import InputError
from intaglio.io.distances import KEY, MARK
from intaglio.io.geometry import ras_from_lps
from intaglio.io.plates import check_output
from intaglio.volume import Volume, check_volume

if TYPE_CHECKING:
    from intaglio.compute import Progress

KINDS = (".nii", ".nii.gz", ".nrrd", ".mha")


def check_volume_output(path: str | os.PathLike[str]) -> Path:
    """The path, if a volume can be written there; meant to be called before long work. InputError otherwise."""
    target = Path(path)
    if target.name.lower().endswith(".nii.gz"):
        check_output(target.with_suffix(""), KINDS)
    return check_output(target, (*KINDS, ".gz") if target.name.lower().endswith(".nii.gz") else KINDS)


def write_volume(volume: Volume, path: str | os.PathLike[str], progress: Progress | None = None) -> None:
    """Write a .nii, .nii.gz, .nrrd or .mha file, which appears under its name only when it is complete.

    Voxels keep their type; bool becomes uint8, half and long floats become float32 and float64. Distances are marked as such,
    which `read_volume` understands. The file's orientation is LPS where the format says so, and 3D Slicer or SimpleITK find
    every voxel at its place in the world.
    progress is called with 0 or 1 done, of 1. Raises InputError where the file cannot be written, and for a sheared grid,
    which these formats do not know.
    """
    check_volume(volume)
    import SimpleITK as sitk

    target = check_volume_output(path)
    lps = ras_from_lps(volume.world_from_index)
    direction = lps[:3, :3] / volume.spacing
    if not np.allclose(direction.T @ direction, np.eye(3), atol=1e-5):
        raise InputError(f"{volume.name}: axes must be at right angles in files, and these are not; put it on another grid")
    if progress:
        progress(0, 1)
    image = sitk.GetImageFromArray(np.ascontiguousarray(volume.samples))
    image.SetSpacing(volume.spacing.tolist())
    image.SetOrigin(lps[:3, 3].tolist())
    # The nearest matrix at right angles to the last digit, or else NIfTI's quaternion comes out of another.
    u, _, v = np.linalg.svd(direction)
    image.SetDirection((u @ v).ravel().tolist())
    if volume.distances:
        image.SetMetaData(KEY, MARK)
    kind = next(k for k in KINDS[::-1] if target.name.lower().endswith(k))
    partial = target.with_name(f".{secrets.token_hex(6)}.partial{kind}")
    try:
        sitk.WriteImage(image, str(partial), useCompression=kind not in (".nii",), compressionLevel=1)
        os.replace(partial, target)
    except (OSError, RuntimeError) as error:
        reason = " ".join(str(error).split())[-160:]
        raise InputError(f"{target} cannot be written: {reason}; check the disk and its permissions") from None
    finally:
        partial.unlink(missing_ok=True)
    if progress:
        progress(1, 1)
