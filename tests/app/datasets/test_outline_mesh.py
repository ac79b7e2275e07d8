"""The mesh for outlines: what comes out is what went in, or looks like it."""

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.datasets.outline_mesh import MOST_FACES, packed, thinned
from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth

CAMERA = Intrinsics(320, 240, 400.0, 400.0, 159.5, 119.5)


def unpacked(content: bytes) -> ObjectModel:
    """The mesh that a page makes of the bytes."""
    vertex_count, face_count = np.frombuffer(content, "<u4", 2)
    vertices = np.frombuffer(content, "<f4", 3 * vertex_count, 8).reshape(-1, 3)
    faces = np.frombuffer(content, "<u4", 3 * face_count, 8 + vertices.nbytes).reshape(-1, 3)
    assert len(content) == 8 + vertices.nbytes + faces.nbytes
    return ObjectModel(vertices.astype(np.float64), faces.astype(np.int32))


def silhouette(model: ObjectModel) -> NDArray[np.bool_]:
    return render_depth(model, CAMERA, pose.exp([0.0, 0.0, 0.4, 0.4, 0.5, 0.6])) > 0


def test_a_small_mesh_is_kept_as_it_is() -> None:
    box = trimesh.creation.box((0.1, 0.2, 0.3))
    model = ObjectModel(np.asarray(box.vertices), np.asarray(box.faces, np.int32))
    kept = unpacked(packed(thinned(model)))
    order = np.lexsort(kept.vertices.T)
    assert np.allclose(kept.vertices[order], box.vertices[np.lexsort(box.vertices.T)])
    assert len(kept.faces) == 12
    assert np.isclose(trimesh.Trimesh(kept.vertices, kept.faces).volume, 0.006)


def test_a_dense_mesh_is_thinned_and_keeps_its_silhouette() -> None:
    ring = trimesh.creation.torus(0.08, 0.03, major_sections=400, minor_sections=160)
    dense = ObjectModel(np.asarray(ring.vertices), np.asarray(ring.faces, np.int32))
    coarse = unpacked(packed(thinned(dense)))
    assert len(dense.faces) > 2 * MOST_FACES
    assert MOST_FACES / 2 < len(coarse.faces) <= MOST_FACES
    one, other = silhouette(dense), silhouette(coarse)
    assert one.sum() > 5000
    assert (one & other).sum() / (one | other).sum() > 0.99
