"""NIfTI-1 and NIfTI-2 in a single file.

ITK holds two copies of the voxels while it reads NIfTI, passes over truncated data, and refuses a
sheared sform; so the voxels are streamed here. The tests compare with ITK.
"""

# R. W. Cox et al., "A (sort of) new image data format standard: NIfTI-1", 2004; the field names are those of nifti1.h.

from __future__ import annotations

import math
from pathlib import Path
from typing import TYPE_CHECKING, Any

import numpy as np
from numpy.typing import NDArray

from intaglio.errors import InputError
from intaglio.io.distances import MARK
from intaglio.io.geometry import NO_ORIENTATION, Matrix, ras_from_lps
from intaglio.io.limits import check_index, check_memory, check_payload, check_shape, check_spacing
from intaglio.io.payload import is_gzip, opened, read_slices, skip

if TYPE_CHECKING:
    from intaglio.compute import Progress

_TYPES = {2: "u1", 4: "i2", 8: "i4", 16: "f4", 64: "f8", 256: "i1", 512: "u2", 768: "u4", 1024: "i8", 1280: "u8"}
_OTHER_TYPES = {1: "bits", 32: "complex", 128: "RGB", 1536: "float128", 1792: "complex", 2304: "RGBA"}
_MM = {0: 1.0, 1: 1000.0, 2: 1.0, 3: 0.001}

# sizeof_hdr -> field -> (offset, type)
_FIELDS: dict[int, dict[str, tuple[int, Any]]] = {
    348: {
        "dim": (40, ("i2", 8)), "datatype": (70, "i2"), "pixdim": (76, ("f4", 8)), "vox_offset": (108, "f4"),
        "scl_slope": (112, "f4"), "scl_inter": (116, "f4"), "xyzt_units": (123, "u1"), "qform_code": (252, "i2"),
        "sform_code": (254, "i2"), "quatern": (256, ("f4", 3)), "qoffset": (268, ("f4", 3)), "srow": (280, ("f4", (3, 4))),
        "magic": (344, "S3"), "descrip": (148, "S80"),
    },
    540: {
        "dim": (16, ("i8", 8)), "datatype": (12, "i2"), "pixdim": (104, ("f8", 8)), "vox_offset": (168, "i8"),
        "scl_slope": (176, "f8"), "scl_inter": (184, "f8"), "xyzt_units": (500, "i4"), "qform_code": (344, "i4"),
        "sform_code": (348, "i4"), "quatern": (352, ("f8", 3)), "qoffset": (376, ("f8", 3)), "srow": (400, ("f8", (3, 4))),
        "magic": (4, "S3"), "descrip": (240, "S80"),
    },
}  # fmt: skip


def _header(path: Path, deflated: bool) -> tuple[dict[str, Any], str]:
    """Fields by name, and the byte order."""
    with opened(path, deflated=deflated) as stream:
        data = stream.read(540)
    for order in "<>":
        size = int(np.frombuffer(data[:4].ljust(4, b"\0"), order + "i4")[0])
        if size in _FIELDS and len(data) >= size:
            fields = _FIELDS[size]
            formats = [(order + kind if isinstance(kind, str) else (order + kind[0], kind[1])) for _, kind in fields.values()]
            layout = np.dtype(
                {"names": list(fields), "formats": formats, "offsets": [o for o, _ in fields.values()], "itemsize": size}
            )
            record = np.frombuffer(data[:size], layout)[0]
            if record["magic"] in (b"n+1", b"n+2"):
                return {key: record[key].tolist() for key in fields}, order
    raise InputError(f"{path.name}: is not a single-file NIfTI (no n+1 or n+2 header); export it as .nii or .nii.gz")


def _quaternion_transform(h: dict[str, Any]) -> Matrix:
    """Method 2 of nifti1.h."""
    b, c, d = h["quatern"]
    a = math.sqrt(max(0.0, 1.0 - (b * b + c * c + d * d)))
    rotation = np.array(
        [
            [a * a + b * b - c * c - d * d, 2 * (b * c - a * d), 2 * (b * d + a * c)],
            [2 * (b * c + a * d), a * a + c * c - b * b - d * d, 2 * (c * d - a * b)],
            [2 * (b * d - a * c), 2 * (c * d + a * b), a * a + d * d - b * b - c * c],
        ]
    )
    matrix = np.eye(4)
    matrix[:3, :3] = rotation * [*h["pixdim"][1:3], h["pixdim"][3] * (-1 if h["pixdim"][0] < 0 else 1)]
    matrix[:3, 3] = h["qoffset"]
    return matrix


def _transform(name: str, h: dict[str, Any], notes: list[str]) -> Matrix:
    """The sform if there is one, else the qform, else the spacing alone."""
    sform = np.vstack([h["srow"], [0.0, 0.0, 0.0, 1.0]])
    if h["sform_code"] > 0:
        matrix = sform
        if not np.isfinite(sform).all() or abs(np.linalg.det(sform)) < 1e-12:
            raise InputError(f"{name}: sform must be invertible, not {h['srow']}; set sform_code to 0 or repair it")
        if h["qform_code"] > 0:
            other = _quaternion_transform(h)
            ends = np.array([[0, 0, 0, 1], [*(np.array(h["dim"][1:4]) - 1), 1]], dtype=np.float64).T
            apart = float(np.abs((sform - other) @ ends).max())
            if not apart <= 0.1:
                notes.append(f"the qform differs from the sform by up to {apart:.3g} mm: the sform is used")
    else:
        check_spacing(name, h["pixdim"][1:4], "give spacing=")
        if h["qform_code"] > 0:
            matrix = _quaternion_transform(h)
        else:
            matrix = ras_from_lps(np.diag([*h["pixdim"][1:4], 1.0]))
            notes.append(NO_ORIENTATION)
    mm = _MM.get(h["xyzt_units"] & 7, 1.0)
    if mm != 1.0:
        matrix = np.diag([mm, mm, mm, 1.0]) @ matrix
    check_spacing(name, np.linalg.norm(matrix[:3, :3], axis=0).tolist())
    return matrix


def read_nifti(
    path: Path, *, index: int | None = None, spacing: list[float] | None = None, progress: Progress | None = None
) -> tuple[NDArray[Any], Matrix, list[str]]:
    """Array (z, y, x), world_from_index and notes of a .nii or .nii.gz file; spacing where the header has none."""
    name = path.name
    deflated = is_gzip(path)
    h, order = _header(path, deflated)
    notes: list[str] = []
    dim = h["dim"][1 : 1 + h["dim"][0]] if 1 <= h["dim"][0] <= 7 else []
    while len(dim) > 3 and dim[-1] == 1:
        dim = dim[:-1]
    check_shape(name, dim[:3])
    if len(dim) > 4:
        raise InputError(f"{name}: voxels must be single numbers, not vectors of {dim[4:]}; export one component")
    count = dim[3] if len(dim) == 4 else 1
    check_index(name, count, index)
    if h["datatype"] not in _TYPES:
        kind = _OTHER_TYPES.get(h["datatype"], f"type {h['datatype']}")
        raise InputError(f"{name}: voxels must be single integers or floats, not {kind}; convert the file")
    stored = np.dtype(order + _TYPES[h["datatype"]])
    x, y, z = dim[:3]
    size = x * y * z * stored.itemsize
    if not h["vox_offset"] >= 0:
        raise InputError(f"{name}: vox_offset must not be negative, not {h['vox_offset']!r}; the header is broken")
    begin = max(int(h["vox_offset"]), 352 if h["magic"] == b"n+1" else 544)
    room = path.stat().st_size - (0 if deflated else begin)
    check_payload(name, size * count, room, deflated=deflated)
    check_memory(name, size)
    if spacing and not all(math.isfinite(s) and s > 0 for s in h["pixdim"][1:4]):
        h["pixdim"][1:4] = spacing
    matrix = _transform(name, h, notes)
    if h["descrip"].startswith(MARK.encode()):
        notes.append(MARK)
    slope, intercept = h["scl_slope"], h["scl_inter"]
    if slope == 0 or not math.isfinite(slope) or not math.isfinite(intercept):
        slope, intercept = 1.0, 0.0
    with opened(path, deflated=deflated) as stream:
        skip(stream, begin + size * (index or 0))
        array = read_slices(stream, (z, y, x), stored, name=name, slope=slope, intercept=intercept, progress=progress)
        if count == 1:
            stream.read(1)  # lets gzip see the end, and with it the checksum
    return array, matrix, notes
