"""Mesh files: read as triangles with their colours, and written in a form that every tool reads."""

import io
import threading

import numpy as np
import trimesh
from PIL import Image
from trimesh.exchange.ply import load_ply
from trimesh.visual.texture import TextureVisuals

LONGEST_HEADER = 65536
"""Bytes of a PLY file's header that are looked at."""

_reading = threading.Lock()
"""One at a time: numpy parses a PLY file's types as Python, and CPython 3.11 fails where two threads do."""


def read_mesh(content: bytes, file_type: str, texture: bytes | None = None) -> trimesh.Trimesh:
    """The triangle mesh in a file's content, with its colours, vertices neither merged nor reordered.

    Polygons are cut into triangles; vertices that no face uses are left out. With `texture`, the content of
    the picture that the file names, vertices are doubled along the seams of the texture.

    Raises:
        ValueError: where it cannot be read as one mesh.
    """
    try:
        with _reading:
            mesh = _read(content, file_type, texture)
    except Exception as error:  # trimesh's readers raise whatever they meet
        raise ValueError(f"mesh cannot be read as {file_type}: {error}") from error
    if not isinstance(mesh, trimesh.Trimesh) or len(mesh.faces) == 0:
        strips = file_type == "ply" and b"element tristrips" in _header(content)
        hint = " (it holds triangle strips; save it as triangles)" if strips else ""
        raise ValueError(f"mesh must have vertices and faces; it is empty{hint}")
    if mesh.faces.min() >= 0 and mesh.faces.max() < len(mesh.vertices):
        mesh.remove_unreferenced_vertices()
    return mesh


def texture_name(content: bytes) -> str | None:
    """The picture that a PLY file names for its texture, or None."""
    for line in _header(content).splitlines():
        words = line.split(None, 2)
        if len(words) == 3 and words[0] == b"comment" and words[1].lower() == b"texturefile":
            return words[2].strip().decode("utf-8", errors="replace")
    return None


def has_colors(content: bytes, file_type: str) -> bool:
    """Whether the mesh in a file's content may have colours or a texture, by its header alone."""
    if file_type != "ply":
        return True
    words = [line.split() for line in _header(content).splitlines()]
    named = {line[-1] for line in words if line[:1] == [b"property"]}
    return texture_name(content) is not None or named >= {b"red", b"green", b"blue"}


def plain_ply(mesh: trimesh.Trimesh, picture_name: str | None = None) -> bytes:
    """A mesh as binary PLY: triangles, little-endian, float32, the names and types that all readers know.

    Args:
        mesh: With vertex colours or, for `picture_name`, texture coordinates.
        picture_name: Of the texture's picture, beside the file.
    """
    columns = [("float", "xyz", mesh.vertices), ("float", ("nx", "ny", "nz"), mesh.vertex_normals)]
    if picture_name is not None:
        columns.append(("float", ("texture_u", "texture_v"), mesh.visual.uv))
    elif mesh.visual.defined and mesh.visual.kind in ("vertex", "face"):
        columns.append(("uchar", ("red", "green", "blue"), mesh.visual.vertex_colors[:, :3]))
    types = {"float": "<f4", "uchar": "u1"}
    names = [(kind, name) for kind, group, _ in columns for name in group]
    vertices = np.empty(len(mesh.vertices), dtype=[(name, types[kind]) for kind, name in names])
    for _, group, values in columns:
        for name, column in zip(group, np.asarray(values).T, strict=True):
            vertices[name] = column
    faces = np.empty(len(mesh.faces), dtype=[("count", "u1"), ("corners", "<i4", 3)])
    faces["count"], faces["corners"] = 3, mesh.faces
    header = [
        "ply",
        "format binary_little_endian 1.0",
        *([f"comment TextureFile {picture_name}"] if picture_name else []),
        f"element vertex {len(vertices)}",
        *(f"property {kind} {name}" for kind, name in names),
        f"element face {len(faces)}",
        "property list uchar int vertex_indices",
        "end_header\n",
    ]
    return "\n".join(header).encode() + vertices.tobytes() + faces.tobytes()


def _read(content: bytes, file_type: str, texture: bytes | None) -> trimesh.Trimesh | None:
    if file_type != "ply":
        return trimesh.load(io.BytesIO(content), file_type=file_type, force="mesh", process=False)
    loaded = load_ply(io.BytesIO(content), fix_texture=texture is not None, skip_materials=True)
    if loaded.get("faces") is None:
        return None
    visual = loaded.pop("visual", None)
    if texture is not None and visual is not None:
        loaded["visual"] = TextureVisuals(uv=visual.uv, image=Image.open(io.BytesIO(texture)))
    return trimesh.Trimesh(**loaded, process=False)


def _header(content: bytes) -> bytes:
    return content[:LONGEST_HEADER].partition(b"end_header")[0]
