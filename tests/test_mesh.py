"""TriangleMesh: what its report says of closed, open, one-sided and broken surfaces."""

from __future__ import annotations

import math

import numpy as np
import pytest

from intaglio import InputError, TriangleMesh

CORNERS = np.array([(0, 0, 0), (1, 0, 0), (0, 1, 0), (0, 0, 1)], dtype=float)
TETRAHEDRON = np.array([(0, 2, 1), (0, 1, 3), (0, 3, 2), (1, 2, 3)])


def box(lid: bool) -> TriangleMesh:
    vertices = np.array([(x, y, z) for z in (0, 1) for y in (0, 1) for x in (0, 1)], dtype=float)
    quads = [(0, 2, 3, 1), (0, 1, 5, 4), (1, 3, 7, 5), (3, 2, 6, 7), (2, 0, 4, 6), (4, 5, 7, 6)]
    return TriangleMesh(vertices, np.array([t for a, b, c, d in quads[: 6 if lid else 5] for t in ((a, b, c), (a, c, d))]))


def moebius(steps: int) -> TriangleMesh:
    angle = np.linspace(0, 2 * math.pi, steps, endpoint=False)
    radius = 2 + np.outer(np.cos(angle / 2), (-1, 1))
    height = np.outer(np.sin(angle / 2), (-1, 1))
    vertices = np.stack([radius * np.cos(angle)[:, None], radius * np.sin(angle)[:, None], height], axis=2).reshape(-1, 3)
    triangles = []
    for i in range(steps):
        a, b = 2 * i, 2 * i + 1
        c, d = (2 * i + 2, 2 * i + 3) if i + 1 < steps else (1, 0)
        triangles += [(a, c, b), (b, c, d)]
    return TriangleMesh(vertices, np.array(triangles))


def volume(mesh: TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def test_tetrahedron_is_sound():
    mesh = TriangleMesh(CORNERS, TETRAHEDRON)
    report = mesh.report
    assert (report.closed, report.manifold, report.oriented, report.components) == (True, True, True, 1)
    assert report.caveats == ()
    assert volume(mesh) == pytest.approx(1 / 6)


def test_boxes_with_and_without_a_lid():
    assert box(lid=True).report.caveats == ()
    assert volume(box(lid=True)) == pytest.approx(1.0)
    report = box(lid=False).report
    assert (report.closed, report.manifold, report.oriented) == (False, True, True)
    assert report.caveats == ("open: 4 boundary edges",)


def test_flipped_triangle_is_found():
    triangles = TETRAHEDRON.copy()
    triangles[2] = triangles[2][::-1]
    report = TriangleMesh(CORNERS, triangles).report
    assert report.closed
    assert report.caveats == ("triangles of one surface face different ways",)


def test_moebius_strip_has_no_sides():
    report = moebius(24).report
    assert (report.closed, report.manifold, report.oriented, report.components) == (False, True, False, 1)
    assert report.boundary_edges == 48


def test_two_components_and_unused_vertices():
    vertices = np.concatenate([CORNERS, [(9, 9, 9)], CORNERS + 5])
    mesh = TriangleMesh(vertices, np.concatenate([TETRAHEDRON, TETRAHEDRON + 5]))
    assert mesh.report.components == 2
    assert mesh.report.caveats == ()


def test_third_triangle_at_an_edge_is_not_manifold():
    vertices = np.concatenate([CORNERS, [(1, 1, -1)]])
    report = TriangleMesh(vertices, np.concatenate([TETRAHEDRON, [(0, 1, 4)]])).report
    assert not report.manifold
    assert report.nonmanifold_edges == 1
    assert report.boundary_edges == 2
    assert report.caveats[1] == "not manifold: 1 edges with more than two triangles"


def test_triangles_without_area_are_counted_and_join_nothing():
    vertices = np.concatenate([CORNERS, [(5, 5, 5), (6, 6, 6), (7, 7, 7)]])
    mesh = TriangleMesh(vertices, np.concatenate([TETRAHEDRON, [(4, 4, 4), (5, 6, 5)]]))
    assert mesh.report.degenerate_triangles == 2
    assert mesh.report.components == 1
    assert mesh.report.caveats == ("2 triangles without area",)
    line = TriangleMesh(vertices, np.array([(4, 5, 6)]))
    assert line.report.degenerate_triangles == 1


def test_nothing_but_degenerate_triangles():
    report = TriangleMesh(CORNERS, np.array([(0, 0, 1)])).report
    assert (report.closed, report.components, report.degenerate_triangles) == (False, 0, 1)


def test_corners_span_the_vertices():
    corners = TriangleMesh(CORNERS * (1, 2, 3), TETRAHEDRON).corners
    assert corners.shape == (8, 3)
    np.testing.assert_array_equal([corners.min(axis=0), corners.max(axis=0)], [(0, 0, 0), (1, 2, 3)])


def test_arrays_get_their_types():
    mesh = TriangleMesh(CORNERS.astype(np.float32)[::-1], TETRAHEDRON.astype(np.uint64))
    assert (mesh.vertices.dtype, mesh.triangles.dtype) == (np.float64, np.int32)
    assert mesh.vertices.flags.c_contiguous


@pytest.mark.parametrize(
    ("vertices", "triangles", "message"),
    [
        (CORNERS[:, :2], TETRAHEDRON, r"vertices must be \(n, 3\) finite numbers, not \(4, 2\)"),
        (CORNERS * math.nan, TETRAHEDRON, "finite numbers"),
        (CORNERS, np.zeros((0, 3), dtype=int), "m > 0"),
        (CORNERS, TETRAHEDRON[:, :2], "m > 0"),
        (CORNERS, TETRAHEDRON + 1, r"outside 0\.\.3"),
        (CORNERS, TETRAHEDRON - 1, r"outside 0\.\.3"),
        (CORNERS, TETRAHEDRON + 2**32, r"outside 0\.\.3"),
        (CORNERS, TETRAHEDRON + 0.5, "triangles must be integers, not float64"),
    ],
)
def test_refuses_bad_meshes(vertices, triangles, message):
    with pytest.raises(InputError, match=f"tooth: .*{message}"):
        TriangleMesh(vertices, triangles, name="tooth")
