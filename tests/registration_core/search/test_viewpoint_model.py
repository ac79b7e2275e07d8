"""Stored points lie on the object, face the view, and rings lie outside the outline."""

from dataclasses import fields
from pathlib import Path

import numpy as np
import pytest
import trimesh

from registration_core import ObjectModel, SnapConfig, region_of_interest, snap
from registration_core.geometry import pose
from registration_core.geometry.kernels import view_of
from registration_core.geometry.object_model import discrete
from registration_core.search import viewpoint_model as module
from registration_core.search.viewpoint_model import (
    build_viewpoint_model,
    check_visible,
    packed,
    unpacked,
    viewpoint_model,
)
from tests.registration_core.simple_scene import standing_tool, tool

RADIUS = 0.06


def model_of(mesh: trimesh.Trimesh) -> ObjectModel:
    return ObjectModel(np.asarray(mesh.vertices, dtype=np.float64), np.asarray(mesh.faces, dtype=np.int32))


@pytest.fixture(scope="module")
def sphere() -> module.ViewpointModel:
    mesh = trimesh.creation.icosphere(subdivisions=4, radius=RADIUS)
    mesh.apply_translation((0.1, 0.2, 0.3))
    return build_viewpoint_model(model_of(mesh))


def test_sphere_has_its_measures(sphere) -> None:
    np.testing.assert_allclose(sphere.centre, [0.1, 0.2, 0.3], atol=1e-4)
    assert sphere.mean_area == pytest.approx(np.pi * RADIUS**2, rel=0.05)
    np.testing.assert_allclose(sphere.area, 1.0, atol=0.02)


def test_points_of_a_sphere_lie_on_it_with_outward_normals(sphere) -> None:
    np.testing.assert_allclose(np.linalg.norm(sphere.points, axis=1), RADIUS, rtol=0.02)
    along = (sphere.points * sphere.normals).sum(axis=1) / RADIUS
    assert along.min() > 0.97


def test_points_face_their_view_and_rings_lie_outside(sphere) -> None:
    directions = np.asarray(trimesh.creation.icosphere(subdivisions=3).vertices)
    facing = np.einsum("vck,vc->vk", sphere.normals, directions)
    assert facing.min() > 0.0
    across = sphere.ring - np.einsum("vck,vc->vk", sphere.ring, directions)[:, None] * directions[:, :, None]
    distance = np.linalg.norm(across, axis=1)
    assert distance.min() > RADIUS
    assert distance.max() < 1.3 * RADIUS


def test_every_direction_finds_a_view_close_by(sphere) -> None:
    directions = np.asarray(trimesh.creation.icosphere(subdivisions=3).vertices)
    rng = np.random.default_rng(0)
    for _ in range(200):
        seen_from = rng.normal(size=3)
        seen_from /= np.linalg.norm(seen_from)
        T = np.eye(4, dtype=np.float32)[:3].copy()
        T[:, 3] = -seen_from  # the camera is at the origin, so it sees the object from -t
        assert directions[view_of(T, sphere.view_of_cell)] @ seen_from > np.cos(np.radians(8.0))


def test_open_flipped_and_non_manifold_meshes_are_taken() -> None:
    cup = trimesh.creation.cylinder(radius=0.05, height=0.1, sections=30)
    faces = np.asarray(cup.faces[cup.face_normals[:, 2] < 0.9], dtype=np.int32)
    faces[::3] = faces[::3, ::-1]
    faces = np.concatenate([faces, faces[:5], faces[:1, [0, 0, 1]]])
    built = build_viewpoint_model(ObjectModel(np.asarray(cup.vertices), faces))
    assert np.isfinite(built.points).all()
    assert np.isfinite(built.normals).all()
    np.testing.assert_allclose(np.linalg.norm(built.normals, axis=1), 1.0, atol=1e-5)


def test_flat_mesh_seen_edge_on_stays_finite() -> None:
    square = np.array([[-0.1, -0.1, 0], [0.1, -0.1, 0], [0.1, 0.1, 0], [-0.1, 0.1, 0]])
    built = build_viewpoint_model(ObjectModel(square, np.array([[0, 1, 2], [0, 2, 3]], dtype=np.int32)))
    assert np.isfinite(built.points).all()
    assert np.isfinite(built.ring).all()
    assert np.isfinite(built.area).all()


@pytest.mark.slow
def test_large_mesh_is_thinned() -> None:
    mesh = trimesh.creation.icosphere(subdivisions=6, radius=RADIUS)
    assert len(mesh.faces) > 80_000
    built = build_viewpoint_model(model_of(mesh))
    np.testing.assert_allclose(np.linalg.norm(built.points, axis=1), RADIUS, rtol=0.03)


def test_a_real_mesh_is_made_coarse(shared_data: Path) -> None:
    model = ObjectModel.load(shared_data / "ycbv/models/obj_000014.ply", unit="mm")
    built = build_viewpoint_model(model)
    assert len(built.coarse_faces) <= 1000


def test_symmetries_are_about_the_centre() -> None:
    flip = np.diag([-1.0, -1.0, 1.0, 1.0])
    flip[:3, 3] = [0.4, 0.2, 0.0]  # about the vertical line through (0.2, 0.1)
    box = trimesh.creation.box((0.1, 0.06, 0.04))
    box.apply_translation((0.2, 0.1, 0.5))
    model = ObjectModel(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int32), discrete([flip]))
    built = build_viewpoint_model(model)
    np.testing.assert_allclose(built.symmetries[1], np.diag([-1.0, -1.0, 1.0, 1.0])[:3], atol=1e-6)


def test_is_built_once(monkeypatch) -> None:
    model = tool()
    first = viewpoint_model(model)
    monkeypatch.setattr(module, "build_viewpoint_model", None)
    assert viewpoint_model(model) is first
    assert viewpoint_model(first) is first


def test_what_was_packed_comes_back_to_the_last_bit() -> None:
    built = viewpoint_model(tool())
    again = unpacked(packed(built))
    for field in fields(built):
        assert np.array_equal(getattr(again, field.name), getattr(built, field.name))
        assert type(getattr(again, field.name)) is type(getattr(built, field.name))


def test_a_snap_with_what_was_built_is_that_with_the_object() -> None:
    scene = standing_tool()
    start = pose.perturbed(scene.truth, 0.02, 0.2, np.random.default_rng(0))
    known = unpacked(packed(build_viewpoint_model(scene.model)))
    one, other = (
        snap(model, scene.depth, scene.camera, start, rng=np.random.default_rng(1))
        for model in (scene.model, known)
    )
    assert np.array_equal(one.T_camera_object, other.T_camera_object) and one.confidence == other.confidence
    config = SnapConfig()
    assert region_of_interest(known, scene.camera, start, config) == region_of_interest(
        scene.model, scene.camera, start, config
    )


def test_what_is_damaged_or_of_another_algorithm_is_refused(monkeypatch) -> None:
    content = packed(viewpoint_model(tool()))
    for damaged in (b"", content[:1000], content[:-1000], b"x" * 1000):
        with pytest.raises(ValueError, match="cannot be read"):
            unpacked(damaged)
    monkeypatch.setattr(module, "VIEWPOINT_ALGORITHM", "0123456789ab")
    with pytest.raises(ValueError, match=r"it was made by algorithm \w{12}, and this is 0123456789ab"):
        unpacked(content)


@pytest.mark.parametrize(
    "vertices",
    [
        [[0, 0, 0], [0.2, 0, 0], [0.1, 1e-6, 0]],
        [[0, 0, 0], [1e-9, 0, 0], [0, 1e-9, 0], [0.1, 0, 0]],
    ],
    ids=["a thread", "a speck beside a stray vertex"],
)
def test_a_mesh_that_cannot_be_seen_is_refused_ahead_and_when_built(vertices) -> None:
    model = ObjectModel(np.array(vertices, dtype=np.float64), np.array([[0, 1, 2]], dtype=np.int32))
    for refuse in (check_visible, build_viewpoint_model):
        with pytest.raises(
            ValueError, match="mesh is too thin beside its extent to be looked for; it is seen"
        ):
            refuse(model)


def test_flat_and_ordinary_meshes_can_be_seen() -> None:
    triangle = np.array([[0, 0, 0], [0.1, 0, 0], [0, 0.1, 0]], dtype=np.float64)
    check_visible(ObjectModel(triangle, np.array([[0, 1, 2]], dtype=np.int32)))
    check_visible(tool())
