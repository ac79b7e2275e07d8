"""Meshes, units, symmetries."""

import io

import numpy as np
import pytest
import trimesh

from registration_core import ObjectModel, Symmetries
from registration_core.geometry.mesh_file import read_mesh
from registration_core.geometry.object_model import ContinuousSymmetry, discrete

BOX = trimesh.creation.box((0.3, 0.4, 1.2))


def model_of(mesh: trimesh.Trimesh, symmetries: Symmetries | None = None) -> ObjectModel:
    faces = np.asarray(mesh.faces, dtype=np.int32)
    return ObjectModel(np.asarray(mesh.vertices, dtype=np.float64), faces, symmetries or Symmetries())


def ply(mesh: trimesh.Trimesh) -> bytes:
    return mesh.export(file_type="ply")


def test_size_of_a_known_box() -> None:
    model = model_of(BOX)
    assert model.diameter == pytest.approx(1.3)
    assert model.radius == pytest.approx(0.65)
    np.testing.assert_allclose(model.centre, 0.0, atol=1e-12)


def test_diameter_of_a_flat_mesh() -> None:
    square = np.array([[0.0, 0, 0], [0.3, 0, 0], [0.3, 0.4, 0], [0, 0.4, 0]])
    model = ObjectModel(square, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32))
    assert model.diameter == pytest.approx(0.5)


@pytest.mark.parametrize(("unit", "metres"), [("m", 1.0), ("cm", 0.01), ("mm", 0.001)])
def test_files_are_brought_to_metres(tmp_path, unit, metres) -> None:
    mesh = BOX.copy()
    mesh.apply_scale(1 / metres)
    path = tmp_path / "box.ply"
    path.write_bytes(ply(mesh))
    assert ObjectModel.load(path, unit=unit).diameter == pytest.approx(1.3, rel=1e-6)


def test_missing_file(tmp_path) -> None:
    with pytest.raises(FileNotFoundError):
        ObjectModel.load(tmp_path / "none.ply")


@pytest.mark.parametrize(
    ("content", "unit", "what"),
    [
        (ply(BOX), "inch", "unit must be one of"),
        (ply(BOX), "mm", "check the unit"),
        (b"no mesh", "m", "mesh"),
        (b"", "m", "mesh"),
    ],
)
def test_unreadable_files_are_refused(content, unit, what) -> None:
    with pytest.raises(ValueError, match=what):
        ObjectModel.from_bytes(content, "ply", unit)


def test_point_cloud_is_no_mesh() -> None:
    file = io.BytesIO(trimesh.PointCloud(np.random.default_rng(0).random((5, 3))).export(file_type="ply"))
    with pytest.raises(ValueError, match="mesh"):
        read_mesh(file.getvalue(), "ply")


@pytest.mark.parametrize(
    ("vertices", "faces", "what"),
    [
        (np.zeros((0, 3)), np.zeros((0, 3)), "empty"),
        (np.zeros((3, 3)), np.zeros((0, 3)), "empty"),
        (np.full((3, 3), np.nan), [[0, 1, 2]], "NaN"),
        (np.eye(3), [[0, 1, 3]], "outside"),
        (np.eye(3), [[-1, 1, 2]], "outside"),
    ],
)
def test_impossible_meshes_are_refused(vertices, faces, what) -> None:
    with pytest.raises(ValueError, match=f"mesh.*{what}"):
        ObjectModel(vertices, np.asarray(faces, dtype=np.int32))


def test_symmetries_keep_a_revolved_mesh_on_itself() -> None:
    axis = ContinuousSymmetry((0.0, 0.0, 2.0), (0.1, 0.2, 0.0))
    flip = np.diag([1.0, -1.0, -1.0, 1.0])
    flip[:3, 3] = [0.0, 0.4, 0.0]  # about the line through (0, 0.2, 0) along x
    transforms = Symmetries(discrete([flip]).discrete, (axis,)).transforms(1.0)
    np.testing.assert_allclose(transforms[0], np.eye(4), atol=1e-12)
    # a point's distance from the axis and height are kept, up to the flip
    p = np.array([0.4, 0.6, 0.3, 1.0])
    moved = transforms @ p
    radius = np.hypot(moved[:, 0] - 0.1, moved[:, 1] - 0.2)
    np.testing.assert_allclose(radius, 0.5, atol=1e-9)
    np.testing.assert_allclose(np.abs(moved[:, 2]), 0.3, atol=1e-9)
    assert len(transforms) == 2 * np.ceil(np.pi / 0.01)


def test_steps_of_a_continuous_axis_are_at_most_a_hundredth_of_the_diameter() -> None:
    model = model_of(
        trimesh.creation.cylinder(radius=0.5, height=0.01),
        Symmetries(continuous=(ContinuousSymmetry((0.0, 0.0, 1.0)),)),
    )
    rim = model.symmetry_transforms @ np.array([0.5, 0.0, 0.0, 1.0])
    steps = np.linalg.norm(np.diff(rim[:, :3], axis=0, append=rim[:1, :3]), axis=1)
    assert steps.max() <= 0.01 * model.diameter


def test_hash_follows_content() -> None:
    same = model_of(BOX.copy())
    assert same.content_hash == model_of(BOX).content_hash
    other = BOX.copy()
    other.vertices[0] += 1e-6
    assert model_of(other).content_hash != same.content_hash
    turned = model_of(BOX, discrete([np.diag([1.0, -1.0, -1.0, 1.0])]))
    assert turned.content_hash != same.content_hash


def test_mesh_without_a_surface_is_refused() -> None:
    corners = np.asarray(BOX.vertices, dtype=np.float64)
    with pytest.raises(ValueError, match="mesh must have a surface"):
        ObjectModel(corners, np.array([[0, 0, 1], [7, 7, 0]], dtype=np.int32))
    with pytest.raises(ValueError, match="mesh must have a surface"):
        ObjectModel(np.zeros_like(corners), np.asarray(BOX.faces, dtype=np.int32))
