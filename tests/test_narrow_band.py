"""Narrow bands: a triangle asks no more voxels than it must, and none is forgotten, whatever the surface."""

from __future__ import annotations

from collections import Counter
from unittest.mock import patch

import numpy as np
import pytest
from hypothesis import given, settings, strategies as st
from oracle import mesh_distance
from test_voxelize import sphere

import intaglio as ig
from intaglio.solid import narrow_band
from intaglio.solid.edges import net_edges
from intaglio.solid.normal_cones import normals_and_spread

DEFECTS = ["none", "holes", "turned", "doubled", "apart", "flat", "two at a vertex"]


def bumpy(rng: np.random.Generator, roughness: float, defect: str) -> tuple[np.ndarray, np.ndarray]:
    """A ball of radius 4 whose vertices are moved by up to `roughness` mm, folds included, with something wrong."""
    ball = sphere(4.0, rings=int(rng.integers(3, 10)))
    vertices, triangles = ball.vertices + roughness * rng.uniform(-1, 1, ball.vertices.shape), ball.triangles.copy()
    some = rng.random(len(triangles)) < 0.1
    if defect == "holes":
        triangles = triangles[~some]
    elif defect == "turned":
        triangles[some] = triangles[some][:, ::-1]
    elif defect == "doubled":
        triangles = np.concatenate([triangles, triangles[some], triangles[some][:, ::-1]])
    elif defect == "apart":
        vertices, triangles = vertices[triangles].reshape(-1, 3), np.arange(triangles.size).reshape(-1, 3)
    elif defect == "flat":
        triangles[some, 2] = triangles[some, 1]
    elif defect == "two at a vertex":
        triangles = np.concatenate([triangles, triangles + len(vertices)])
        triangles[triangles == len(vertices)] = 0
        vertices = np.concatenate([vertices, 2 * vertices[0] - vertices])
    return vertices, triangles


@pytest.mark.parametrize("defect", DEFECTS)
@given(st.integers(0, 2**32 - 1), st.floats(0.0, 1.5), st.floats(0.3, 4.0))
@settings(max_examples=5, deadline=None)
def test_against_all_triangles(defect, seed, roughness, band):
    rng = np.random.default_rng(seed)
    mesh = ig.TriangleMesh(*bumpy(rng, roughness, defect))
    matrix = np.eye(4)
    matrix[:3, :3] = np.linalg.qr(rng.normal(size=(3, 3)))[0] @ np.diag(
        rng.uniform((0.6, 0.3, 0.6), (1.2, 0.5, 1.2))
    ) + rng.uniform(-0.1, 0.1, (3, 3))
    shape = (11, 37, 12)
    matrix[:3, 3] = -matrix[:3, :3] @ (np.array(shape[::-1]) / 2)
    grid = ig.Volume(np.zeros(shape, dtype=bool), matrix)
    with patch.object(narrow_band, "MANY", np.inf):
        field, closest = ig.distance_field(mesh, like=grid, band=f"{band}mm", return_closest=True)
    z, y, x = np.indices(shape).reshape(3, -1)
    places = np.stack([x, y, z], axis=1) @ matrix[:3, :3].T + matrix[:3, 3]
    exact = mesh_distance(places, mesh.vertices, mesh.triangles)
    np.testing.assert_allclose(np.abs(field.array.ravel()), np.minimum(exact, band), atol=2e-4)
    found = closest.array.ravel()
    assert (found[exact < band - 1e-4] >= 0).all()
    assert (found[exact > band + 1e-4] == -1).all()
    for n in np.unique(found[found >= 0])[::7]:
        mine = found == n
        own = mesh_distance(places[mine], mesh.vertices, mesh.triangles[n : n + 1])
        np.testing.assert_allclose(own, exact[mine], atol=2e-4)


@pytest.mark.parametrize("defect", DEFECTS)
@given(st.integers(0, 2**32 - 1))
@settings(max_examples=5, deadline=None)
def test_net_edges_are_those_of_a_plain_count(defect, seed):
    _, triangles = bumpy(np.random.default_rng(seed), 0.1, defect)
    count: Counter[tuple[int, int]] = Counter()
    for a, b, c in triangles.tolist():
        for start, end in ((a, b), (b, c), (c, a)):
            if start != end:
                count[min(start, end), max(start, end)] += 1 if start < end else -1
    edges, net = net_edges(triangles.astype(np.int32))
    assert dict(zip(map(tuple, edges.tolist()), net.tolist(), strict=True)) == {e: n for e, n in count.items() if n}


def test_an_edge_that_very_many_triangles_share():
    """More uses at a vertex than are sorted by hand."""
    fan = np.array([[0, 1, k] for k in range(2, 200)], dtype=np.int32)
    edges, net = net_edges(fan)
    assert net[(edges == (0, 1)).all(axis=1)] == 198
    assert len(edges) == 1 + 2 * 198


@given(st.integers(0, 2**32 - 1), st.floats(0.0, 0.6), st.sampled_from(DEFECTS))
@settings(max_examples=25, deadline=None)
def test_spread_is_no_less_than_any_angle_at_the_corners(seed, roughness, defect):
    vertices, triangles = bumpy(np.random.default_rng(seed), roughness, defect)
    triangles = triangles.astype(np.int32)
    left, _ = net_edges(triangles)
    normals, sines = normals_and_spread(vertices, triangles, left)
    at = [{n for n in range(len(triangles)) if v in triangles[n]} for v in range(len(vertices))]
    for n in range(0, len(triangles), 5):
        ring = sorted(set.union(*(at[v] for v in triangles[n])))
        cosines = normals[ring] @ normals[n]
        if np.isin(triangles[n], left).any() or cosines.min() < 0.5:
            assert sines[n] == 1
        else:
            assert sines[n] >= np.sqrt(1 - min(cosines.min(), 1) ** 2)


def test_flat_faces_ask_nothing_aside():
    """The law is of use: all but the triangles at the edges of a finely cut cube have a sine of 0."""
    grid = ig.Volume.from_array(np.pad(np.ones((18, 18, 18), dtype=np.float32), 1), 0.1)
    cube = ig.surface(grid, 0.5)
    _, sines = normals_and_spread(cube.vertices, cube.triangles, net_edges(cube.triangles)[0])
    assert (sines < 1e-5).mean() > 0.6
