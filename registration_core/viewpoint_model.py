# mypy: allow-untyped-defs
"""What a snap needs to know of an object: surface points seen from each direction, and a coarse mesh.

For each of 642 directions the model holds points that are visible from there, their normals, and *ring*
points just outside the silhouette; a pose hypothesis is then scored by looking those up in the depth image,
without rendering. The idea is that of sparse viewpoint models in region-based tracking (ICG, M3T).
"""

import os
import tempfile
import threading
from collections import OrderedDict
from dataclasses import dataclass, fields
from pathlib import Path

import numpy as np
import trimesh
from numba import njit
from numpy.typing import NDArray

from registration_core.kernels import EXACT, Array32, f4, uniform
from registration_core.object_model import ObjectModel
from registration_core.rasterizer import draw_mesh

VERSION = 1
"""Part of the cache file's name: raised when the content of the model changes."""

POINTS, RING_POINTS = 256, 64
"""Stored for each view."""
VIEW_SUBDIVISIONS = 3
"""Of an icosahedron: 642 directions about 7 degrees apart."""
VIEW_DISTANCE = 8.0
"""Distance of the camera of a view from the object's centre, in radii of the object."""
VIEW_PIXELS = 96
"""Width and height of the image of a view."""
VIEW_FILL = 0.88
"""Share of the image that the bounding sphere fills."""
CELLS = 32
"""Cells along an edge of the cube map that finds the view of a direction."""
COARSE_FACES = 600
"""Faces of the coarse mesh, at most, where decimation can reach it."""
DENSE_FACES = 20_000
"""A mesh with more faces is thinned before its views are drawn: more could not be seen in them."""
CLUSTER_CELLS = 200
"""Cells along the diameter to which a dense mesh is thinned first, which is fast, before it is decimated."""
SYMMETRY_STEP = 0.1
"""Step of continuous symmetries, share of the diameter: fine enough to tell modes apart."""
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


def viewpoint_model(model: ObjectModel, cache_dir: Path | None = None) -> ViewpointModel:
    """The viewpoint model of an object, from memory, else from a file in `cache_dir`, else newly built."""
    key = model.content_hash
    with _lock:
        if key in _models:
            _models.move_to_end(key)
            return _models[key]
    built = _load_or_build(model, cache_dir)
    with _lock:
        _models[key] = built
        while len(_models) > CACHED_MODELS:
            _models.popitem(last=False)
    return built


def build_viewpoint_model(model: ObjectModel) -> ViewpointModel:
    """The viewpoint model of an object; the mesh may be open, non-manifold, and wound either way."""
    vertices = (model.vertices - model.centre).astype(np.float32)
    vertices, faces = _merged(vertices, model.faces)
    if len(faces) > DENSE_FACES:
        vertices, faces = _clustered(vertices, faces, model.diameter / CLUSTER_CELLS)
        vertices, faces = _decimated(vertices, faces, DENSE_FACES)
    coarse_vertices, coarse_faces = _decimated(vertices, faces, COARSE_FACES)
    directions = np.asarray(trimesh.creation.icosphere(subdivisions=VIEW_SUBDIVISIONS).vertices)
    views = len(directions)
    points = np.zeros((views, 3, POINTS), np.float32)
    normals = np.zeros((views, 3, POINTS), np.float32)
    ring = np.zeros((views, 3, RING_POINTS), np.float32)
    area = np.zeros(views, np.float32)
    _draw_views(
        vertices.astype(np.float64),
        faces,
        _view_rotations(directions),
        model.radius,
        points,
        normals,
        ring,
        area,
    )
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
        coarse_is_closed=_is_closed(coarse_vertices, coarse_faces),
        extremes=_spread_out(coarse_vertices, 16),
        symmetries=_centred_symmetries(model),
    )


_models: OrderedDict[str, ViewpointModel] = OrderedDict()
_lock = threading.Lock()


def _load_or_build(model: ObjectModel, cache_dir: Path | None) -> ViewpointModel:
    if cache_dir is None:
        return build_viewpoint_model(model)
    path = cache_dir / f"{model.content_hash}.v{VERSION}.npz"
    if path.is_file():
        return _read(path)
    built = build_viewpoint_model(model)
    _write(path, built)
    return built


def _read(path: Path) -> ViewpointModel:
    with np.load(path) as arrays:
        values = {name: arrays[name] for name in arrays.files}
    scalars = {name: float(values[name]) for name in ("diameter", "radius", "mean_area")}
    closed = bool(values["coarse_is_closed"])
    return ViewpointModel(**{**values, **scalars, "coarse_is_closed": closed})


def _write(path: Path, viewpoints: ViewpointModel) -> None:
    """Write beside the target and rename, so that another process never reads half a file."""
    path.parent.mkdir(parents=True, exist_ok=True)
    with tempfile.NamedTemporaryFile(dir=path.parent, suffix=".tmp", delete=False) as file:
        np.savez(file, **{f.name: getattr(viewpoints, f.name) for f in fields(viewpoints)})
    os.replace(file.name, path)


def _merged(vertices: Array32, faces: NDArray[np.int32]) -> tuple[Array32, NDArray[np.int32]]:
    """The mesh with equal vertices merged: texture seams would tear open when it is decimated."""
    unique, index = np.unique(vertices, axis=0, return_inverse=True)
    merged = index.reshape(-1)[faces].astype(np.int32)
    a, b, c = merged.T
    return unique, merged[(a != b) & (b != c) & (a != c)]


def _clustered(vertices: Array32, faces: NDArray[np.int32], cell: float) -> tuple[Array32, NDArray[np.int32]]:
    """The mesh with the vertices of each cell [m] replaced by their mean."""
    cells = np.floor(vertices / cell).astype(np.int32)
    _, index = np.unique(cells, axis=0, return_inverse=True)
    index = index.reshape(-1)
    count = np.bincount(index)
    means = np.stack([np.bincount(index, vertices[:, k]) / count for k in range(3)], axis=-1)
    merged = index[faces].astype(np.int32)
    a, b, c = merged.T
    return means.astype(np.float32), merged[(a != b) & (b != c) & (a != c)]


def _decimated(vertices: Array32, faces: NDArray[np.int32], most: int) -> tuple[Array32, NDArray[np.int32]]:
    """The mesh reduced to about `most` faces, where its topology lets decimation reach them."""
    if len(faces) <= most:
        return vertices, faces
    import open3d  # heavy, and needed only where a model is built

    mesh = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices.astype(np.float64)), open3d.utility.Vector3iVector(faces)
    ).simplify_quadric_decimation(most)
    coarse = np.asarray(mesh.vertices, dtype=np.float32), np.asarray(mesh.triangles, dtype=np.int32)
    return coarse if len(coarse[1]) else (vertices, faces)


def _is_closed(vertices: Array32, faces: NDArray[np.int32]) -> bool:
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    return bool(mesh.is_watertight and mesh.is_winding_consistent and mesh.volume > 0.0)


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


@njit(**EXACT)
def _draw_views(vertices, faces, rotations, radius, points, normals, ring, area):
    """Fill the arrays of ViewpointModel (area in square metres) by drawing every view once."""
    distance = VIEW_DISTANCE * radius
    focal = VIEW_PIXELS / 2 / radius * distance * VIEW_FILL
    middle = VIEW_PIXELS / 2 - 0.5
    pixel = distance / focal
    gap = max(0.08 * radius, min(0.006, 0.2 * radius)) / pixel
    state = np.array([88172645463325252], np.uint64)
    seen = np.empty((VIEW_PIXELS * VIEW_PIXELS, 2), np.int32)
    for view in range(rotations.shape[0]):
        R = rotations[view]
        camera_vertices = vertices @ R.T
        camera_vertices[:, 2] += distance
        inverse_depth = np.zeros((VIEW_PIXELS, VIEW_PIXELS))
        nearest_face = np.full((VIEW_PIXELS, VIEW_PIXELS), -1, np.int32)
        draw_mesh(camera_vertices, faces, focal, focal, middle, middle, inverse_depth, nearest_face, True)
        count = 0
        for row in range(VIEW_PIXELS):
            for column in range(VIEW_PIXELS):
                if inverse_depth[row, column] > 0.0:
                    seen[count, 0], seen[count, 1] = row, column
                    count += 1
        area[view] = count * pixel * pixel
        if count == 0:  # a flat object seen edge-on: a single point stands for it
            continue
        _shuffle(seen, count, state)
        for k in range(points.shape[2]):
            row, column = seen[k % count]
            corner = faces[nearest_face[row, column]]
            a, b, c = camera_vertices[corner[0]], camera_vertices[corner[1]], camera_vertices[corner[2]]
            n = np.cross(b - a, c - a)
            n /= np.linalg.norm(n) + 1e-30
            z = 1.0 / inverse_depth[row, column]
            hit = z * np.array([(column - middle) / focal, (row - middle) / focal, 1.0])
            if n @ hit > 0.0:
                n = -n
            jittered = np.array(
                [
                    (column + uniform(state) - 0.5 - middle) / focal,
                    (row + uniform(state) - 0.5 - middle) / focal,
                    1.0,
                ]
            )
            slope = n @ jittered
            moved = (n @ hit) / slope if slope < -0.15 else z
            p = jittered * (moved if abs(moved - z) < 2.0 * pixel else z)
            p[2] -= distance
            points[view, :, k] = R.T @ p
            normals[view, :, k] = R.T @ n
        count = max(1, _find_ring(inverse_depth, gap, seen))
        _shuffle(seen, count, state)
        for k in range(ring.shape[2]):
            row, column = seen[k % count]
            z = _rim_depth(inverse_depth, row, column, gap + 1.0)
            p = z * np.array([(column - middle) / focal, (row - middle) / focal, 1.0])
            p[2] -= distance
            ring[view, :, k] = R.T @ p


@njit(**EXACT)
def _shuffle(items, count, state):
    for k in range(count - 1, 0, -1):
        other = int(uniform(state) * (k + 1))
        for j in range(items.shape[1]):
            items[k, j], items[other, j] = items[other, j], items[k, j]


@njit(**EXACT)
def _find_ring(inverse_depth, gap, found):
    """Write the pixels (row, column) about `gap` pixels outside the silhouette; returns their number."""
    height, width = inverse_depth.shape
    reach = int(np.ceil(gap + 0.6))
    squared = np.full((height, width), 1 << 30, np.int32)
    for row in range(height):
        for column in range(width):
            if inverse_depth[row, column] == 0.0 or not _on_rim(inverse_depth, row, column):
                continue
            for i in range(max(0, row - reach), min(height, row + reach + 1)):
                for j in range(max(0, column - reach), min(width, column + reach + 1)):
                    squared[i, j] = min(squared[i, j], (i - row) ** 2 + (j - column) ** 2)
    count = 0
    for row in range(height):
        for column in range(width):
            d = np.sqrt(squared[row, column])
            if inverse_depth[row, column] == 0.0 and gap - 0.6 < d <= gap + 0.6:
                found[count, 0], found[count, 1] = row, column
                count += 1
    return count


@njit(**EXACT)
def _on_rim(inverse_depth, row, column):
    height, width = inverse_depth.shape
    if row in (0, height - 1) or column in (0, width - 1):
        return True
    return (
        inverse_depth[row - 1, column] == 0.0
        or inverse_depth[row + 1, column] == 0.0
        or inverse_depth[row, column - 1] == 0.0
        or inverse_depth[row, column + 1] == 0.0
    )


@njit(**EXACT)
def _rim_depth(inverse_depth, row, column, reach):
    """Depth of the drawn pixel nearest to a pixel outside."""
    height, width = inverse_depth.shape
    r = int(np.ceil(reach))
    best, depth = 1 << 30, 0.0
    for i in range(max(0, row - r), min(height, row + r + 1)):
        for j in range(max(0, column - r), min(width, column + r + 1)):
            d = (i - row) ** 2 + (j - column) ** 2
            if inverse_depth[i, j] > 0.0 and d < best:
                best, depth = d, 1.0 / inverse_depth[i, j]
    return depth
