"""Coarser meshes keep their shape, and closed ones are told from the others."""

import numpy as np
import pytest
import trimesh
from numpy.typing import NDArray

from registration_core.geometry.mesh_reduction import clustered, decimated, is_closed, merged

Mesh = tuple[NDArray[np.float32], NDArray[np.int32]]
RADIUS = 0.05


def arrays(mesh: trimesh.Trimesh) -> Mesh:
    return np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.faces, dtype=np.int32)


def ball(subdivisions: int = 3) -> Mesh:
    return arrays(trimesh.creation.icosphere(subdivisions=subdivisions, radius=RADIUS))


def beside(one: Mesh, other: Mesh, offset: float) -> Mesh:
    """Two meshes as one, the second moved along x."""
    moved = other[0] + np.array([offset, 0.0, 0.0], np.float32)
    return np.concatenate([one[0], moved]), np.concatenate([one[1], other[1] + len(one[0])])


def inside_out(mesh: Mesh) -> Mesh:
    return mesh[0], mesh[1][:, ::-1].copy()


def test_a_ball_is_closed_wherever_it_lies() -> None:
    vertices, faces = ball()
    for offset in (0.0, 0.3, -0.3):
        assert is_closed(vertices + np.float32(offset), faces)
    assert is_closed(*beside(ball(), ball(), 0.2))


@pytest.mark.parametrize(
    "mesh",
    [
        (ball()[0], ball()[1][1:]),
        inside_out(ball()),
        beside(ball(), inside_out(ball(2)), 0.2),
        (ball()[0], np.concatenate([ball()[1][1:], ball()[1][:1, ::-1]])),
        (ball()[0], np.concatenate([ball()[1], ball()[1][:1]])),
    ],
    ids=["a hole", "inside out", "one part inside out", "one face flipped", "one face twice"],
)
def test_a_mesh_without_a_sure_inside_is_not_closed(mesh: Mesh) -> None:
    assert not is_closed(*mesh)


def test_merging_closes_seams_and_drops_what_collapses() -> None:
    vertices, faces = ball()
    torn = vertices[faces].reshape(-1, 3), np.arange(faces.size, dtype=np.int32).reshape(-1, 3)
    assert not is_closed(*torn)
    back = merged(*torn)
    assert len(back[0]) == len(vertices)
    assert len(back[1]) == len(faces)
    assert is_closed(*back)
    collapsed = np.concatenate([torn[1], torn[1][:1, [0, 0, 1]]])
    assert len(merged(torn[0], collapsed)[1]) == len(faces)


@pytest.mark.parametrize(
    "coarser", [lambda m: clustered(m[0], m[1], 0.01), lambda m: decimated(m[0], m[1], 300)]
)
def test_a_coarser_ball_is_still_a_ball(coarser) -> None:
    vertices, faces = coarser(ball(4))
    assert 100 < len(faces) < 2000
    np.testing.assert_allclose(np.linalg.norm(vertices, axis=1), RADIUS, rtol=0.05)
    assert is_closed(vertices, faces)


def test_a_mesh_with_few_faces_is_left_alone() -> None:
    mesh = ball(1)
    assert decimated(*mesh, 300) == mesh
