"""What a snap needs to know of an object: surface points seen from each direction, and a coarse mesh.

For each of 642 directions the model holds points that are visible from there, their normals, and *ring*
points just outside the silhouette; a pose hypothesis is then scored by looking those up in the depth image,
without rendering. The idea is that of sparse viewpoint models in region-based tracking (ICG, M3T).
"""

import io
import threading
import zipfile
from collections import OrderedDict
from dataclasses import dataclass, fields
from functools import cached_property

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial import cKDTree

from registration_core.algorithm import VIEWPOINT_ALGORITHM
from registration_core.geometry.kernels import Array32, f4
from registration_core.geometry.mesh_reduction import clustered, decimated, is_closed, merged
from registration_core.geometry.object_model import ObjectModel
from registration_core.search.viewpoint_drawing import draw_views

POINTS, RING_POINTS = 256, 64
"""Stored for each view."""
VIEW_SUBDIVISIONS = 3
"""Of an icosahedron: 642 directions about 7 degrees apart."""
CELLS = 32
"""Cells along an edge of the cube map that finds the view of a direction."""
COARSE_FACES = 500
"""Faces of the coarse mesh, at most, where decimation can reach it."""
DENSE_FACES = 20_000
"""A mesh with more faces is thinned before its views are drawn: more could not be seen in them."""
CLUSTER_CELLS = 200
"""Cells along the diameter to which a dense mesh is thinned first, which is fast, before it is decimated."""
SYMMETRY_STEP = 0.1
"""Step of continuous symmetries, share of the diameter: fine enough to tell modes apart."""
CHECK_SUBDIVISIONS = 1
"""Of an icosahedron: 42 directions, by which it is told ahead whether a model can be built."""
LEAST_SEEN = 0.5
"""Share of the directions from which something of the mesh must be seen: flat ones pass, threads do not."""
UNREADABLE = (OSError, EOFError, ValueError, KeyError, TypeError, zipfile.BadZipFile)
"""What reading damaged content may raise."""
CACHED_MODELS = 64
"""Models kept in memory, about 5 MB each."""


@dataclass(frozen=True, eq=False)
class ViewpointModel:
    """An object as a snap sees it; lengths in metres, in the mesh frame moved to `centre`."""

    centre: NDArray[np.float64]
    """(3,), in the mesh frame."""
    diameter: float
    radius: float
    """Of the sphere about `centre` that holds the object."""
    points: Array32
    """(V, 3, 256), visible from view V."""
    normals: Array32
    """(V, 3, 256), turned towards the camera of the view."""
    ring: Array32
    """(V, 3, 64), just outside the silhouette, at the depth of its rim."""
    area: Array32
    """(V,), silhouette area as a share of the mean over all views."""
    mean_area: float
    """Mean silhouette area, square metres."""
    view_of_cell: NDArray[np.int32]
    """(6, 32, 32), the view of each cell of a cube map of directions."""
    coarse_vertices: Array32
    """(N, 3)."""
    coarse_faces: NDArray[np.int32]
    """(M, 3)."""
    coarse_is_closed: bool
    """Whether the coarse mesh has an inside, with its faces wound counter-clockwise seen from outside."""
    extremes: Array32
    """(E, 3), spread-out outermost points: how far they move is how far two poses are apart."""
    symmetries: Array32
    """(S, 3, 4), identity first, in the centred frame."""

    @cached_property
    def sample(self) -> Array32:
        """Points (P, 3) all over the surface, a few from each of many sides."""
        return self.points[:: len(self.points) // 60, :, ::32].transpose(0, 2, 1).reshape(-1, 3)

    @cached_property
    def surface_tree(self) -> cKDTree:
        """Looks up how far a point is from the surface, to about a hundredth of the diameter."""
        return cKDTree(self.points[:, :, ::8].transpose(0, 2, 1).reshape(-1, 3))


Registrable = ObjectModel | ViewpointModel
"""What is looked for: an object, or what was built of it before."""


def viewpoint_model(model: Registrable) -> ViewpointModel:
    """The viewpoint model of an object, built where it is not in memory."""
    if isinstance(model, ViewpointModel):
        return model
    key = model.content_hash
    with _lock:
        if key in _models:
            _models.move_to_end(key)
            return _models[key]
    built = build_viewpoint_model(model)
    with _lock:
        _models[key] = built
        while len(_models) > CACHED_MODELS:
            _models.popitem(last=False)
    return built


def packed(viewpoints: ViewpointModel) -> bytes:
    """A viewpoint model as a file or a message holds it, about 4.5 MB; it hardly shrinks when compressed."""
    content = io.BytesIO()
    arrays = {field.name: getattr(viewpoints, field.name) for field in fields(viewpoints)}
    np.savez(content, algorithm=VIEWPOINT_ALGORITHM, **arrays)
    return content.getvalue()


def unpacked(content: bytes) -> ViewpointModel:
    """The inverse of `packed`.

    Raises:
        ValueError: where the content is damaged, or another algorithm made it.
    """
    try:
        with np.load(io.BytesIO(content)) as arrays:
            values = {name: arrays[name] for name in arrays.files}
        if (algorithm := str(values.pop("algorithm"))) != VIEWPOINT_ALGORITHM:
            raise ValueError(f"it was made by algorithm {algorithm}, and this is {VIEWPOINT_ALGORITHM}")
        scalars = {name: float(values[name]) for name in ("diameter", "radius", "mean_area")}
        closed = bool(values["coarse_is_closed"])
        return ViewpointModel(**{**values, **scalars, "coarse_is_closed": closed})
    except UNREADABLE as error:
        raise ValueError(f"the viewpoint model cannot be read: {error}") from error


def check_visible(model: ObjectModel) -> None:
    """Raise a ValueError where `build_viewpoint_model` would, told in a few hundredths of its time."""
    vertices = (model.vertices - model.centre).astype(np.float32)
    faces = np.array(
        model.faces, dtype=np.int32
    )  # writable and in one piece, as the kernels are compiled for
    _check_seen(_drawn(vertices, faces, _directions(CHECK_SUBDIVISIONS), model.radius, 1, 1)[3])


def build_viewpoint_model(model: ObjectModel) -> ViewpointModel:
    """The viewpoint model of an object; the mesh may be open, non-manifold, and wound either way.

    Raises:
        ValueError: where the mesh is too thin beside its extent to be seen from most sides.
    """
    vertices = (model.vertices - model.centre).astype(np.float32)
    vertices, faces = merged(vertices, model.faces)
    if len(faces) > DENSE_FACES:
        vertices, faces = clustered(vertices, faces, model.diameter / CLUSTER_CELLS)
        vertices, faces = decimated(vertices, faces, DENSE_FACES)
    coarse_vertices, coarse_faces = decimated(vertices, faces, COARSE_FACES)
    directions = _directions(VIEW_SUBDIVISIONS)
    points, normals, ring, area = _drawn(vertices, faces, directions, model.radius, POINTS, RING_POINTS)
    _check_seen(area)
    mean_area = float(area.mean())
    return ViewpointModel(
        centre=model.centre,
        diameter=model.diameter,
        radius=model.radius,
        points=points,
        normals=normals,
        ring=ring,
        area=area / f4(max(mean_area, 1e-12)),
        mean_area=mean_area,
        view_of_cell=_nearest_views(directions),
        coarse_vertices=coarse_vertices,
        coarse_faces=coarse_faces,
        coarse_is_closed=is_closed(coarse_vertices, coarse_faces),
        extremes=_spread_out(coarse_vertices, 16),
        symmetries=_centred_symmetries(model),
    )


_models: OrderedDict[str, ViewpointModel] = OrderedDict()
_lock = threading.Lock()


def _directions(subdivisions: int) -> NDArray[np.float64]:
    """Unit vectors (V, 3), evenly spread."""
    return np.asarray(trimesh.creation.icosphere(subdivisions=subdivisions).vertices)


def _drawn(
    vertices: Array32,
    faces: NDArray[np.int32],
    directions: NDArray[np.float64],
    radius: float,
    points: int,
    ring_points: int,
) -> tuple[Array32, Array32, Array32, Array32]:
    """Points (V, 3, points), their normals, ring points (V, 3, ring_points), and silhouette areas (V,) in
    square metres.
    """
    views = len(directions)
    found = np.zeros((views, 3, points), np.float32)
    normals = np.zeros((views, 3, points), np.float32)
    ring = np.zeros((views, 3, ring_points), np.float32)
    area = np.zeros(views, np.float32)
    rotations = _view_rotations(directions)
    draw_views(vertices.astype(np.float64), faces, rotations, radius, found, normals, ring, area)
    return found, normals, ring, area


def _check_seen(area: Array32) -> None:
    share = float((area > 0.0).mean())
    if share < LEAST_SEEN:
        raise ValueError(
            f"mesh is too thin beside its extent to be looked for; it is seen from {share:.0%} of all sides"
        )


def _view_rotations(directions: NDArray[np.float64]) -> NDArray[np.float64]:
    """Rotations (V, 3, 3) of cameras that look at the origin from each direction (V, 3)."""
    z = -directions / np.linalg.norm(directions, axis=1, keepdims=True)
    up = np.where(np.abs(z[:, 2:]) < 0.9, [[0.0, 0.0, 1.0]], [[1.0, 0.0, 0.0]])
    x = np.cross(up, z)
    x /= np.linalg.norm(x, axis=1, keepdims=True)
    return np.stack([x, np.cross(z, x), z], axis=1)


def _nearest_views(directions: NDArray[np.float64]) -> NDArray[np.int32]:
    """The cube map (6, 32, 32) that `kernels.view_of` looks up."""
    along = (np.arange(CELLS) + 0.5) / CELLS * 2.0 - 1.0
    u, v = np.meshgrid(along, along, indexing="ij")
    one = np.ones_like(u)
    sides = [(one, u, v), (-one, u, v), (u, one, v), (u, -one, v), (u, v, one), (u, v, -one)]
    cells = np.stack([np.stack(side, axis=-1) for side in sides])
    return (cells @ directions.T).argmax(axis=-1).astype(np.int32)


def _spread_out(points: Array32, count: int) -> Array32:
    """Farthest-point sample (count, 3), from the point farthest from the origin on."""
    chosen = [int(np.argmax(np.linalg.norm(points, axis=1)))]
    distance = np.full(len(points), np.inf)
    for _ in range(min(count, len(points)) - 1):
        distance = np.minimum(distance, np.linalg.norm(points - points[chosen[-1]], axis=1))
        chosen.append(int(np.argmax(distance)))
    return points[chosen]


def _centred_symmetries(model: ObjectModel) -> Array32:
    transforms = model.symmetries.transforms(model.diameter, SYMMETRY_STEP)
    shift = np.eye(4)
    shift[:3, 3] = model.centre
    back = np.eye(4)
    back[:3, 3] = -model.centre
    return np.ascontiguousarray((back @ transforms @ shift)[:, :3], dtype=np.float32)
