"""The mesh that is drawn many times a second, by a page for the outline and here: coarse enough for it."""

import numpy as np

from registration_core import ObjectModel
from registration_core.mesh_reduction import clustered, merged

MOST_FACES = 40_000
FINEST_CELLS = 400
"""Cells along the diameter to which a dense mesh is thinned first; then ever fewer, until it is small."""
COARSER = 1.25
"""By how much a cell grows from one try to the next."""


def thinned(model: ObjectModel) -> ObjectModel:
    """The same mesh with equal vertices merged; one of more than `MOST_FACES` faces is thinned out, and its
    surface moves by less than half a cell.
    """
    fine_vertices, fine_faces = merged(model.vertices.astype(np.float32), model.faces)
    vertices, faces = fine_vertices, fine_faces
    cell = model.diameter / FINEST_CELLS
    while len(faces) > MOST_FACES:
        vertices, faces = clustered(fine_vertices, fine_faces, cell)
        cell *= COARSER
    return ObjectModel(vertices.astype(np.float64), faces, model.symmetries)


def packed(model: ObjectModel) -> bytes:
    """The mesh as bytes, little endian: the numbers V of vertices and F of faces (uint32 each), the vertices
    (V, 3) float32 in metres, in the object's frame, and the faces (F, 3) uint32.
    """
    sizes = np.array([len(model.vertices), len(model.faces)], dtype="<u4")
    return b"".join(
        [sizes.tobytes(), model.vertices.astype("<f4").tobytes(), model.faces.astype("<u4").tobytes()]
    )
