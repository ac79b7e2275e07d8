"""The mesh that is drawn, by a page for the outline and in the 3-D view: coarse enough for it."""

import numpy as np
from numpy.typing import NDArray

from registration_core import ObjectModel

MOST_FACES = 40_000
EXACT_CELLS = 2**20
"""Cells along the diameter within which vertices count as equal: texture seams would tear open otherwise."""
FINEST_CELLS = 400
"""Cells along the diameter to which a dense mesh is thinned first; then ever fewer, until it is small."""
COARSER = 1.02
"""By how much a cell grows at least from one try to the next."""

Mesh = tuple[NDArray[np.float64], NDArray[np.int32]]
"""Vertices (V, 3), metres, and faces (F, 3)."""


def drawable(model: ObjectModel) -> ObjectModel:
    """The mesh as it is where few faces are, or else `thinned`."""
    return model if len(model.faces) <= MOST_FACES else thinned(model)


def thinned(model: ObjectModel) -> ObjectModel:
    """The same mesh with equal vertices merged; one of more than `MOST_FACES` faces is thinned out, and its
    surface moves by less than a cell.

    Threads beside it go on: numpy holds the interpreter while it sorts rows, but not while it sorts numbers.
    """
    vertices, faces = fine = _clustered((model.vertices, model.faces), model.diameter / EXACT_CELLS)
    cell = model.diameter / FINEST_CELLS
    while len(faces) > MOST_FACES:
        vertices, faces = _clustered(fine, cell)
        cell *= max(
            COARSER, np.sqrt(len(faces) / MOST_FACES)
        )  # a surface has faces by the square of a length
    return ObjectModel(vertices, faces, model.symmetries)


def packed(model: ObjectModel) -> bytes:
    """The mesh as bytes, little endian: the numbers V of vertices and F of faces (uint32 each), the vertices
    (V, 3) float32 in metres, in the object's frame, and the faces (F, 3) uint32.
    """
    sizes = np.array([len(model.vertices), len(model.faces)], dtype="<u4")
    return b"".join(
        [sizes.tobytes(), model.vertices.astype("<f4").tobytes(), model.faces.astype("<u4").tobytes()]
    )


def _clustered(mesh: Mesh, cell: float) -> Mesh:
    """The mesh with the vertices of each cell [m] replaced by their mean, without the faces that collapse."""
    vertices, faces = mesh
    x, y, z = np.floor((vertices - vertices.min(axis=0)) / cell).astype(np.int64).T
    _, index, count = np.unique((x << 42) | (y << 21) | z, return_inverse=True, return_counts=True)
    means = np.stack([np.bincount(index, vertices[:, k]) / count for k in range(3)], axis=-1)
    a, b, c = merged = index.astype(np.int32)[faces.T]
    return means, np.ascontiguousarray(merged.T[(a != b) & (b != c) & (a != c)])
