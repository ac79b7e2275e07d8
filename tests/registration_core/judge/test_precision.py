"""How far a surface may yet lie off: known answers, and what must not change them."""

import numpy as np
import pytest
import trimesh

from registration_core import ObjectModel
from registration_core.geometry import pose
from registration_core.geometry.kernels import to_rows
from registration_core.judge.precision import _corners, surface_moves, surface_spreads
from registration_core.search.polish import MEASURED_NOISE
from registration_core.search.viewpoint_model import viewpoint_model
from tests.registration_core.simple_scene import block, model_of

SIZE = (0.10, 0.06, 0.02)
FIRMLY = 1e9
"""Measurements that hold an entry of a pose for good."""


def model_of_block():
    return viewpoint_model(model_of(block(SIZE)))


def spread(hessian, model, T=None) -> float:
    return float(surface_spreads(to_rows(np.eye(4) if T is None else T), hessian[None], model)[0])


def held_but(entry: int, measurements: float) -> np.ndarray:
    """All entries held firmly, and one by so many measurements."""
    hessian = np.full(6, FIRMLY)
    hessian[entry] = measurements
    return np.diag(hessian)


def test_a_shift_moves_the_faces_that_it_is_square_to() -> None:
    model = model_of_block()
    for axis in range(3):
        expected = MEASURED_NOISE / np.sqrt(400.0) / model.diameter
        assert spread(held_but(axis, 400.0), model) == pytest.approx(expected, rel=1e-2)


def test_a_turn_moves_the_farthest_corner_along_the_normal_of_its_face() -> None:
    model = model_of_block()
    angle = MEASURED_NOISE / np.sqrt(400.0) / model.radius
    for axis, arm in enumerate((0.03, 0.05, 0.05)):  # half of the longer of the two sides across the axis
        expected = angle * arm / model.diameter
        assert spread(held_but(3 + axis, 400.0), model) == pytest.approx(expected, rel=1e-2)


def ball() -> trimesh.Trimesh:
    return trimesh.creation.icosphere(4, 0.05)


def can() -> trimesh.Trimesh:
    return trimesh.creation.cylinder(0.03, 0.1, sections=32)


@pytest.mark.parametrize(("mesh", "free"), [(ball(), (3, 4, 5)), (can(), (5,))])
def test_a_turn_of_a_round_thing_counts_for_nothing(mesh, free) -> None:
    model = viewpoint_model(ObjectModel(np.asarray(mesh.vertices), np.asarray(mesh.faces)))
    held = np.array([60.0, 60.0, 60.0, 30.0, 30.0, 30.0])
    unheld = held.copy()
    unheld[list(free)] = 1e-3
    assert spread(np.diag(unheld), model) == pytest.approx(spread(np.diag(held), model), rel=0.02)
    across = np.append(held[:3], [1e-3] * 3)
    assert len(free) == 3 or spread(np.diag(across), model) > 10.0 * spread(np.diag(held), model)


@pytest.mark.slow
def test_slivers_have_no_say() -> None:
    mesh = can()
    on_an_edge = np.array([[0.03, 0.0, z] for z in (-0.05, 0.013, 0.05)])
    vertices = np.concatenate([mesh.vertices, on_an_edge])
    faces = np.concatenate([mesh.faces, [[len(vertices) - 3, len(vertices) - 2, len(vertices) - 1]]])
    hessian = np.diag([60.0, 60.0, 60.0, 30.0, 30.0, 0.1])
    for seed in range(5):
        R = pose.exp(np.random.default_rng(seed).normal(size=6))[:3, :3]
        turned = np.kron(np.eye(2), R) @ hessian @ np.kron(np.eye(2), R).T
        plain = viewpoint_model(ObjectModel(mesh.vertices @ R.T, mesh.faces))
        slivered = viewpoint_model(ObjectModel(vertices @ R.T, faces))
        assert spread(turned, slivered) == pytest.approx(spread(turned, plain), rel=0.05)


def test_what_moves_along_its_normal_is_what_a_step_moves() -> None:
    """A finite step of the pose, and how far each corner comes to lie off the faces that met there."""
    model, step = model_of_block(), 1e-6 * np.array([1.0, -2.0, 3.0, 2.0, 1.0, -3.0])
    corners, normals = _corners(model)
    moved = pose.apply(pose.exp(np.append(step[:3], step[3:] / model.radius)), corners)
    expected = np.einsum("ki,ki->k", moved - corners, normals)
    np.testing.assert_allclose(surface_moves(model) @ step, expected, rtol=0.0, atol=1e-9)


def test_it_does_not_matter_how_the_object_is_turned() -> None:
    model, rng = model_of_block(), np.random.default_rng(0)
    factor = rng.normal(size=(6, 9)) * 20.0
    hessian = factor @ factor.T
    for _ in range(5):
        T = pose.exp(rng.normal(size=6))
        to_camera = np.kron(np.eye(2), T[:3, :3])
        turned = to_camera @ hessian @ to_camera.T
        assert spread(turned, model, T) == pytest.approx(spread(hessian, model), rel=1e-4)


def test_twice_the_measurements_leave_less_and_none_leave_the_object_anywhere() -> None:
    model, hessian = model_of_block(), np.diag([90.0, 60.0, 200.0, 10.0, 20.0, 30.0])
    nothing = spread(np.zeros((6, 6)), model)
    assert spread(2.0 * hessian, model) == pytest.approx(spread(hessian, model) / np.sqrt(2.0), rel=1e-2)
    assert spread(hessian, model) < 0.2 * nothing and nothing > 0.5


def test_poses_are_told_apart() -> None:
    model, hessians = model_of_block(), np.stack([held_but(k, 100.0) for k in range(6)])
    rng = np.random.default_rng(0)
    poses = np.stack([pose.exp(rng.normal(size=6)) for _ in range(6)])
    together = surface_spreads(to_rows(poses), hessians, model)
    alone = [spread(hessian, model, T) for hessian, T in zip(hessians, poses, strict=True)]
    np.testing.assert_allclose(together, alone)
    assert len(set(np.round(together, 6))) == 6
