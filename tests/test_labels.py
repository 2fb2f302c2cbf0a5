"""Smooth surfaces of labels: thin parts stay, volumes stay, vertices stay near the border."""

from __future__ import annotations

import numpy as np
import oracle
import pytest
from hypothesis import given, settings, strategies as st
from hypothesis.extra import numpy as hnp
from scipy import ndimage

import intaglio as ig
from intaglio.solid.labels import label_distance
from intaglio.solid.relaxation import _taps

CROSS = ndimage.generate_binary_structure(3, 1)


def enclosed(mesh: ig.TriangleMesh) -> float:
    a, b, c = (mesh.vertices[mesh.triangles[:, i]] for i in range(3))
    return float(np.einsum("ij,ij->i", a, np.cross(b, c)).sum() / 6)


def volume_of(labels: ig.Volume, *wanted: int) -> float:
    return float(np.isin(labels.array, wanted).sum() * np.prod(labels.spacing))


def off_border(mesh: ig.TriangleMesh, labels: ig.Volume, label: int, parts: int = 4) -> np.ndarray:
    """How far vertices are from the faces between a label's voxels and others, in voxels."""
    fine = (labels.array == label).repeat(parts, 0).repeat(parts, 1).repeat(parts, 2)
    edt = ndimage.distance_transform_edt
    distance = (np.where(fine, edt(fine), edt(~fine)) - 0.5) / parts
    index = mesh.vertices @ labels.index_from_world[:3, :3].T + labels.index_from_world[:3, 3]
    return ndimage.map_coordinates(distance, ((index[:, ::-1] + 0.5) * parts - 0.5).T, order=1, mode="nearest")


def pieces(mask: np.ndarray) -> tuple[int, int]:
    """Of the body and of what is around it."""
    return ndimage.label(mask, CROSS)[1], ndimage.label(~mask, CROSS)[1]


def ellipsoid(spacing=(1.0, 1.0, 1.0)) -> ig.Volume:
    half = np.array([25.0, 18.0, 21.0])
    n = np.ceil(2 * (half + 4) / spacing).astype(int)
    grid = ig.Volume.from_array(np.zeros(n[::-1], np.uint8), spacing, -0.5 * (n - 1) * spacing + 0.3)
    return ig.Volume((np.linalg.norm(oracle.positions(grid) / half, axis=-1) < 1).astype(np.uint8), grid.world_from_index)


@pytest.mark.parametrize("sigma", [0.8, 2.0, 5.3])
def test_quadratic_fields_stay(sigma):
    taps, radius = _taps(np.full(3, sigma))
    once, twice = (np.concatenate([t[0, :0:-1], t[0]]).astype(np.float64) for t in taps)
    whole = 2 * once - twice
    x = np.arange(-radius[0], radius[0] + 1)
    assert whole.sum() == pytest.approx(1.0, abs=1e-6)
    assert (whole * x**2).sum() == pytest.approx(0.0, abs=1e-3)


@pytest.mark.parametrize("spacing", [(1.0, 1.0, 1.0), (0.8, 0.8, 3.0)], ids=["cubes", "slices"])
def test_round_bodies_are_round_and_as_large_as_their_voxels(spacing):
    labels = ellipsoid(spacing)
    smooth, stepped = (ig.surface(labels, label=1, smooth=s) for s in (True, False))
    assert smooth.report.closed
    assert smooth.report.manifold
    assert enclosed(smooth) == pytest.approx(volume_of(labels, 1), rel=0.01)
    # The angle between the surface's normals and the ellipsoid's.
    half = np.array([25.0, 18.0, 21.0])
    mean = []
    for mesh in (smooth, stepped):
        away = mesh.vertices / half**2
        away /= np.linalg.norm(away, axis=1)[:, None]
        mean.append(np.degrees(np.arccos(np.clip((mesh.normals * away).sum(axis=1), -1, 1))).mean())
    assert mean[0] < (2 if spacing[2] == 1 else 5)
    assert mean[1] > 3 * mean[0]
    assert off_border(smooth, labels, 1).max() < 1.0


@settings(deadline=None, max_examples=40)
@given(hnp.arrays(bool, st.tuples(*[st.integers(2, 14)] * 3)))
def test_only_voxels_at_the_border_of_thick_parts_change_sides(mask):
    if mask.all() or not mask.any():
        return
    field = label_distance(ig.Volume.from_array(mask), (1,))
    box = tuple(slice(int(o), int(o) + n) for o, n in zip(field.world_from_index[2::-1, 3], field.shape, strict=True))
    changed = (field.array < 0) != mask[box]
    assert not (changed & ~oracle.may_change_sides(mask[box])).any()


def test_who_may_change_sides_can_change():
    """A bump of 3 x 3 voxels on a block goes away: the law above is no empty one."""
    mask = np.zeros((30, 30, 30), dtype=bool)
    mask[8:, :, :] = True
    mask[7, 14:17, 14:17] = True
    field = label_distance(ig.Volume.from_array(mask), (1,))
    assert (field.array[7 - int(field.world_from_index[2, 3]), 14:17, 14:17] > 0).all()


@pytest.mark.parametrize("width", [1, 2])
@pytest.mark.parametrize("gap", [1, 2])
def test_thin_parts_and_gaps_stay(width, gap):
    """A block, a rod that leaves it, a sheet, and slits that part all three."""
    labels = np.zeros((40, 40, 60), dtype=np.uint8)
    labels[8:32, 8:32, 4:24] = 1
    labels[20 : 20 + width, 20 : 20 + width, 24:56] = 1
    labels[8:32, 8:32, 50 : 50 + width] = 1
    labels[:, :, 40 : 40 + gap] = 0
    labels[16 : 16 + gap, :, :12] = 0
    mesh = ig.surface(ig.Volume.from_array(labels), label=1)
    field = label_distance(ig.Volume.from_array(labels), (1,))
    assert pieces(field.array < 0) == pieces(labels > 0)
    assert enclosed(mesh) == pytest.approx(float(labels.sum()), rel=0.01)
    assert off_border(mesh, ig.Volume.from_array(labels), 1).max() < 1.5


def test_several_labels_are_one_body():
    labels = ellipsoid()
    halves = ig.Volume(labels.array * (1 + (np.arange(labels.shape[2]) > 30)).astype(np.uint8), labels.world_from_index)
    assert np.array_equal(ig.surface(halves, label=(1, 2)).vertices, ig.surface(labels, label=1).vertices)


def test_borders_of_two_labels_coincide():
    """Away from where a third is near."""
    labels = np.ones((60, 60, 60), dtype=np.uint8)
    z, y, x = np.indices(labels.shape)
    labels[(x - 29) * 0.8 + (y - 30) * 0.5 + (z - 28) * 0.3 > 2 * np.sin(y / 9)] = 2
    one, two = (label_distance(ig.Volume.from_array(labels), (k,)) for k in (1, 2))
    inner = (slice(12, -12),) * 3
    mid = [
        np.pad(
            f.array,
            [(int(o), n - int(o) - s) for o, s, n in zip(f.world_from_index[2::-1, 3], f.shape, labels.shape, strict=True)],
        )
        for f in (one, two)
    ]
    apart = (mid[0] + mid[1])[inner][np.abs(mid[0][inner]) < 1]
    assert apart.size > 500
    assert np.abs(apart).max() < 0.05


def test_any_thread_count_gives_the_same_field(monkeypatch):
    labels = ellipsoid((0.7, 1.0, 1.3))
    many = label_distance(labels, (1,))
    monkeypatch.setenv("INTAGLIO_THREADS", "1")
    assert np.array_equal(many.array, label_distance(labels, (1,)).array)


def test_progress_runs_to_the_end_and_cancels():
    seen = []
    label_distance(ellipsoid(), (1,), progress=lambda done, total: seen.append((done, total)))
    assert seen[-1][0] == seen[-1][1]
    assert [d / t for d, t in seen] == sorted(d / t for d, t in seen)

    def stop(done, total):
        raise KeyboardInterrupt

    with pytest.raises(KeyboardInterrupt):
        label_distance(ellipsoid(), (1,), progress=stop)


def test_what_is_no_label_is_refused():
    labels = ellipsoid()
    with pytest.raises(ig.InputError, match="label must be one of 1, not 7"):
        ig.surface(labels, label=7)
    with pytest.raises(ig.InputError, match="label must be one of 1, not none"):
        ig.surface(labels, label=())
    with pytest.raises(ig.InputError, match="label must stand alone, without iso and inside"):
        ig.surface(labels, 0.5, label=1)
    with pytest.raises(ig.InputError, match="labels must be whole numbers, not float32"):
        ig.surface(ig.Volume(labels.array.astype(np.float32), labels.world_from_index), label=1)


@pytest.mark.parametrize(
    ("scan", "wanted", "whole"),
    [
        ("ct_abdomen_labels.nii.gz", (2,), True),
        ("ct_abdomen_labels.nii.gz", (5,), False),
        ("ct_abdomen_labels.nii.gz", tuple(range(26, 34)), False),
        ("mr_head_labels.nrrd", (1,), False),
    ],
    ids=["kidney", "liver", "vertebrae", "skull"],
)
def test_organs(scan, wanted, whole, shared):
    """As many pieces and hollows as the labels have, and their volume; where the scan cuts them off, of the part within its
    outermost voxels' centres."""
    labels = ig.read_volume(shared(f"volumes/{scan}"))
    field = label_distance(labels, wanted)
    stepped = label_distance(labels, wanted, smooth=False)
    assert pieces(field.array < 0) == pieces(stepped.array < 0)
    mesh = ig.surface(field)
    mask = stepped.array < 0
    target = volume_of(labels, *wanted)
    if not whole:
        # Voxels in the outermost layers count half, quarter or an eighth.
        weight = [np.ones(n) for n in mask.shape]
        for w in weight:
            w[[0, -1]] = 0.5
        target = float(np.einsum("zyx,z,y,x->", mask, *weight) * np.prod(labels.spacing))
    assert enclosed(mesh) == pytest.approx(target, rel=0.01)
    body = ig.Volume(mask.astype(np.uint8), field.world_from_index)
    if mask.size < 1e6:
        inner = ((mesh.vertices > body.corners.min(axis=0) + 1) & (mesh.vertices < body.corners.max(axis=0) - 1)).all(axis=1)
        assert off_border(mesh, body, 1)[inner].max() < 1.0
