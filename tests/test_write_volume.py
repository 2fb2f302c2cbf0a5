"""Volumes on disk lie where they lie in the world, and a mesh's distance field where the mesh does."""

from __future__ import annotations

import numpy as np
import pytest
import SimpleITK as sitk
from test_voxelize import sphere

import intaglio as ig
from intaglio.errors import InputError

KINDS = [".nii", ".nii.gz", ".nrrd", ".mha"]


def turned(dtype=np.float32, mirrored=False):
    rng = np.random.default_rng(1)
    q = np.linalg.qr(rng.normal(size=(3, 3)))[0]
    q[:, 0] *= np.sign(np.linalg.det(q)) * (-1 if mirrored else 1)
    matrix = np.eye(4)
    matrix[:3, :3] = q * (0.5, 1.0, 2.5)
    matrix[:3, 3] = (10, -20, 30)
    return ig.Volume((rng.random((4, 5, 6)) * 100).astype(dtype), matrix)


@pytest.mark.parametrize("kind", KINDS)
@pytest.mark.parametrize("dtype", [bool, np.uint8, np.int16, np.int32, np.float16, np.float32, np.float64])
@pytest.mark.parametrize("mirrored", [False, True])
def test_there_and_back(kind, dtype, mirrored, tmp_path):
    volume = turned(dtype, mirrored)
    path = tmp_path / f"v{kind}"
    ig.write_volume(volume, path)
    again = ig.read_volume(path)
    assert (again.array == volume.samples).all()
    assert again.array.dtype == volume.samples.dtype
    assert np.allclose(again.world_from_index, volume.world_from_index, atol=1e-4)
    assert [p.name for p in tmp_path.iterdir()] == [path.name]


@pytest.mark.parametrize("kind", KINDS)
def test_field_and_mesh_coincide_in_the_world(kind, tmp_path):
    """Asked through SimpleITK, which speaks LPS, the field is zero at the mesh's vertices."""
    mesh = sphere(20, (31, -47, 103))
    matrix = turned().world_from_index.copy()
    matrix[:3, :3] = matrix[:3, :3] / (0.5, 1.0, 2.5) * 0.9
    matrix[:3, 3] = np.array((31, -47, 103)) - matrix[:3, :3] @ np.full(3, 29.5)
    like = ig.Volume(np.zeros((60, 60, 60), dtype=bool), matrix)
    path = tmp_path / f"field{kind}"
    ig.write_volume(ig.distance_field(mesh, like=like, band="full"), path)
    image = sitk.ReadImage(str(path))
    for x, y, z in mesh.vertices[::37]:
        assert image.EvaluateAtPhysicalPoint((-x, -y, z), sitk.sitkLinear) == pytest.approx(0, abs=0.05)
    assert image.EvaluateAtPhysicalPoint((-31, 47, 103), sitk.sitkLinear) == pytest.approx(-20, abs=1)


@pytest.mark.parametrize("name", ["v.xyz", "v.gz", "v", "nowhere/v.nii", "folder.nii"])
def test_no_such_output(name, tmp_path):
    (tmp_path / "folder.nii").mkdir()
    with pytest.raises(InputError, match=r"output|folder"):
        ig.write_volume(turned(), tmp_path / name)
    assert [p.name for p in tmp_path.iterdir()] == ["folder.nii"]


def test_sheared_axes_are_refused(tmp_path):
    matrix = np.eye(4)
    matrix[0, 1] = 0.3
    with pytest.raises(InputError, match="right angles"):
        ig.write_volume(ig.Volume(np.zeros((2, 2, 2)), matrix), tmp_path / "v.nii")


def test_nothing_half_written_is_left(tmp_path, monkeypatch):
    def broken(image, path, **options):
        with open(path, "w") as file:
            file.write("half")
        raise RuntimeError("sitk::ERROR: disk is full")

    monkeypatch.setattr(sitk, "WriteImage", broken)
    with pytest.raises(InputError, match="disk is full"):
        ig.write_volume(turned(), tmp_path / "v.nii")
    assert list(tmp_path.iterdir()) == []
