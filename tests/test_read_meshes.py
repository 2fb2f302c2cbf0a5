from __future__ import annotations

import json
import logging
from collections.abc import Callable
from pathlib import Path

import numpy as np
import pytest
import trimesh

import intaglio as ig
from intaglio import InputError, TriangleMesh, read_mesh
from intaglio.io.meshes import merge_vertices

Shared = Callable[[str], Path]

SPHERE = trimesh.creation.icosphere(2, radius=10)


def volume_of(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[corner] for corner in mesh.triangles.T)
    return float(np.einsum("ij,ij->", a, np.cross(b, c)) / 6)


def write(folder: Path, kind: str) -> Path:
    path = folder / f"sphere.{kind}"
    if kind == "gltf":
        for name, data in trimesh.exchange.gltf.export_gltf(trimesh.Scene(SPHERE)).items():
            (folder / name).write_bytes(data)
        (folder / "model.gltf").rename(path)
    else:
        SPHERE.export(path)
    return path


def error_of(path: Path) -> str:
    with pytest.raises(InputError) as caught:
        read_mesh(path)
    message = str(caught.value)
    assert "\n" not in message
    assert path.name in message
    return message


@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "off", "gltf", "glb"])
def test_formats(tmp_path: Path, kind: str, caplog: pytest.LogCaptureFixture, capfd: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, kind)
    caplog.set_level(logging.DEBUG)
    caplog.clear()
    steps: list[tuple[int, int]] = []
    m = read_mesh(path, progress=lambda *step: steps.append(step))
    assert m.name == f"sphere.{kind}"
    assert (len(m.vertices), len(m.triangles)) == (162, 320)
    assert m.report.closed
    assert m.report.components == 1
    assert volume_of(m) == pytest.approx(SPHERE.volume, rel=1e-6)
    assert m.notes == (("glTF lengths are metres: taken as millimetres",) if kind.startswith("gl") else ())
    assert steps == [(1, 3), (2, 3), (3, 3)]
    assert not caplog.records
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kind", ["stl", "ply", "obj", "off", "gltf", "glb"])
def test_damaged_files(tmp_path: Path, kind: str, capfd: pytest.CaptureFixture[str]) -> None:
    path = write(tmp_path, kind)
    whole = path.read_bytes()
    for part in (b"", b"hello world\n" * 40, np.random.default_rng(0).bytes(3000), whole[: len(whole) // 2]):
        path.write_bytes(part)
        error_of(path)
    if kind != "obj":  # nothing in an OBJ file says how much of it there is
        path.write_bytes(whole[:-7])
        error_of(path)
    assert capfd.readouterr() == ("", "")


@pytest.mark.parametrize("kind", ["ply", "stl"])
@pytest.mark.parametrize("lost", [20, 250])
def test_truncated_text(tmp_path: Path, kind: str, lost: int) -> None:
    path = tmp_path / f"sphere.{kind}"
    data = SPHERE.export(file_type="stl_ascii") if kind == "stl" else SPHERE.export(file_type="ply", encoding="ascii")
    text = data if isinstance(data, bytes) else data.encode()
    path.write_bytes(text)
    assert len(read_mesh(path).triangles) == 320
    path.write_bytes(text[:-lost])
    error_of(path)


def test_scene_becomes_one_mesh(tmp_path: Path) -> None:
    scene = trimesh.Scene()
    scene.add_geometry(SPHERE, transform=trimesh.transformations.translation_matrix((100, 0, 0)))
    scene.add_geometry(SPHERE, transform=np.diag([-1.0, 1.0, 1.0, 1.0]))
    scene.export(tmp_path / "two.glb")
    m = read_mesh(tmp_path / "two.glb")
    np.testing.assert_allclose(m.corners[[0, -1]], [[-10, -10, -10], [110, 10, 10]], atol=1e-5)
    assert m.report.components == 2
    # The mirrored part is not inside out.
    assert volume_of(m) == pytest.approx(2 * SPHERE.volume, rel=1e-6)


def test_triangles_face_outwards(tmp_path: Path) -> None:
    inverted = SPHERE.copy()
    inverted.invert()
    inverted.apply_translation((500, 0, 0))
    inverted.export(tmp_path / "in.ply")
    m = read_mesh(tmp_path / "in.ply")
    assert volume_of(m) > 0
    assert m.notes == ("triangles faced inwards: turned round",)


def test_polygons_groups_and_unused_vertices(tmp_path: Path) -> None:
    path = tmp_path / "v.obj"
    path.write_text(
        "mtllib ../../../../etc/passwd\nv 0 0 0\nv 1 0 0\nv 1 1 0\nv 0 1 0\nv nan 5 5\nv 2 0 0\nv 2 1 0\nvt 0 0\nvt 1 1\n"
        "usemtl a\nf 1/1 2/2 3/1 4/2\nusemtl b\nf 2/1 6/1 7/1 3/2\n"
    )
    m = read_mesh(path)
    # Two squares that share an edge, whatever their materials and texture coordinates.
    assert (len(m.vertices), len(m.triangles), m.report.boundary_edges) == (6, 4, 6)
    assert m.notes == ("open: 6 boundary edges",)


@pytest.mark.parametrize(
    ("text", "message"),
    [
        ("v 0 0 0\nv nan 0 0\nv 0 1 0\nf 1 2 3\n", "1 vertices are NaN or infinite"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\nf 1 2 9\n", "cannot be read as OBJ"),
        ("v 0 0 0\nv 1 0 0\nv 0 1 0\n", "holds points without faces"),
    ],
)
def test_broken_obj(tmp_path: Path, text: str, message: str) -> None:
    (tmp_path / "v.obj").write_text(text)
    assert message in error_of(tmp_path / "v.obj")


@pytest.mark.parametrize("uri", ["../../../../etc/passwd", "/etc/passwd", "http://localhost:1/x.bin", "gone.bin"])
def test_gltf_names_files_of_its_folder_only(tmp_path: Path, uri: str) -> None:
    path = write(tmp_path, "gltf")
    tree = json.loads(path.read_text(encoding="utf-8"))
    tree["buffers"][0]["uri"] = uri
    path.write_text(json.dumps(tree))
    assert uri in error_of(path)


def test_paths_that_are_nothing(tmp_path: Path) -> None:
    assert "no such file" in error_of(tmp_path / "gone.stl")
    assert "kind must be one of .stl .ply .obj" in error_of(tmp_path / "v.foo")
    (tmp_path / "folder.stl").mkdir()
    assert "cannot be read (Is a directory)" in error_of(tmp_path / "folder.stl")


def test_merge_vertices_is_exact() -> None:
    v = np.array([[0, 0, 0], [1, 0, 0], [0, 1, 0], [1, 0, 0], [1 + 2e-16, 0, 0], [-0.0, 0, 0]])
    merged, t = merge_vertices(v, np.array([[0, 1, 2], [5, 3, 4]]))
    assert len(merged) == 4
    np.testing.assert_array_equal(merged[t], v[[[0, 1, 2], [5, 3, 4]]])
    assert t[0, 0] == t[1, 0]
    assert t[0, 1] == t[1, 1] != t[1, 2]


@pytest.mark.parametrize(
    ("name", "triangles", "boundary", "nonmanifold", "components"),
    [
        ("bunny.obj", 69451, 223, 0, 1),
        ("bunny_watertight.obj", 69664, 0, 0, 1),
        ("skull_15k.stl", 15002, 0, 0, 1),
        ("femur.off", 7798, 0, 0, 1),
        ("hand.off", 2390, 0, 0, 1),
        ("liver.obj", 4384, 0, 0, 1),
        ("pelvis.obj", 9768, 0, 0, 1),
        ("torus.obj", 1600, 0, 0, 1),
        ("fandisk.obj", 12946, 0, 0, 1),
        ("teapot.obj", 6320, 160, 0, 3),
        ("bad/skull_6k_open.stl", 6589, 84, 13, 1),
        ("bad/bunny_broken.ply", 99785, 353, 132, 1),
        ("bad/chair_model.obj", 12756, 0, 9518, 3),
        ("bad/many_small_holes.ply", 3524, 556, 0, 1),
        ("bad/soup.stl", 100, 300, 0, 100),
        ("bad/hippo_tristrips.ply", 46202, 4, 0, 3),
    ],
)
def test_real_meshes(shared: Shared, name: str, triangles: int, boundary: int, nonmanifold: int, components: int) -> None:
    m = ig.read_mesh(shared(f"meshes/{name}"))
    r = m.report
    assert (len(m.triangles), r.boundary_edges, r.nonmanifold_edges, r.components) == (
        triangles,
        boundary,
        nonmanifold,
        components,
    )
    assert m.notes == r.caveats
    assert bool(m.notes) == (boundary > 0 or nonmanifold > 0)


@pytest.mark.parametrize(
    ("name", "message"),
    [("range_grid.ply", "points without faces"), ("empty.stl", "holds no faces"), ("empty.ply", "holds no faces")],
)
def test_files_without_a_surface(shared: Shared, name: str, message: str) -> None:
    assert message in error_of(shared(f"meshes/bad/{name}"))
