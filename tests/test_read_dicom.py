from __future__ import annotations

import math
import tarfile
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from dicom_files import NUMBER, ORIENTATION, POSITION, SPACING, patch, planes, stacked, without, write_series

from intaglio import InputError, read_volume


def test_series_is_sorted_by_position_and_placed(tmp_path: Path) -> None:
    a = planes()
    folder = write_series(tmp_path / "scan", a, stacked())
    v = read_volume(folder)
    assert v.name == "scan"
    assert v.notes == ()
    assert v.array.dtype == np.int16
    np.testing.assert_array_equal(v.array, a)
    np.testing.assert_allclose(v.world_from_index, [[-0.75, 0, 0, -1], [0, -0.5, 0, -2], [0, 0, 2, 3], [0, 0, 0, 1]])
    one = read_volume(folder / "s898.dcm")
    np.testing.assert_array_equal(one.array, a)


def test_folders_below_compressed_slices_and_progress(tmp_path: Path) -> None:
    a = planes()
    write_series(tmp_path / "scan" / "a" / "b", a, stacked(), compressed=True)
    (tmp_path / "scan" / "readme.txt").write_text("not a slice")
    seen: list[tuple[int, int]] = []
    v = read_volume(tmp_path / "scan", progress=lambda done, total: seen.append((done, total)))
    np.testing.assert_array_equal(v.array, a)
    assert seen[-1] == (8, 8)


def test_oblique_series_agrees_with_itk(tmp_path: Path) -> None:
    c, s = math.cos(0.3), math.sin(0.3)
    axes = (c, s, 0.0, 0.0, 0.0, -1.0)
    normal = np.cross(axes[:3], axes[3:])
    positions = [tuple(np.array([5.0, -6.0, 7.0]) + 1.5 * k * normal) for k in range(8)]
    folder = write_series(tmp_path / "scan", planes(), positions, axes=axes)
    v = read_volume(folder)
    names = sitk.ImageSeriesReader.GetGDCMSeriesFileNames(str(folder))
    image = sitk.ReadImage(names)
    for index in ((0, 0, 0), (29, 0, 0), (0, 19, 7), (29, 19, 7)):
        x, y, z = image.TransformIndexToPhysicalPoint(index)
        np.testing.assert_allclose((v.world_from_index @ [*index, 1])[:3], (-x, -y, z), atol=1e-4)


def test_gantry_tilt_is_kept_as_shear(tmp_path: Path) -> None:
    positions = [(1.0, 2.0 + 0.5 * k, 3.0 + 2.0 * k) for k in range(8)]
    v = read_volume(write_series(tmp_path / "scan", planes(), positions))
    np.testing.assert_allclose(v.world_from_index[:3, 2], (0, -0.5, 2), atol=1e-6)
    assert any("gantry tilt of 14.0 degrees" in note for note in v.notes)


@pytest.mark.parametrize(
    ("keep", "positions", "message"),
    [
        (
            [0, 1, 2, 3, 5, 6, 7],
            [z for k, z in enumerate(stacked()) if k != 4],
            r"a gap of 4\.00 mm between s897\.dcm and s896\.dcm",
        ),
        (range(8), [*stacked(4), *stacked(7)[3:]], r"same position \(9\.00 mm\), 1 such pairs"),
        (range(8), [*stacked(4), (1.0, 2.0, 11.8), *stacked()[5:]], r"steps from 1\.200 to 2\.800 mm"),
        (range(8), [*stacked(4), (1.0, 7.0, 11.0), *stacked()[5:]], r"s896\.dcm lies 5\.000 mm off"),
    ],
    ids=["missing slice", "duplicate", "irregular", "aside"],
)
def test_uneven_slices_are_refused(
    tmp_path: Path, keep: list[int], positions: list[tuple[float, float, float]], message: str
) -> None:
    with pytest.raises(InputError, match=message):
        read_volume(write_series(tmp_path / "scan", planes()[list(keep)], positions))


def test_rounded_positions_are_accepted(tmp_path: Path) -> None:
    positions = [(1.0, 2.0, round(0.625 * k, 1)) for k in range(9)]
    v = read_volume(write_series(tmp_path / "scan", planes(9), positions))
    assert v.spacing[2] == pytest.approx(0.625)


def test_mixed_sizes_and_orientations_are_refused(tmp_path: Path) -> None:
    write_series(tmp_path / "sizes", planes(), stacked())
    write_series(tmp_path / "sizes", planes(2)[:, :10], [(1, 2, 40), (1, 2, 42)], prefix="x")
    with pytest.raises(InputError, match=r"x899\.dcm is 30 x 10, s893\.dcm is 30 x 20"):
        read_volume(tmp_path / "sizes")
    write_series(tmp_path / "ways", planes(), stacked())
    write_series(tmp_path / "ways", planes(2), [(1, 2, 40), (1, 2, 42)], axes=(0, 1, 0, 0, 0, 1), prefix="x")
    with pytest.raises(InputError, match="face different ways"):
        read_volume(tmp_path / "ways")


def test_choosing_among_series(tmp_path: Path) -> None:
    write_series(tmp_path / "scan" / "a", planes(), stacked(), uid="1.2.5")
    write_series(tmp_path / "scan" / "b", planes(6), stacked(6), uid="1.2.6")
    with pytest.raises(InputError, match=r"2 DICOM series.*series=: 1: 30 x 20 x 8 .*\(1\.2\.5\); 2: 30 x 20 x 6 .*\(1\.2\.6\)"):
        read_volume(tmp_path / "scan")
    assert read_volume(tmp_path / "scan", series=2).shape == (6, 20, 30)
    assert read_volume(tmp_path / "scan", series="1").shape == (8, 20, 30)
    assert read_volume(tmp_path / "scan", series="1.2.6").shape == (6, 20, 30)
    with pytest.raises(InputError, match=r"series must be one of 1\.\.2 or a uid, not 3"):
        read_volume(tmp_path / "scan", series=3)


def test_localizers_are_left_out_with_a_note(tmp_path: Path) -> None:
    write_series(tmp_path / "scan" / "a", planes(1), stacked(1), uid="1.2.5")
    write_series(tmp_path / "scan" / "b", planes(), stacked(), uid="1.2.6")
    v = read_volume(tmp_path / "scan")
    assert v.shape == (8, 20, 30)
    assert "series 2 of 2 chosen" in v.notes[0]


def test_thin_headers_are_noted(tmp_path: Path) -> None:
    a = planes()
    v = read_volume(without(write_series(tmp_path / "1", a, stacked(), tags={"0018|0050": "3"}), POSITION))
    assert v.spacing[2] == 3
    np.testing.assert_array_equal(v.array, a)
    assert v.notes == ("no positions stored: slices placed by instance number, 3 mm apart",)
    v = read_volume(without(write_series(tmp_path / "2", a, stacked()), ORIENTATION))
    assert v.notes == ("no orientation stored: axial slices assumed",)
    v = read_volume(without(write_series(tmp_path / "3", a, stacked()), SPACING))
    assert v.notes == ("no pixel spacing stored: 1 mm assumed",)
    with pytest.raises(InputError, match="no position, location or instance number"):
        read_volume(without(write_series(tmp_path / "5", a, stacked()), POSITION, NUMBER))


def test_the_same_position_everywhere_is_none(tmp_path: Path) -> None:
    v = read_volume(write_series(tmp_path / "scan", planes(), [(0, 0, 0)] * 8))
    assert "placed by instance number" in v.notes[0]


def test_rescale(tmp_path: Path) -> None:
    a = planes()
    slope = b"\x28\0\x53\x10\x02\0\0\0"
    folder = write_series(tmp_path / "scan", a, stacked(), tags={"0028|1052": "-10", "0028|1053": "1"})
    v = read_volume(patch(folder, (slope + b"1 ", slope + b".5")))
    assert v.array.dtype == np.float32
    # The writer stored value + 10.
    np.testing.assert_allclose(v.array, 0.5 * (a.astype(np.float64) + 10) - 10)


def test_int32_only_where_needed(tmp_path: Path) -> None:
    wide = (planes().astype(np.int32) + 1000).astype(np.uint16) * 20
    folder = write_series(tmp_path / "scan", wide, stacked(), tags={"0028|1052": "-1024", "0028|1053": "1"})
    v = read_volume(folder)
    assert v.array.dtype == np.int32
    np.testing.assert_array_equal(v.array, wide)


def test_damaged_slice_is_named(tmp_path: Path) -> None:
    folder = write_series(tmp_path / "scan", planes(), stacked())
    data = (folder / "s896.dcm").read_bytes()
    (folder / "s896.dcm").write_bytes(data[: len(data) // 2])
    with pytest.raises(InputError, match=r"a gap of 4\.00 mm .*not readable: s896\.dcm"):
        read_volume(folder)


def test_frames_in_one_file(tmp_path: Path) -> None:
    a = planes().clip(0).astype(np.uint16)
    image = sitk.GetImageFromArray(a)
    image.SetSpacing((1, 2, 3))
    sitk.WriteImage(image, str(tmp_path / "frames.dcm"))
    v = read_volume(tmp_path / "frames.dcm")
    np.testing.assert_array_equal(v.array, a)
    np.testing.assert_allclose(v.spacing, (1, 2, 3))
    assert "multi-frame" in v.notes[0]


def test_what_is_no_series(tmp_path: Path) -> None:
    (tmp_path / "empty").mkdir()
    with pytest.raises(InputError, match="no slices found"):
        read_volume(tmp_path / "empty")
    with pytest.raises(InputError, match="single image"):
        read_volume(write_series(tmp_path / "one", planes(1), stacked(1)))
    (tmp_path / "text.dcm").write_text("text")
    with pytest.raises(InputError, match=r"text\.dcm: is not a DICOM image"):
        read_volume(tmp_path / "text.dcm")
    rgb = sitk.Image((4, 4), sitk.sitkVectorUInt8, 3)
    (tmp_path / "rgb").mkdir()
    sitk.WriteImage(rgb, str(tmp_path / "rgb" / "a.dcm"))
    with pytest.raises(InputError, match="colour or vector"):
        read_volume(tmp_path / "rgb")


def test_feet(shared: Callable[[str], Path], tmp_path: Path, capfd: pytest.CaptureFixture[str]) -> None:
    with tarfile.open(shared("volumes/ct_feet_dicom.tar.xz")) as archive:
        archive.extractall(tmp_path, filter="data")
    v = read_volume(tmp_path / "Ankle")
    assert v.shape == (150, 512, 512)
    assert v.array.dtype == np.int16  # GDCM alone gives int32
    np.testing.assert_allclose(v.spacing, 1)
    assert v.range[0] == -1024
    assert capfd.readouterr() == ("", "")
