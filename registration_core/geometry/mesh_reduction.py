"""Making meshes coarser: vertices (V, 3) float32 in metres and faces (F, 3) in, the same out."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from registration_core.geometry.kernels import Array32

KEPT_AREA = 0.85
"""Share of the surface area that a decimated mesh must keep."""


def merged(vertices: Array32, faces: NDArray[np.int32]) -> tuple[Array32, NDArray[np.int32]]:
    """The mesh with equal vertices merged: texture seams would tear open when it is decimated."""
    unique, index = np.unique(vertices, axis=0, return_inverse=True)
    merged = index.reshape(-1)[faces].astype(np.int32)
    a, b, c = merged.T
    return unique, merged[(a != b) & (b != c) & (a != c)]


def clustered(vertices: Array32, faces: NDArray[np.int32], cell: float) -> tuple[Array32, NDArray[np.int32]]:
    """The mesh with the vertices of each cell [m] replaced by their mean."""
    cells = np.floor(vertices / cell).astype(np.int32)
    _, index = np.unique(cells, axis=0, return_inverse=True)
    index = index.reshape(-1)
    count = np.bincount(index)
    means = np.stack([np.bincount(index, vertices[:, k]) / count for k in range(3)], axis=-1)
    merged = index[faces].astype(np.int32)
    a, b, c = merged.T
    return means.astype(np.float32), merged[(a != b) & (b != c) & (a != c)]


def decimated(vertices: Array32, faces: NDArray[np.int32], most: int) -> tuple[Array32, NDArray[np.int32]]:
    """The mesh reduced to about `most` faces, or to 2, 4, 8 ... times as many where fewer do not hold its
    shape: a scan full of tiny tunnels caves in when it is decimated too far, and loses area by it.
    """
    if len(faces) <= most:
        return vertices, faces
    import open3d  # heavy, and needed only where a model is built

    fine = open3d.geometry.TriangleMesh(
        open3d.utility.Vector3dVector(vertices.astype(np.float64)), open3d.utility.Vector3iVector(faces)
    )
    least_area = KEPT_AREA * fine.get_surface_area()
    while most < len(faces):
        coarse = fine.simplify_quadric_decimation(most)
        if coarse.get_surface_area() >= least_area:
            return np.asarray(coarse.vertices, dtype=np.float32), np.asarray(coarse.triangles, dtype=np.int32)
        most *= 2
    return vertices, faces


def is_closed(vertices: Array32, faces: NDArray[np.int32]) -> bool:
    """Whether each part of a mesh has an inside, with its faces wound counter-clockwise seen from outside."""
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    if not (mesh.is_watertight and mesh.is_winding_consistent):
        return False
    part = trimesh.graph.connected_component_labels(mesh.face_adjacency, node_count=len(faces))
    a, b, c = np.moveaxis(mesh.triangles, 1, 0)
    volumes = np.bincount(part, np.einsum("ij,ij->i", a, np.cross(b, c)))  # six times, signed
    return bool((volumes > 0.0).all())
