"""The mesh as 3-D views show it in its own colours: few enough faces, a picture small enough for a page."""

import io

import numpy as np
import trimesh
from numpy.typing import NDArray
from PIL import Image
from scipy.spatial import cKDTree
from trimesh.visual.material import PBRMaterial
from trimesh.visual.texture import TextureVisuals

from app.datasets.outline_mesh import MOST_FACES, thinned
from registration_core import ObjectModel
from registration_core.geometry.mesh_file import has_colors, read_mesh

MOST_PIXELS = 1024
"""Along a side of the picture."""
METRES = 0.001
"""A unit of a stored mesh."""


def textured_mesh(
    content: bytes, file_format: str, texture: bytes | None, model: ObjectModel
) -> trimesh.Trimesh | None:
    """The mesh in metres with its texture, or else with vertex colours; None where it has neither.

    Args:
        content: Of the mesh's file, whose unit is the millimetre.
        file_format: Of that file.
        texture: Content of the picture that it names, if any.
        model: The same mesh without colours.
    """
    if not has_colors(content, file_format):
        return None
    mesh = read_mesh(content, file_format, texture)
    if not mesh.visual.defined:
        return None
    mesh.apply_scale(METRES)
    if len(mesh.faces) > MOST_FACES:
        return _thinned(mesh, model)
    if mesh.visual.kind == "texture":
        picture = mesh.visual.material.image.convert("RGB")
        picture.thumbnail((MOST_PIXELS, MOST_PIXELS))
        mesh.visual = TextureVisuals(uv=mesh.visual.uv, material=_matt(picture))
    else:
        mesh.visual = _vertex_colors(mesh.visual.vertex_colors)
    return mesh


def packed(mesh: trimesh.Trimesh) -> bytes:
    """A textured mesh as bytes, little endian, for a page.

    The numbers V of vertices, F of faces and B of the picture's bytes (uint32 each), the vertices (V, 3)
    float32 in metres, in the object's frame, and the faces (F, 3) uint32; then, where B is 0, the colours
    (V, 4) uint8, or else the places in the picture (V, 2) float32, from 0 at its left and upper edge to 1,
    and the picture.
    """
    material = mesh.visual.material
    picture = b"" if material.baseColorTexture is None else _png(material.baseColorTexture)
    sizes = np.array([len(mesh.vertices), len(mesh.faces), len(picture)], dtype="<u4")
    parts = [sizes, mesh.vertices.astype("<f4"), mesh.faces.astype("<u4")]
    if picture:
        parts.append(np.column_stack([mesh.visual.uv[:, 0], 1.0 - mesh.visual.uv[:, 1]]).astype("<f4"))
    else:
        parts.append(mesh.visual.vertex_attributes["color"].astype(np.uint8))
    return b"".join(part.tobytes() for part in parts) + picture


def as_glb(mesh: trimesh.Trimesh, centre: NDArray[np.float64]) -> bytes:
    """A textured mesh as binary glTF, shifted so that `centre` (3,), metres, is its origin."""
    visual = mesh.visual
    if "color" in visual.vertex_attributes:  # which glTF has as amounts of light, not as screens have them
        visual = _vertex_colors(_linear(visual.vertex_attributes["color"]))
    shifted = trimesh.Trimesh(mesh.vertices - centre, mesh.faces, visual=visual, process=False)
    return bytes(shifted.export(file_type="glb"))


def _linear(colors: NDArray[np.uint8]) -> NDArray[np.uint8]:
    """sRGB colours (V, 4) as amounts of light (IEC 61966-2-1)."""
    shares = colors[:, :3] / 255.0
    light = np.where(shares <= 0.04045, shares / 12.92, ((shares + 0.055) / 1.055) ** 2.4)
    return np.column_stack([np.rint(255.0 * light), colors[:, 3]]).astype(np.uint8)


def _png(picture: Image.Image) -> bytes:
    stream = io.BytesIO()
    picture.save(stream, format="PNG")
    return stream.getvalue()


def _thinned(mesh: trimesh.Trimesh, model: ObjectModel) -> trimesh.Trimesh:
    """The thinned mesh; each vertex has the colour of the nearest one of the whole mesh."""
    coarse = thinned(model)
    of_vertices = mesh.visual.to_color() if mesh.visual.kind == "texture" else mesh.visual
    _, nearest = cKDTree(mesh.vertices).query(coarse.vertices)
    colors = _vertex_colors(of_vertices.vertex_colors[nearest])
    return trimesh.Trimesh(coarse.vertices, coarse.faces, visual=colors, process=False)


def _vertex_colors(colors: np.ndarray) -> TextureVisuals:
    visual = TextureVisuals(material=_matt(None))
    visual.vertex_attributes["color"] = colors
    return visual


def _matt(picture: Image.Image | None) -> PBRMaterial:
    """A material without gloss, which would show lamps that were not there."""
    return PBRMaterial(baseColorTexture=picture, metallicFactor=0.0, roughnessFactor=1.0, doubleSided=True)
