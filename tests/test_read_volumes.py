from __future__ import annotations

import gc
import gzip
import os
import re
import struct
import subprocess
import sys
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
import SimpleITK as sitk
from numpy.typing import NDArray

import intaglio as ig
from intaglio import InputError, read_volume
from intaglio.io import payload, volumes

Shared = Callable[[str], Path]

TYPES = ["u1", "i1", "u2", "i2", "u4", "i4", "u8", "i8", "f4", "f8"]
ROTATION = np.linalg.qr(np.random.default_rng(3).normal(size=(3, 3)))[0]


def values(dtype: str = "i2") -> NDArray[Any]:
    """(20, 30, 40), using the whole range of 16 bits where the type has it."""
    info = np.iinfo(dtype) if dtype[0] in "iu" else np.iinfo("i2")
    low, high = max(info.min, -(2**15)), min(info.max, 2**15 - 1)
    return np.random.default_rng(0).integers(low, high, (20, 30, 40), endpoint=True).astype(dtype)


def write(path: Path, array: NDArray[Any] | None = None, *, compressed: bool = False, rotated: bool = True) -> Path:
    image = sitk.GetImageFromArray(values() if array is None else array)
    image.SetSpacing((0.5, 0.7, 2.0))
    image.SetOrigin((10.0, -20.0, 30.0))
    if rotated:
        image.SetDirection((ROTATION * np.sign(np.linalg.det(ROTATION))).ravel().tolist())
    sitk.WriteImage(image, str(path), compressed)
    return path


def itk_world(path: Path) -> NDArray[np.float64]:
    """World position (RAS+) of the origin and of one step along each axis, by SimpleITK."""
    image = sitk.ReadImage(str(path))
    corners = [(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)]
    return np.array([image.TransformIndexToPhysicalPoint(c) for c in corners]) * (-1, -1, 1)


def patched(path: Path, offset: int, layout: str, *numbers: float) -> Path:
    data = bytearray(path.read_bytes())
    struct.pack_into(layout, data, offset, *numbers)
    path.write_bytes(data)
    return path


def replaced(path: Path, old: str, new: str) -> Path:
    data = path.read_bytes()
    assert old.encode() in data
    path.write_bytes(data.replace(old.encode(), new.encode()))
    return path


def error_of(path: Path, **options: Any) -> str:
    with pytest.raises(InputError) as caught:
        read_volume(path, **options)
    message = str(caught.value)
    assert "\n" not in message
    assert path.name in message
    return message


@pytest.mark.parametrize("dtype", TYPES)
@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".nhdr", ".mha", ".mhd"])
def test_every_type_in_every_format(tmp_path: Path, suffix: str, dtype: str) -> None:
    path = write(tmp_path / f"v{suffix}", values(dtype), compressed=dtype != "i2" and suffix != ".mhd")
    v = read_volume(path)
    assert v.name == path.name
    assert v.array.dtype == np.dtype(dtype)
    np.testing.assert_array_equal(v.array, values(dtype))
    world = np.array([[0, 0, 0, 1], [1, 0, 0, 1], [0, 1, 0, 1], [0, 0, 1, 1]]) @ v.world_from_index.T
    np.testing.assert_allclose(world[:, :3], itk_world(path), atol=1e-5)
    assert v.notes == ()


def test_big_endian_nifti_and_nifti_2(tmp_path: Path) -> None:
    path = write(tmp_path / "v.nii", rotated=False)
    data = path.read_bytes()
    fields = "<i10s18sihc B8h3f4h8f3fhcB4f2i80s24s2h6f12f16s4s".replace(" ", "")
    head = struct.unpack(fields, data[:348])
    swapped = struct.pack(">" + fields[1:], *head) + data[348:352] + values().astype(">i2").tobytes()
    (tmp_path / "big.nii").write_bytes(swapped)
    v = read_volume(tmp_path / "big.nii")
    np.testing.assert_array_equal(v.array, values())
    assert v.array.dtype.isnative
    np.testing.assert_allclose(v.world_from_index, read_volume(path).world_from_index)

    two = bytearray(544)
    struct.pack_into("<i8shh", two, 0, 540, b"n+2\0\r\n\x1a\n", 4, 16)
    struct.pack_into("<8q", two, 16, 3, 40, 30, 20, 1, 1, 1, 1)
    struct.pack_into("<8d", two, 104, 1, 0.5, 0.7, 2, 1, 1, 1, 1)
    struct.pack_into("<q2d", two, 168, 544, 1.0, 0.0)
    struct.pack_into("<ii", two, 344, 0, 1)
    struct.pack_into("<12d", two, 400, 0.5, 0.1, 0, -7, 0, 0.7, 0, 8, 0, 0, 2, 9)
    (tmp_path / "two.nii").write_bytes(bytes(two) + values().tobytes())
    v = read_volume(tmp_path / "two.nii")
    np.testing.assert_array_equal(v.array, values())
    # A shear, which ITK refuses.
    np.testing.assert_allclose(v.world_from_index[:3], [[0.5, 0.1, 0, -7], [0, 0.7, 0, 8], [0, 0, 2, 9]])


def test_nifti_scaling_and_units(tmp_path: Path) -> None:
    v = read_volume(patched(write(tmp_path / "a.nii"), 112, "<2f", 0.25, -3.0))
    assert v.array.dtype == np.float32
    np.testing.assert_allclose(v.array, values() * 0.25 - 3.0)
    v = read_volume(patched(write(tmp_path / "b.nii", values("i4") * 10_000), 112, "<2f", 1.0, 0.5))
    assert v.array.dtype == np.float64
    np.testing.assert_array_equal(v.array, values("i4") * 10_000.0 + 0.5)
    v = read_volume(patched(write(tmp_path / "c.nii"), 112, "<2f", 0.0, 9.0))  # slope 0: not scaled
    assert v.array.dtype == np.int16
    v = read_volume(patched(write(tmp_path / "d.nii"), 123, "<B", 1))
    np.testing.assert_allclose(v.spacing, (500, 700, 2000), rtol=1e-6)


def test_nifti_sform_and_qform(tmp_path: Path) -> None:
    path = write(tmp_path / "a.nii")
    both = read_volume(path).world_from_index
    qform = read_volume(patched(path, 254, "<h", 0))
    np.testing.assert_allclose(qform.world_from_index, both, atol=1e-5)
    assert qform.notes == ()
    moved = read_volume(patched(patched(path, 254, "<h", 1), 268, "<f", 5.0))
    np.testing.assert_allclose(moved.world_from_index, both, atol=1e-5)
    assert moved.notes == ("the qform differs from the sform by up to 15 mm: the sform is used",)
    neither = read_volume(patched(path, 252, "<2h", 0, 0))
    assert "no orientation stored" in neither.notes[0]
    np.testing.assert_allclose(np.diag(neither.world_from_index), (-0.5, -0.7, 2, 1), rtol=1e-6)
    patched(path, 80, "<f", 0.0)
    assert "spacing must be three positive numbers in mm, not (0.0," in error_of(path)
    np.testing.assert_allclose(read_volume(path, spacing=2).spacing, 2)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha"])
def test_four_dimensions(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"v{suffix}"
    frames = [sitk.GetImageFromArray(values("f4") + k) for k in range(3)]
    sitk.WriteImage(sitk.JoinSeries(frames), str(path))
    assert error_of(path).endswith("holds 3 volumes; choose one with index=0..2")
    np.testing.assert_array_equal(read_volume(path, index=1).array, values("f4") + 1)
    assert "index must be between 0 and 2, not 3" in error_of(path, index=3)
    sitk.WriteImage(sitk.JoinSeries(frames[:1]), str(path))
    np.testing.assert_array_equal(read_volume(path).array, values("f4"))


@pytest.mark.parametrize("suffix", [".nii", ".nrrd", ".mha", ".tif"])
def test_colours_and_single_images_are_refused(tmp_path: Path, suffix: str) -> None:
    path = tmp_path / f"v{suffix}"
    one = sitk.GetImageFromArray(values("u1"))
    sitk.WriteImage(sitk.Compose([one] * 3), str(path))
    assert "voxels must be single" in error_of(path)
    sitk.WriteImage(one[:, :, 3], str(path))
    assert "single image of 40 x 30" in error_of(path)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha", ".tif"])
def test_nan_and_infinity(tmp_path: Path, suffix: str) -> None:
    a = values("f4")
    a[1, 2, 3], a[4, 0] = np.nan, np.inf
    path = write(tmp_path / f"v{suffix}", a)
    expected = f"v{suffix}: 41 voxels are NaN or infinite; replace them with fill=VALUE"
    assert error_of(path) == expected
    filled = read_volume(path, fill=-7).array
    np.testing.assert_array_equal(filled, np.where(np.isfinite(a), a, -7))
    with pytest.raises(InputError, match="fill must be a finite number, not nan"):
        read_volume(path, fill=float("nan"))


def test_spacing_from_the_caller(tmp_path: Path) -> None:
    path = write(tmp_path / "v.nrrd")
    before = read_volume(path).world_from_index
    v = read_volume(path, spacing=(1, 2, 3))
    np.testing.assert_allclose(v.spacing, (1, 2, 3))
    np.testing.assert_allclose(v.world_from_index[:3, :3] / (2, 2 / 0.7, 1.5), before[:3, :3], atol=1e-9)
    for wrong in (0, -1, (1, 2), "wide", float("nan")):
        with pytest.raises(InputError, match="spacing must be three positive numbers"):
            read_volume(path, spacing=wrong)


@pytest.mark.parametrize("kind", ["<i2", ">i2", ">u2", "<f8", "u1"])
def test_raw(tmp_path: Path, kind: str) -> None:
    a = values(np.dtype(kind).newbyteorder("=").str[1:])
    (tmp_path / "v.raw").write_bytes(a.astype(kind).tobytes())
    (tmp_path / "v.raw.gz").write_bytes(gzip.compress(a.astype(kind).tobytes()))
    for name in ("v.raw", "v.raw.gz"):
        v = read_volume(tmp_path / name, raw=((40, 30, 20), kind, (1, 2, 3)))
        assert v.array.dtype == np.dtype(kind).newbyteorder("=")
        np.testing.assert_array_equal(v.array, a)
        np.testing.assert_allclose(np.diag(v.world_from_index), (-1, -2, 3, 1))
        assert "no orientation stored" in v.notes[0]


def test_raw_that_does_not_fit(tmp_path: Path) -> None:
    path, packed = tmp_path / "v.raw", tmp_path / "v.raw.gz"
    path.write_bytes(values().tobytes())
    packed.write_bytes(gzip.compress(values().tobytes()))
    assert "raw voxels need raw=((x, y, z), dtype, spacing)" in error_of(path)
    assert "expected 50400 bytes of voxels, found 48000" in error_of(path, raw=((40, 30, 21), "i2", 1))
    assert "expected 45600 bytes of voxels, found 48000" in error_of(path, raw=((40, 30, 19), "i2", 1))
    assert "expected 50400 bytes of voxels, found 48000" in error_of(packed, raw=((40, 30, 21), "i2", 1))
    assert "expected 45600 bytes of voxels, found more" in error_of(packed, raw=((40, 30, 19), "i2", 1))
    assert "cannot hold them" in error_of(packed, raw=((40000, 30000, 20000), "i2", 1))
    for wrong in ("junk", ((40, 30), "i2", 1), ((40, 30, 20), "O", 1), ((40, 30, 20), "c16", 1), ((40, 30, 20), "i2", 0)):
        error_of(path, raw=wrong)


def test_gzip_bomb_is_read_no_further_than_promised(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = tmp_path / "v.raw.gz"
    path.write_bytes(gzip.compress(bytes(1 << 24)))
    taken = 0
    original = gzip.GzipFile.readinto

    def counting(self: gzip.GzipFile, buffer: Any) -> int:
        nonlocal taken
        taken += (got := original(self, buffer))
        return got

    monkeypatch.setattr(payload.gzip.GzipFile, "readinto", counting)
    assert "found more" in error_of(path, raw=((64, 64, 64), "u1", 1))
    assert taken < 1 << 22


def damaged(path: Path, data: bytes) -> str:
    path.write_bytes(data)
    return error_of(path)


@pytest.mark.parametrize("suffix", [".nii", ".nii.gz", ".nrrd", ".mha", ".tif"])
@pytest.mark.parametrize("compressed", [False, True])
def test_damaged_files(tmp_path: Path, suffix: str, compressed: bool, capfd: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path / f"v{suffix}", compressed=compressed)
    whole = path.read_bytes()
    for part in (whole[:-20], whole[: len(whole) // 2], whole[:60]):
        if len(part) < len(whole) - 20 or suffix != ".tif":  # the last bytes of a TIFF need not be voxels
            damaged(path, part)
    assert damaged(path, b"").endswith("is empty; get the file again")
    damaged(path, b"hello world\n" * 400)
    damaged(path, np.random.default_rng(0).bytes(5000))
    if suffix == ".nii.gz" or (compressed and suffix in (".nrrd", ".mha")):
        middle = len(whole) * 3 // 4
        damaged(path, whole[:middle] + bytes(b ^ 90 for b in whole[middle : middle + 40]) + whole[middle + 40 :])
    assert capfd.readouterr() == ("", "")


def test_headers_that_promise_too_much(tmp_path: Path) -> None:
    path = patched(write(tmp_path / "v.nii"), 42, "<3h", 30000, 30000, 30000)
    assert "expected 54000000000000 bytes of voxels, found 48000" in error_of(path)
    (tmp_path / "v.nii.gz").write_bytes(gzip.compress(path.read_bytes()))
    assert "compressed bytes cannot hold them" in error_of(tmp_path / "v.nii.gz")
    for suffix in (".nrrd", ".mha"):
        for compressed in (False, True):
            huge = write(tmp_path / f"v{suffix}", compressed=compressed)
            message = error_of(replaced(huge, "40 30 20", "1000000 1000000 1000000"))
            assert "expected 2000000000000000000 bytes of voxels" in message


def test_more_than_the_free_memory_is_refused(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    path = write(tmp_path / "v.nii")
    monkeypatch.setattr("intaglio.io.limits._free_memory", lambda: 40000.0)
    assert "needs 48 kB of memory, 40 kB are free" in error_of(path)


@pytest.mark.parametrize("value", ["0", "-1", "nan"])
def test_spacing_in_text_headers(tmp_path: Path, value: str) -> None:
    wrong = f"spacing must be three positive numbers in mm, not ({float(value)}, 0.7, 2.0)"
    assert wrong in error_of(replaced(write(tmp_path / "v.mha"), "ElementSpacing = 0.5", f"ElementSpacing = {value}"))
    if value != "-1":
        path = write(tmp_path / "v.nrrd", rotated=False)
        assert wrong in error_of(replaced(path, "(0.5,0,0)", f"({value},0,0)"))


@pytest.mark.parametrize(
    "target", ["../../../../etc/passwd", "/etc/passwd", "LIST\n/etc/passwd", "../v%03d.raw 1 20 1", "link.raw"]
)
@pytest.mark.parametrize("suffix", [".nhdr", ".mhd"])
def test_data_files_outside_the_folder_are_refused(tmp_path: Path, suffix: str, target: str) -> None:
    (tmp_path / "link.raw").symlink_to("/etc/passwd")
    path = replaced(write(tmp_path / f"v{suffix}"), "v.raw", target)
    assert "data file must lie in the header's folder" in error_of(path)


def test_data_file_that_is_missing(tmp_path: Path) -> None:
    path = write(tmp_path / "v.mhd")
    (tmp_path / "v.raw").unlink()
    assert "data file 'v.raw' is missing" in error_of(path)


def test_nrrd_spaces(tmp_path: Path) -> None:
    path = write(tmp_path / "v.nrrd", rotated=False)
    lps = read_volume(path)
    ras = read_volume(replaced(path, "left-posterior-superior", "right-anterior-superior"))
    np.testing.assert_allclose(ras.world_from_index, np.diag((-1, -1, 1, 1)) @ lps.world_from_index)
    other = read_volume(replaced(path, "right-anterior-superior", "scanner-xyz"))
    assert "says nothing of the patient" in other.notes[0]
    sheared = read_volume(replaced(replaced(path, "scanner-xyz", "LPS"), "(0,0,2)", "(0,0.5,2)"))
    np.testing.assert_allclose(sheared.world_from_index[:3, 2], (0, -0.5, 2), atol=1e-12)


def test_paths_that_are_nothing(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> None:
    with pytest.raises(InputError, match=r"gone\.nii: no such file or folder"):
        read_volume(tmp_path / "gone.nii")
    for name in ("v.foo", "v"):
        (tmp_path / name).write_text("text")
        assert "kind must be one of .nii" in error_of(tmp_path / name)

    def refuse(*_: Any, **__: Any) -> None:
        raise PermissionError(13, "Permission denied")

    path = write(tmp_path / "v.nii")
    monkeypatch.setattr(volumes, "read_nifti", refuse)
    assert "cannot be read (Permission denied); check its permissions" in error_of(path)


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="root may read everything")
@pytest.mark.parametrize("suffix", [".nii", ".nrrd", ".mha", ".tif"])
def test_files_that_may_not_be_read(tmp_path: Path, suffix: str) -> None:
    path = write(tmp_path / f"v{suffix}")
    path.chmod(0)
    assert "check its permissions" in error_of(path)


def stack(folder: Path, suffix: str, planes: NDArray[Any]) -> Path:
    folder.mkdir()
    for k, plane in enumerate(planes):
        sitk.WriteImage(sitk.GetImageFromArray(plane), str(folder / f"slice {k + 5}{suffix}"))
    return folder


@pytest.mark.parametrize(("suffix", "dtype"), [(".tif", "f4"), (".tiff", "i2"), (".png", "u2"), (".png", "u1")])
def test_stacks(tmp_path: Path, suffix: str, dtype: str) -> None:
    folder = stack(tmp_path / "scan", suffix, values(dtype))
    seen: list[tuple[int, int]] = []
    v = read_volume(folder, progress=lambda *step: seen.append(step))
    np.testing.assert_array_equal(v.array, values(dtype))
    np.testing.assert_allclose(np.diag(v.world_from_index), (-1, -1, 1, 1))
    assert v.notes[0] == "no spacing stored: 1 mm assumed"
    assert seen[-1] == (20, 20)
    spaced = read_volume(folder, spacing=(0.5, 0.5, 2))
    np.testing.assert_allclose(spaced.spacing, (0.5, 0.5, 2))
    assert len(spaced.notes) == 1
    (folder / f"slice 9{suffix}").unlink()
    with pytest.raises(InputError, match=rf"missing between slice 8{re.escape(suffix)} and slice 10"):
        read_volume(folder)


def test_stacks_of_one_kind_only(tmp_path: Path) -> None:
    folder = stack(tmp_path / "scan", ".png", values("u2"))
    sitk.WriteImage(sitk.GetImageFromArray(values("u2")[0, :5]), str(folder / "slice 7.png"))
    with pytest.raises(InputError, match=r"slice 7\.png is 40 x 5 uint16, slice 5\.png is 40 x 30 uint16"):
        read_volume(folder)
    (folder / "slice 7.png").write_bytes((folder / "slice 8.png").read_bytes()[:300])
    with pytest.raises(InputError, match=r"slice 7\.png: cannot be read"):
        read_volume(folder)


def test_pages_of_several_sizes(tmp_path: Path) -> None:
    from PIL import Image

    pages = [Image.fromarray(plane) for plane in values("u1")]
    path = tmp_path / "v.tif"
    pages[0].save(path, save_all=True, append_images=pages[1:], compression="tiff_lzw")
    np.testing.assert_array_equal(read_volume(path).array, values("u1"))
    pages[3] = pages[3].resize((10, 10))
    pages[0].save(path, save_all=True, append_images=pages[1:])
    assert "pages have several sizes, [(10, 10), (40, 30)]" in error_of(path)


def test_the_array_outlives_the_image(tmp_path: Path) -> None:
    # SimpleITK's own view does not keep the image: reading it then ends the process.
    path = tmp_path / "v.nrrd"
    a = np.random.default_rng(0).integers(0, 1000, (100, 200, 200)).astype(np.int16)
    sitk.WriteImage(sitk.GetImageFromArray(a), str(path))
    array = read_volume(path).array
    gc.collect()
    junk = [np.ones(a.shape, np.int16) for _ in range(4)]
    np.testing.assert_array_equal(array, a)
    del junk


@pytest.mark.skipif(not sys.platform.startswith("linux"), reason="reads /proc")
def test_no_second_copy(tmp_path: Path) -> None:
    a = np.zeros((256, 512, 512), np.int16)
    a[::7] = 5
    for suffix in (".nii", ".nii.gz", ".nrrd"):
        sitk.WriteImage(sitk.GetImageFromArray(a), str(tmp_path / f"v{suffix}"), suffix == ".nii.gz", 1)
    code = """
import gc, sys
import SimpleITK  # loaded when it is wanted, and not to be counted
from intaglio.io.volumes import read_volume
def memory(key):
    return next(int(line.split()[1]) * 1024 for line in open("/proc/self/status") if line.startswith(key))
for path in sys.argv[1:]:
    gc.collect()
    before = memory("VmRSS")
    open("/proc/self/clear_refs", "w").write("5")
    volume = read_volume(path)
    print((memory("VmHWM") - before) / volume.array.nbytes)
    del volume
"""
    names = [str(tmp_path / f"v{suffix}") for suffix in (".nii", ".nii.gz", ".nrrd")]
    result = subprocess.run([sys.executable, "-c", code, *names], capture_output=True, text=True, check=True)
    ratios = [float(line) for line in result.stdout.split()]
    assert len(ratios) == 3
    assert max(ratios) < 1.15, ratios


def test_patient_sides(shared: Shared) -> None:
    ct = read_volume(shared("volumes/ct_abdomen.nii.gz"))
    labels = read_volume(shared("volumes/ct_abdomen_labels.nii.gz"))
    np.testing.assert_allclose(ct.world_from_index, labels.world_from_index)

    def centre(label: int) -> NDArray[np.float64]:
        z, y, x = np.argwhere(labels.array == label).mean(axis=0)
        return (labels.world_from_index @ (x, y, z, 1.0))[:3]

    spleen, right_kidney, left_kidney, liver = centre(1), centre(2), centre(3), centre(5)
    assert liver[0] > spleen[0] + 100
    assert right_kidney[0] > left_kidney[0] + 100
    assert liver[2] > right_kidney[2]  # superior
    assert ct.array[labels.array == 5].mean() == pytest.approx(44, abs=3)  # HU of liver


def information(image: NDArray[Any], label: NDArray[Any]) -> float:
    """Mutual information of grey values and a binary label, in nats."""
    counts = np.histogram2d(image.ravel(), label.ravel(), bins=(32, 2), range=((0, 512), (0, 2)))[0]
    joint = counts / counts.sum()
    apart = joint.sum(axis=1, keepdims=True) * joint.sum(axis=0, keepdims=True)
    seen = joint > 0
    return float((joint[seen] * np.log(joint[seen] / apart[seen])).sum())


def test_two_orientations_one_space(shared: Shared) -> None:
    """A RAS NIfTI and an LPS NRRD of the same head come together through their world transforms alone.

    Mirrored placements fit worse along every axis. The headers differ by two voxels in z, and they do so the
    wrong way: at the base of the skull the label fits best 3 to 4 voxels above where its header puts it, two
    above the same index. The reader gives what the headers say.
    """
    head = read_volume(shared("volumes/mr_head.nii.gz"))
    label = read_volume(shared("volumes/mr_head_labels.nrrd"))
    head_from_label = head.index_from_world @ label.world_from_index
    np.testing.assert_allclose(np.diag(head_from_label), (-1, -1, 1, 1), atol=1e-5)
    np.testing.assert_allclose(head_from_label[:3, 3], (159, 231, -2), atol=0.01)

    placed = np.roll(label.array[:, ::-1, ::-1], -2, axis=0)
    box = (slice(8, 150, 2), slice(None, None, 2), slice(None, None, 2))
    right = information(head.array[box], placed[box])
    mirrored = [information(head.array[box], np.flip(placed, axis)[box]) for axis in (0, 1, 2)]
    assert right > max(mirrored)

    base = (slice(10, 70), slice(150, 232), slice(20, 140))
    fits = [information(head.array[base], np.roll(placed, up, axis=0)[base]) for up in range(7)]
    assert int(np.argmax(fits)) in (3, 4)


def test_other_scans(shared: Shared) -> None:
    tooth = read_volume(shared("volumes/tooth.nhdr"))
    raw = read_volume(shared("volumes/tooth.raw"), raw=((103, 94, 161), ">u2", (1, 1, 1)))
    assert tooth.range == (0, 1300)
    np.testing.assert_array_equal(tooth.array, raw.array)
    np.testing.assert_allclose(tooth.world_from_index, raw.world_from_index)
    head = read_volume(shared("volumes/ct_head.nii.gz"))
    assert head.array.dtype == np.float32
    assert head.range == (0, pytest.approx(0.9996, abs=1e-4))
    vessels = read_volume(shared("volumes/aneurism.raw.gz"), raw=((256, 256, 256), "u1", 1))
    assert vessels.range == (0, 255)


def test_tiff_scan(shared: Shared, tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    import tarfile

    with tarfile.open(shared("volumes/ct_head_tiff.tar.xz")) as archive:
        archive.extractall(tmp_path, filter="data")
    v = read_volume(tmp_path / "head", spacing=(1, 1, 2))
    assert v.shape == (99, 256, 256)
    assert capfd.readouterr() == ("", "")


def test_constant_volume_and_public_name(tmp_path: Path) -> None:
    v = ig.read_volume(str(write(tmp_path / "v.nii", np.full((4, 4, 4), 7, np.uint8))))
    assert v.range == (7, 7)
