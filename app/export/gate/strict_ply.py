"""Reads PLY files as the strictest readers of the field do, to find out whether they can.

Source: the rules of bop_toolkit's `inout.load_ply`, which knows four types and triangles alone, takes the
machine's own byte order for granted, and expects texture coordinates at vertices and their picture beside.
"""

from pathlib import Path

import numpy as np
from numpy.typing import NDArray

TYPES = {"float": "<f4", "double": "<f8", "int": "<i4", "uchar": "u1"}
FACE_LIST = "property list uchar int vertex_indices"
FORMAT = "format binary_little_endian 1.0"
TEXTURE = "comment TextureFile "
COORDINATES = {"texture_u", "texture_v"}


def read_triangles(path: Path) -> NDArray[np.float64]:
    """The corners (F, 3, 3) of a file's triangles, in its own unit.

    Raises:
        FileNotFoundError: where there is no such file.
        ValueError: where one of those readers would fail, or read something else.
    """
    header, found, body = path.read_bytes().partition(b"end_header\n")
    lines = header.decode("ascii", errors="replace").splitlines()
    if not found or lines[:2] != ["ply", FORMAT]:
        raise ValueError("must be a binary PLY in little-endian order")
    vertex_count, face_count, properties = _elements(lines[2:])
    _check_texture(path, lines, {name for name, _ in properties})
    vertices = np.dtype(properties)
    faces = np.dtype([("count", "u1"), ("corners", "<i4", 3)])
    vertex_bytes = vertex_count * vertices.itemsize
    if len(body) != vertex_bytes + face_count * faces.itemsize:
        raise ValueError("must hold triangles alone, as many as its header says")
    columns = np.frombuffer(body[:vertex_bytes], vertices)
    rows = np.frombuffer(body[vertex_bytes:], faces)
    corners = rows["corners"]
    if (rows["count"] != 3).any() or corners.min() < 0 or corners.max() >= vertex_count:
        raise ValueError("must hold triangles of its own vertices")
    points = np.stack([columns[axis] for axis in "xyz"], axis=-1).astype(np.float64)
    return points[corners]


def _elements(lines: list[str]) -> tuple[int, int, list[tuple[str, str]]]:
    """Numbers of vertices and faces, and the vertices' properties."""
    counts: dict[str, int] = {}
    properties = []
    for line in lines:
        match line.split():
            case ["comment", *_]:
                pass
            case ["element", "vertex" | "face" as kind, count] if kind not in counts:
                counts[kind] = int(count)
            case ["property", kind, name] if list(counts) == ["vertex"] and kind in TYPES:
                properties.append((name, TYPES[kind]))
            case _ if line == FACE_LIST and list(counts) == ["vertex", "face"]:
                pass
            case _:
                raise ValueError(f"has a line in its header that not all readers know: {line[:60]!r}")
    names = [name for name, _ in properties]
    if list(counts) != ["vertex", "face"] or not set("xyz") <= set(names) or not all(counts.values()):
        raise ValueError("must have vertices with x, y and z, and faces")
    return counts["vertex"], counts["face"], properties


def _check_texture(path: Path, lines: list[str], names: set[str]) -> None:
    pictures = [line.removeprefix(TEXTURE) for line in lines if line.startswith(TEXTURE)]
    if pictures and not names >= COORDINATES:
        raise ValueError("names a texture but has no texture_u and texture_v")
    for picture in pictures:
        if Path(picture).name != picture or not (path.parent / picture).is_file():
            raise ValueError(f"names the texture {picture!r}, which is not beside it")
