"""A known object: its mesh in metres, its diameter and its symmetries."""

import hashlib
from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.spatial.distance import pdist
from scipy.spatial.transform import Rotation

from registration_core.geometry.mesh_file import read_mesh

Array = NDArray[np.float64]

METRES_PER_UNIT = {"m": 1.0, "cm": 0.01, "mm": 0.001}
"""Units a mesh file may be in."""

PLAUSIBLE_DIAMETER = (0.005, 5.0)
"""Metres; a diameter outside of it means that the unit is wrong."""


@dataclass(frozen=True)
class ContinuousSymmetry:
    """A rotation by any angle about an axis that maps the object onto itself."""

    axis: tuple[float, float, float]
    """Direction in the mesh frame."""
    offset: tuple[float, float, float] = (0.0, 0.0, 0.0)
    """A point on the axis, metres, in the mesh frame."""


@dataclass(frozen=True)
class Symmetries:
    """The rigid motions that map an object onto itself; the identity is implied."""

    discrete: tuple[tuple[tuple[float, ...], ...], ...] = ()
    """Transforms as 4x4 nested tuples, metres, in the mesh frame."""
    continuous: tuple[ContinuousSymmetry, ...] = ()
    """Axes of revolution."""

    def transforms(self, diameter: float, step: float = 0.01) -> Array:
        """All symmetry transforms (S, 4, 4), identity first, as bop_toolkit makes them.

        A continuous axis is sampled so that no point on the object's largest circle moves by more than
        `step` times the diameter; its samples are multiplied with the discrete transforms.
        """
        assert diameter > 0
        discrete = [np.eye(4), *(np.array(T, dtype=np.float64) for T in self.discrete)]
        if not self.continuous:
            return np.stack(discrete)
        steps = int(np.ceil(np.pi / step))
        products = []
        for symmetry in self.continuous:
            axis = np.array(symmetry.axis) / np.linalg.norm(symmetry.axis)
            angles = 2.0 * np.pi * np.arange(steps) / steps
            turned = np.tile(np.eye(4), (steps, 1, 1))
            turned[:, :3, :3] = Rotation.from_rotvec(angles[:, None] * axis).as_matrix()
            offset = np.array(symmetry.offset)
            turned[:, :3, 3] = offset - turned[:, :3, :3] @ offset
            products += [turned @ T for T in discrete]
        return np.concatenate(products)


@dataclass(frozen=True, eq=False)
class ObjectModel:
    """A triangle mesh in metres, in the frame of its file.

    Raises:
        ValueError: where the mesh is empty, has no area, or holds a number that is not finite.
    """

    vertices: Array
    """(V, 3), metres."""
    faces: NDArray[np.int32]
    """(F, 3), indices of vertices."""
    symmetries: Symmetries = field(default_factory=Symmetries)

    def __post_init__(self) -> None:
        if len(self.vertices) == 0 or len(self.faces) == 0:
            raise ValueError("mesh must have vertices and faces; it is empty")
        if not np.isfinite(self.vertices).all():
            raise ValueError("mesh vertices must be finite numbers; there is a NaN or an infinity")
        if self.faces.min() < 0 or self.faces.max() >= len(self.vertices):
            raise ValueError("mesh faces must point at its vertices; one points outside")
        if not trimesh.triangles.area(self.vertices[self.faces]).sum() > 0.0:
            raise ValueError("mesh must have a surface; the area of its faces is 0")

    @classmethod
    def load(cls, path: str | Path, unit: str = "m", symmetries: Symmetries | None = None) -> "ObjectModel":
        """Read a mesh file (PLY, OBJ, STL, ...) whose lengths are in `unit` (m, cm or mm).

        Raises:
            FileNotFoundError: where there is no such file.
            ValueError: where it cannot be read, is empty, or its size is implausible for the unit.
        """
        path = Path(path)
        return cls.from_bytes(path.read_bytes(), path.suffix.lstrip("."), unit, symmetries)

    @classmethod
    def from_bytes(
        cls, content: bytes, file_type: str, unit: str = "m", symmetries: Symmetries | None = None
    ) -> "ObjectModel":
        """The same as `load`, from a file's content; `file_type` is its suffix, such as "ply"."""
        if unit not in METRES_PER_UNIT:
            raise ValueError(f"unit must be one of {', '.join(METRES_PER_UNIT)}; it is {unit!r}")
        mesh = read_mesh(content, file_type)
        model = cls(
            np.asarray(mesh.vertices, dtype=np.float64) * METRES_PER_UNIT[unit],
            np.asarray(mesh.faces, dtype=np.int32),
            symmetries or Symmetries(),
        )
        low, high = PLAUSIBLE_DIAMETER
        if not low <= model.diameter <= high:
            raise ValueError(
                f"mesh measures {model.diameter:.6g} m across when read in {unit}, outside {low} to {high} m;"
                " check the unit of its file"
            )
        return model

    @cached_property
    def diameter(self) -> float:
        """The largest distance between two vertices, metres."""
        try:
            hull = trimesh.convex.convex_hull(self.vertices).vertices
        except Exception:  # flat meshes have no hull in three dimensions
            hull = self.vertices[:: max(1, len(self.vertices) // 2000)]
        return float(pdist(hull[:: max(1, len(hull) // 4000)]).max(initial=0.0))

    @cached_property
    def centre(self) -> Array:
        """Centre of the bounding box (3,), metres."""
        return (self.vertices.min(axis=0) + self.vertices.max(axis=0)) / 2.0

    @cached_property
    def radius(self) -> float:
        """Radius of the sphere about `centre` that holds the mesh, metres."""
        return float(np.linalg.norm(self.vertices - self.centre, axis=1).max())

    @cached_property
    def content_hash(self) -> str:
        """Hash of geometry and symmetries: equal models have equal hashes on every machine."""
        digest = hashlib.sha256()
        digest.update(np.ascontiguousarray(self.vertices, dtype="<f8").tobytes())
        digest.update(np.ascontiguousarray(self.faces, dtype="<i4").tobytes())
        digest.update(repr(self.symmetries).encode())
        return digest.hexdigest()

    @cached_property
    def symmetry_transforms(self) -> Array:
        """`symmetries.transforms` (S, 4, 4) for this diameter, identity first."""
        return self.symmetries.transforms(self.diameter)


def discrete(transforms: Sequence[Array]) -> Symmetries:
    """Symmetries from a list of (4, 4) transforms in metres."""
    return Symmetries(discrete=tuple(tuple(map(tuple, T.tolist())) for T in transforms))
