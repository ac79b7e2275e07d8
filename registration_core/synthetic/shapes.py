"""Coloured shapes made in code: turned, swept, rounded. Edges are sharp where vertices are doubled."""

from collections.abc import Sequence

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray

Array = NDArray[np.float64]
Color = tuple[int, int, int]
"""Red, green and blue, 0 to 255."""


def painted(mesh: trimesh.Trimesh, color: Color) -> trimesh.Trimesh:
    """The mesh with one colour on all vertices."""
    mesh.visual.vertex_colors = np.tile(np.array([*color, 255], dtype=np.uint8), (len(mesh.vertices), 1))
    return mesh


def turned(profile: ArrayLike, color: Color, sections: int = 64) -> trimesh.Trimesh:
    """A smooth band: `profile` (P, 2), radius and height in metres, turned about the z axis.

    The outside lies to the right of the profile's direction, so an outer wall runs upwards.
    """
    points = np.asarray(profile, dtype=np.float64)
    angles = 2.0 * np.pi * np.arange(sections) / sections
    radius, height = points[:, None, 0], points[:, None, 1]
    rings = np.stack(np.broadcast_arrays(radius * np.cos(angles), radius * np.sin(angles), height), axis=-1)
    return painted(surface(rings), color)


def swept(path: ArrayLike, half_axes: ArrayLike, color: Color, sections: int = 20) -> trimesh.Trimesh:
    """A closed tube with an elliptic cross-section along a path in the xz plane.

    Args:
        path: (P, 2), x and z of the centre line, metres.
        half_axes: (2,) or (P, 2): half widths across the path in its plane and along y, metres.
        color: of the whole tube.
        sections: corners of the cross-section.
    """
    centre = np.asarray(path, dtype=np.float64)
    widths = np.broadcast_to(np.asarray(half_axes, dtype=np.float64), centre.shape)
    tangent = np.gradient(centre, axis=0)
    tangent /= np.linalg.norm(tangent, axis=1, keepdims=True)
    across = np.stack([tangent[:, 1], np.zeros(len(centre)), -tangent[:, 0]], axis=1)
    angles = 2.0 * np.pi * np.arange(sections) / sections
    middle = np.stack([centre[:, 0], np.zeros(len(centre)), centre[:, 1]], axis=1)
    rings = (
        middle[:, None]
        + (widths[:, :1] * np.cos(angles))[..., None] * across[:, None]
        + (widths[:, 1:] * np.sin(angles))[..., None] * np.array([0.0, 1.0, 0.0])
    )
    caps = [np.repeat(ring.mean(axis=0, keepdims=True), sections, axis=0) for ring in (rings[0], rings[-1])]
    tube = [surface(np.stack([caps[0], rings[0]])), surface(rings), surface(np.stack([rings[-1], caps[1]]))]
    return painted(joined(tube), color)


def surface(rings: Array) -> trimesh.Trimesh:
    """The surface through closed rings of points (P, S, 3); triangles without area are left out."""
    count, sections = rings.shape[:2]
    here = np.arange(count * sections).reshape(count, sections)
    there = np.roll(here, -1, axis=1)
    a, b, c, d = here[:-1].ravel(), there[:-1].ravel(), there[1:].ravel(), here[1:].ravel()
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    corners = rings.reshape(-1, 3)[faces]
    areas = np.linalg.norm(np.cross(corners[:, 1] - corners[:, 0], corners[:, 2] - corners[:, 0]), axis=1)
    mesh = trimesh.Trimesh(rings.reshape(-1, 3), faces[areas > 1e-12], process=False)
    mesh.remove_unreferenced_vertices()
    return mesh


def rounded_box(
    size: Sequence[float], radius: float, color: Color, cuts: Sequence[Sequence[float]] = ((), (), ())
) -> trimesh.Trimesh:
    """A box about the origin with rounded edges, metres.

    Args:
        size: full extents (3,).
        radius: of edges and corners.
        color: of all vertices.
        cuts: for each axis, where more grid lines run, so that colours can change there.
    """
    inner = np.asarray(size, dtype=np.float64) / 2.0 - radius
    rim = radius * np.tan(np.linspace(0.0, np.pi / 4.0, 4))
    lines = [
        np.unique(
            np.concatenate(
                [-a - rim, a + rim, np.array(extra, dtype=np.float64), 0.93 * np.array([-a, a])]
            ).round(7)
        )
        for a, extra in zip(inner, cuts, strict=True)
    ]
    sides = [_side(lines, axis, sign) for axis in range(3) for sign in (-1, 1)]
    mesh = joined(sides)
    core = np.clip(mesh.vertices, -inner, inner)
    outward = mesh.vertices - core
    mesh.vertices = core + radius * outward / np.linalg.norm(outward, axis=1, keepdims=True)
    mesh.merge_vertices(digits_vertex=7)
    return painted(mesh, color)


def _side(lines: list[Array], axis: int, sign: int) -> trimesh.Trimesh:
    """One side of a box as a grid through `lines`, its outside facing away from the centre."""
    first, second = (axis + 1) % 3, (axis + 2) % 3
    u, v = np.meshgrid(lines[first], lines[second], indexing="ij")
    points = np.empty((*u.shape, 3))
    points[..., first], points[..., second], points[..., axis] = u, v, sign * lines[axis][-1]
    index = np.arange(u.size).reshape(u.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    return trimesh.Trimesh(points.reshape(-1, 3), faces[:, ::sign], process=False)


def joined(parts: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """One mesh of several, their vertices kept apart."""
    return trimesh.util.concatenate(list(parts))


def moved(mesh: trimesh.Trimesh, T: Array) -> trimesh.Trimesh:
    """The mesh transformed by T (4, 4)."""
    mesh.apply_transform(T)
    return mesh


def shifted(mesh: trimesh.Trimesh, x: float, y: float, z: float) -> trimesh.Trimesh:
    """The mesh moved, metres."""
    mesh.apply_translation((x, y, z))
    return mesh


def arc(centre: Sequence[float], radii: Sequence[float], start: float, stop: float, count: int) -> Array:
    """Points (count, 2) on an ellipse between two angles in degrees."""
    angles = np.radians(np.linspace(start, stop, count))
    return np.asarray(centre) + np.asarray(radii) * np.stack([np.cos(angles), np.sin(angles)], axis=1)
