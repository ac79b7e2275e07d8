"""How firmly the depth holds a pose: how far the object's surface may yet lie from where it is put."""

from weakref import WeakKeyDictionary

import numpy as np
from numpy.typing import NDArray

from registration_core.geometry.kernels import Array32
from registration_core.search.polish import scaled_covariances
from registration_core.search.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]

SMOOTH = np.cos(np.radians(30.0))
"""Cosine of the angle between faces below which they are taken for parts of one smooth surface."""
SLIVER = 1e-3
"""Faces that are not as high as this share of the diameter have no normal that means anything."""
WITHIN_ITSELF = 0.06
"""A motion moves a surface within itself if its points move along their normals, in the root mean square, by
less than this share of how far the object moves, or a point of it that is a radius from the axis."""

_moves: WeakKeyDictionary[ViewpointModel, Array] = WeakKeyDictionary()


def surface_spreads(poses: Array32, hessians: Array, model: ViewpointModel) -> Array:
    """Standard deviation (N,) of where poses (N, 3, 4) put the surface, along its normal and where it is
    largest, as a share of the diameter.

    A turn that moves the surface within itself, as that of a can about its axis, counts for nothing.

    Args:
        hessians: (N, 6, 6), as `polish.systems` scales them.
    """
    moves, covariances = surface_moves(model), scaled_covariances(hessians, model.radius)
    largest = np.empty(len(poses))
    for i, R in enumerate(poses[:, :, :3].astype(np.float64)):
        to_camera = np.kron(np.eye(2), R)
        in_object = to_camera.T @ covariances[i] @ to_camera
        largest[i] = np.einsum("ki,ki->k", moves @ in_object, moves).max()
    return np.asarray(np.sqrt(largest) / model.diameter)


def surface_moves(model: ViewpointModel) -> Array:
    """(K, 6), how far each corner of each coarse face moves along its normal, for a step in each entry of
    (translation, rotation vector times the radius) in the axes of the mesh.
    """
    if model not in _moves:
        corners, normals = _corners(model)
        moves = np.concatenate([normals, np.cross(corners / model.radius, normals)], axis=1)
        sizes, directions = np.linalg.eigh(moves.T @ moves / len(moves))
        kept = directions[:, np.sqrt(np.maximum(sizes, 0.0)) >= WITHIN_ITSELF]
        _moves[model] = moves @ kept @ kept.T
    return _moves[model]


def _corners(model: ViewpointModel) -> tuple[Array, Array]:
    """The corners (K, 3) of the coarse faces and the surface's normals there (K, 3): means, by area, over the
    faces around a corner that go on smoothly.
    """
    corners = model.coarse_vertices.astype(np.float64)[model.coarse_faces]
    crossed = np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0])
    sizes = np.linalg.norm(crossed, axis=1)
    longest = np.linalg.norm(corners - np.roll(corners, 1, axis=1), axis=2).max(axis=1)
    proper = sizes > SLIVER * model.diameter * longest
    if not proper.any():  # of nothing but slivers
        proper = sizes > 0.0
    faces, crossed = model.coarse_faces[proper], crossed[proper]
    along = crossed / sizes[proper, None]
    around = np.zeros((len(model.coarse_vertices), len(faces)), np.bool_)
    around[faces.ravel(), np.repeat(np.arange(len(faces)), 3)] = True
    smoothly = around[faces.ravel()] & np.repeat(along @ along.T > SMOOTH, 3, axis=0)
    normals = smoothly @ crossed
    return corners[proper].reshape(-1, 3), normals / np.linalg.norm(normals, axis=1)[:, None]
