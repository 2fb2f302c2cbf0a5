"""Bad input ends in one line that says what to do, soon, and leaves nothing behind."""

from __future__ import annotations

import errno
import gzip
import os
import re
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import SimpleITK as sitk
from dicom_files import planes, stacked, write_series
from test_cli import ball, process, run, write_scan

import intaglio.rendering.isosurface as isosurface_module
from intaglio.io import plates


@pytest.fixture
def folder(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Path:
    """Where the command runs: an empty folder, but for in/."""
    (tmp_path / "work" / "in").mkdir(parents=True)
    monkeypatch.chdir(tmp_path / "work")
    return tmp_path / "work"


def refused(*args: object, words: str, code: int = 1, **env: str) -> None:
    """One line of error after notes, and no new file in the folder."""
    before = sorted(Path().rglob("*"))
    done = run(*args, **env)
    *notes, error = done.err.splitlines()
    assert done.code == code, done.err
    assert done.out == ""
    assert all(note.startswith(("note: ", "Compiling ")) for note in notes)
    assert error.startswith("error: ")
    assert re.search(words, error), error
    assert sorted(Path().rglob("*")) == before


def nan_voxels() -> np.ndarray:
    array = ball().astype(np.float32)
    array[3, :2, 0] = np.nan, np.inf
    return array


def cut(path: Path, count: int) -> Path:
    path.write_bytes(path.read_bytes()[:count])
    return path


def written(path: Path, data: bytes | str) -> Path:
    path.write_bytes(data if isinstance(data, bytes) else data.encode())
    return path


def huge_nifti(path: Path) -> Path:
    head = bytearray(write_scan(path, ball()).read_bytes())
    head[42:48] = np.array([32767] * 3, "<i2").tobytes()
    return written(path, bytes(head))


def two_series(folder: Path) -> Path:
    for uid in ("1.2.3.4", "1.2.3.5"):
        write_series(folder / uid, planes(), stacked(), uid=uid)
    return folder


def beating(path: Path) -> Path:
    sitk.WriteImage(sitk.JoinSeries([sitk.GetImageFromArray(ball())] * 3), str(path))
    return path


def flat_image(path: Path) -> Path:
    sitk.WriteImage(sitk.GetImageFromArray(ball()[5]), str(path))
    return path


MHD = "ObjectType = Image\nNDims = 3\nDimSize = 1000000 1000000 1000000\nElementType = MET_UCHAR\nElementDataFile = LOCAL\n"
TRIANGLE = "solid a\nfacet normal 0 0 1\nouter loop\nvertex 0 0 0\nvertex 1 0 0\nvertex 0 1 0\nendloop\nendfacet\nendsolid a\n"

# Name, what makes the file, what the line says.
FILES: list[tuple[str, Callable[[Path], Path], str]] = [
    ("missing.nii", lambda p: p, "missing.nii: no such file or folder; check the path"),
    ("empty.nii", lambda p: written(p, b""), "empty.nii: is empty; get the file again"),
    ("empty.nii.gz", lambda p: written(p, gzip.compress(b"")), "empty.nii.gz: "),
    ("empty.raw", lambda p: written(p, b""), "empty.raw: .*(--raw|empty)"),
    ("short.nii", lambda p: cut(write_scan(p, ball()), 9000), "short.nii: .*truncated"),
    ("head.nii", lambda p: cut(write_scan(p, ball()), 100), "head.nii: "),
    ("short.nii.gz", lambda p: cut(write_scan(p, ball()), 2000), "short.nii.gz: .*(truncated|damaged|whole|again)"),
    ("text.nii", lambda p: written(p, "Dear reader,\nthis is a letter.\n" * 40), "text.nii: "),
    ("text.nii.gz", lambda p: written(p, "Dear reader,\n" * 40), "text.nii.gz: "),
    ("text.nrrd", lambda p: written(p, "Dear reader,\n" * 40), "text.nrrd: "),
    ("text.dcm", lambda p: written(p, "Dear reader,\n" * 40), "text.dcm: "),
    ("text.tif", lambda p: written(p, "Dear reader,\n" * 40), "text.tif: "),
    ("report.docx", lambda p: written(p, "Dear reader,\n"), "report.docx: kind must be one of .nii .*"),
    ("huge.mhd", lambda p: written(p, MHD), "huge.mhd: "),
    ("huge.nii", huge_nifti, "huge.nii: .*(truncated|memory)"),
    ("nan.nii.gz", lambda p: write_scan(p, nan_voxels()), "nan.nii.gz: 2 voxels are NaN or infinite; .*--fill"),
    ("flat.nii.gz", lambda p: write_scan(p, np.full((4, 5, 6), 7, np.int16)), "flat.nii.gz: every voxel is 7"),
    ("image.nii", flat_image, "image.nii: is a single image of 28 x 26 pixels"),
    ("image.tif", flat_image, "image.tif: is a single image"),
    ("beat.nii", beating, "beat.nii: holds 3 volumes; .*--index"),
    ("voxels.raw", lambda p: written(p, bytes(60)), "voxels.raw: raw voxels have no header; say what they are with --raw"),
    (
        "bone.stl",
        lambda p: written(p, TRIANGLE),
        "bone.stl: is a mesh, and this command takes volumes: .intaglio distance bone.stl -o bone",
    ),
]


@pytest.mark.parametrize(("name", "make", "words"), FILES, ids=[name for name, _, _ in FILES])
def test_files(name: str, make: Callable[[Path], Path], words: str, folder: Path):
    refused("hatch", make(folder / "in" / name), words=words)


def test_folders(folder: Path):
    refused("hatch", "in", words="^error: in: no slices found; give a folder with DICOM")
    written(folder / "in" / "notes.txt", "nothing")
    refused("hatch", "in", words="^error: in: no slices found")
    refused("hatch", two_series(folder / "in"), words="holds 2 DICOM series; .*--series.* 1: .* 2: ")
    refused("hatch", "in", "--series", 3, words="series must be one of 1..2 or a uid, not '3'")
    assert run("info", "in", "--series", 2).code == 0


@pytest.mark.parametrize(
    ("options", "words"),
    [
        ("--iso 5000", "iso must be within the volume's values, above 0 up to 1000, not 5000"),
        ("--iso -1", "above 0 up to 1000, not -1"),
        ("--perspective 60 --distance 1", "camera is inside the .*1 mm.*use more than"),
        ("--distance 0", "camera is inside"),
        ("--index 3", "index must be between 0 and 0, not 3"),
        ("--size 20", "use a larger"),
    ],
)
def test_what_only_the_scan_can_tell(options: str, words: str, folder: Path):
    refused("hatch", write_scan(folder / "in" / "egg.nii.gz", ball()), *options.split(), words=words)


# These name a scan that is missing: what is wrong with the options is said first.
OPTIONS = [
    ("-o plate.jpg", 2, "'--output': must end in .svg, .pdf or .png, not 'plate.jpg'"),
    ("-o plate", 2, "'--output': must end in .svg, .pdf or .png, not 'plate'"),
    ("-o nowhere/plate.svg", 1, "output folder nowhere does not exist: create it first"),
    ("-o in", 1, "in is a folder: name a file in it, ending in .svg, .pdf or .png"),
    ("-o in/taken/plate.svg", 1, "output folder in/taken does not exist"),
    ("-o in/folder.svg", 1, "in/folder.svg is a folder"),
    (f"-o {'a' * 300}.svg", 1, "cannot be written: File name too long"),
    ("-o plate.png --plotter", 2, "'--plotter': needs an .svg output, not 'plate.png'"),
    ("--style crayon", 2, "'--style': must be one of pen-and-ink, engraving, pencil, .*, not 'crayon'"),
    ("--brush mop", 2, "brush must be pen, pencil, .*, or an image file .*, not 'mop'"),
    ("--brush mop.png", 1, "brush 'mop.png' does not exist"),
    ("--hand-points 17", 2, "'--hand-points': must be a whole number, 2 to 16, not '17'"),
    ("--no-hand --hand-turn 20", 2, "'--hand-turn': cannot be given together with --no-hand"),
    ("--view 0,0,0", 2, "view must be three numbers that are not all zero"),
    ("--view nan,0,1", 2, "view must be three numbers"),
    ("--view 1,2", 2, "view must be three numbers"),
    ("--view 1", 2, "view must be one of anterior, .* or x,y,z; not '1'"),
    ("--view nonsense", 2, "view must be one of anterior, .* or x,y,z; not 'nonsense'"),
    ("--view left-right", 2, "view must not name a side twice or opposite sides, not 'left-right'"),
    ("--view anterior-posterior-left", 2, "view must not name a side twice or opposite sides"),
    ("--view left-left", 2, "view must not name a side twice"),
    ("--light 0,0,0", 2, "light direction must be three numbers that are not all zero"),
    ("--light 1,inf,0", 2, "light direction must be three numbers"),
    ("--ink red", 2, "colour must be \"#rrggbb\", not 'red'"),
    ("--paper #fff", 2, 'colour must be "#rrggbb"'),
    ("--thinnest 1 --thickest 0.1", 2, "thinnest must not be above thickest"),
    ("--light 1,0", 2, "'--light': must be three numbers such as 1,1,2.5, not '1,0'"),
    ("--light left", 2, "'--light': must be three numbers"),
    ("--size 0", 2, "'--size': must be a whole number, 1 to 32768, not '0'"),
    ("--size 1024x768", 2, "'--size': must be a whole number"),
    ("--size 1e3", 2, "'--size': must be a whole number"),
    ("--width nan", 2, "'--width': must be a number, 5 to 5000, not 'nan'"),
    ("--dpi 1e9", 2, "'--dpi': must be a number, 10 to 2400"),
    ("--seed -1", 2, "'--seed': must be a whole number, 0 or more, not '-1'"),
    ("--iso nan", 2, "'--iso': must be a number, not 'nan'"),
    ("--iso skin", 2, "'--iso': must be a number, not 'skin'"),
    ("--separation nan", 2, "'--separation': must be a number, 0.1 to 50, not 'nan'"),
    ("--perspective 180", 2, "'--perspective': must be a number, 1 to 120"),
    ("--distance -5", 2, "'--distance': must be a number, 0 or more"),
    ("--zoom 0", 2, "'--zoom': must be a number, 0.01 to 1000"),
    ("--roll inf", 2, "'--roll': must be a number, not 'inf'"),
    ("--fill nan", 2, "'--fill': must be a number, not 'nan'"),
    ("--index one", 2, "'--index': must be a whole number, 0 or more, not 'one'"),
    ("--colour red", 2, "No such option: --colour.*; see intaglio hatch --help"),
    ("--iso", 2, "--iso.* requires an argument; see intaglio .*--help"),
    ("--axes LR", 2, "axes must say to which side columns, rows and slices run, .* such as LPS, not 'LR'"),
    ("--axes RLS", 2, "not 'RLS'"),
    ("--inside left", 2, "'--inside': must be one of above, below, not 'left'"),
    ("--inside below --tf ct-bone", 2, "'--inside': is for isovalues"),
    ("--iso 3 --iso 4", 2, "^error: --iso can be given only once; see intaglio hatch --help"),
    ("-o a.svg --output b.svg", 2, "--output can be given only once"),
    ("--plotter --plotter", 2, "--plotter can be given only once"),
    ("--hand --no-hand", 2, "--hand and --no-hand can be given only once"),
    ("--tf ct-bone --preset ct-skin", 2, "can be given only once"),
    ("--cut mesh:a.nii", 1, "a.nii: no such file"),
    ("--cut bone.stl", 2, "'--cut': must be mesh:bone.stl to cut with a mesh"),
    ("--cut plane:up", 2, "'--cut': must be plane:SIDE"),
    ("--cut missing.nii", 1, "--cut missing.nii: no such file"),
    ("--cut plane:left,right", 2, "'--cut': must be plane:SIDE"),
    ("--label 33-26 --labels a.nii", 2, "'--label': 33-26 runs backwards; it must be 26-33"),
    ("other.nii", 2, "other.nii.*; see intaglio hatch --help"),
]


@pytest.mark.parametrize(("options", "code", "words"), OPTIONS, ids=[line[:40] for line, _, _ in OPTIONS])
def test_options_are_judged_before_the_scan_is_read(options: str, code: int, words: str, folder: Path):
    (folder / "in" / "folder.svg").mkdir()
    (folder / "in" / "taken").write_text("a file")
    refused("hatch", "missing.nii", *options.split(), words=words, code=code)


@pytest.mark.parametrize("layout", ["", "28x26", "28x26x24", "28x26x24,", "28,26,24,int16", "axbxc,int16", "28x26x24x2,int16"])
def test_layouts_of_raw_files_that_are_none(layout: str, folder: Path):
    ball().tofile("in/egg.raw")
    words = re.escape(f"'--raw': must be XxYxZ,TYPE such as 256x256x128,uint8 or '103x94x161,>u2', not {layout!r}")
    refused("info", "in/egg.raw", "--raw", layout, words=words, code=2)


@pytest.mark.parametrize(
    ("layout", "words"),
    [
        ("28x26x25,int16", "expected 36400 bytes of voxels, found 34944"),
        ("28x26x12,int16", "expected 17472 bytes of voxels, found 34944"),
        ("28x26x24,float99", "float99"),
        ("28x26x24,O", "must be a number type"),
        ("0x26x24,int16", "number of voxels must be positive"),
        ("-28x26x24,int16", "number of voxels must be positive"),
        ("1000000x1000000x1000000,uint8", "expected 1000000000000000000 bytes of voxels, found 34944"),
    ],
)
def test_layouts_of_raw_files_that_do_not_fit(layout: str, words: str, folder: Path):
    ball().tofile("in/egg.raw")
    refused("info", "in/egg.raw", "--raw", layout, words=f"egg.raw: .*{words}")
    with gzip.open("in/egg.raw.gz", "wb") as file:
        file.write(ball().tobytes())
    refused("hatch", "in/egg.raw.gz", "--raw", layout, words="egg.raw.gz: ")


@pytest.mark.parametrize("spacing", ["", "1,1", "one", "1,1,1,1", "0,1,1", "nan"])
def test_spacings(spacing: str, folder: Path):
    scan = write_scan(folder / "in" / "egg.nii.gz", ball())
    done = run("info", scan, "--spacing", spacing)
    assert done.code == 2
    assert re.fullmatch(r"error: .*three (positive )?numbers.*\n", done.err)


def test_usage(folder: Path):
    refused("hatch", code=2, words="Missing argument 'SCAN'; see intaglio hatch --help")
    refused("engrave", "scan.nii", code=2, words="No such command 'engrave'.*; see intaglio --help")
    refused("--quiet", code=2, words="No such option: --quiet.*; see intaglio --help")
    refused(
        "info",
        written(folder / "in" / "a.stl", TRIANGLE),
        "--fill",
        0,
        code=2,
        words="'--fill': are for scans, and this is a mesh",
    )


@pytest.mark.parametrize("command", [["hatch", "missing.nii"], ["info", "missing.nii"]])
@pytest.mark.parametrize("threads", ["zero", "0", "-1", "1.5"])
def test_threads(command: list[str], threads: str, folder: Path):
    refused(*command, words=f"INTAGLIO_THREADS must be a positive number, not '{threads}'", INTAGLIO_THREADS=threads)


def test_demo_where_it_cannot_write(folder: Path):
    written(folder / "plates", "a file")
    refused("demo", words="folder plates cannot be made: .*; choose another with --output")
    refused("demo", "-o", "plates/inside", words="folder plates/inside cannot be made")
    refused("demo", "-o", "in", INTAGLIO_THREADS="zero", words="INTAGLIO_THREADS")


@pytest.mark.skipif(not hasattr(os, "geteuid") or os.geteuid() == 0, reason="nothing is forbidden to root")
def test_folders_and_files_without_permission(folder: Path):
    scan = write_scan(folder / "in" / "egg.nii.gz", ball())
    (folder / "closed").mkdir(mode=0o500)
    refused("hatch", scan, "-o", "closed/plate.svg", words="output folder closed is not writable")
    written(folder / "in" / "plate.svg", "old").chmod(0o400)
    refused("hatch", scan, "-o", "in/plate.svg", words="in/plate.svg is write-protected")
    scan.chmod(0)
    refused("hatch", scan, words="egg.nii.gz: cannot be read .*permissions")


class TestInterrupted:
    @pytest.fixture
    def scan(self, folder: Path) -> Path:
        scan = write_scan(folder / "in" / "egg.nii.gz", ball())
        assert run("hatch", scan, "--width", 30, "-o", "plate.svg").code == 0
        return scan

    def check(self, scan: Path, code: int, words: str) -> None:
        """The plate that was there is as it was, and nothing else is there."""
        before = Path("plate.svg").read_bytes()
        done = run("hatch", scan, "--width", 40, "--iso", 500, "-o", "plate.svg")
        assert done.code == code
        assert done.out == ""
        assert re.fullmatch(words, done.err.strip())
        assert Path("plate.svg").read_bytes() == before
        assert sorted(p.name for p in Path().iterdir()) == ["in", "plate.svg"]

    def raising(self, error: BaseException) -> Callable[..., None]:
        def fail(*_: object, **__: object) -> None:
            raise error

        return fail

    def test_while_the_surface_is_found(self, scan: Path, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setattr(isosurface_module, "tiles", self.raising(KeyboardInterrupt()))
        self.check(scan, 130, "interrupted; nothing half-written is left")

    def test_while_writing(self, scan: Path, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setattr(plates.os, "replace", self.raising(KeyboardInterrupt()))
        self.check(scan, 130, "interrupted; nothing half-written is left")

    def test_disk_full_at_the_end(self, scan: Path, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setattr(plates.os, "replace", self.raising(OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))))
        self.check(scan, 1, "error: plate.svg cannot be written: No space left on device.*")

    def test_disk_full_on_the_way(self, scan: Path, monkeypatch: pytest.MonkeyPatch):
        def half(path: Path, mode: str) -> Half:
            return Half(open(path, mode))

        class Half:
            def __init__(self, file):
                self.file = file

            def __enter__(self):
                return self

            def __exit__(self, *_: object):
                self.file.close()

            def write(self, data: bytes) -> None:
                self.file.write(data[:100])
                raise OSError(errno.ENOSPC, os.strerror(errno.ENOSPC))

        monkeypatch.setattr(plates, "open", half, raising=False)
        self.check(scan, 1, "error: plate.svg cannot be written: No space left on device.*")

    def test_out_of_memory(self, scan: Path, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setattr(isosurface_module, "tiles", self.raising(MemoryError()))
        self.check(scan, 1, "error: not enough memory; take a smaller --size .*")

    def test_a_disk_that_fails(self, scan: Path, monkeypatch: pytest.MonkeyPatch):
        monkeypatch.setattr(isosurface_module, "tiles", self.raising(OSError(errno.EIO, "Input/output error", "cache.nbi")))
        self.check(scan, 1, "error: cache.nbi: Input/output error; check the disk and its permissions")


def test_a_name_of_two_lines_is_still_one_line(folder: Path):
    refused("hatch", "two\nlines.nii", words="two lines.nii: no such file")


def test_as_the_shell_sees_it(folder: Path):
    done = process("hatch", write_scan(folder / "in" / "nan.nii", nan_voxels()), "-o", "plate.svg", COLUMNS="30")
    assert done.code == 1
    assert done.out == ""
    assert re.fullmatch(r"error: nan\.nii: 2 voxels are NaN or infinite; .*--fill VALUE\n", done.err)
    assert [p.name for p in folder.iterdir()] == ["in"]
