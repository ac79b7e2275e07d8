"""What the suggested axes of an object amount to: the group of rotations that they generate."""

from collections.abc import Sequence
from dataclasses import dataclass
from typing import TypeVar

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry.object_model import ContinuousSymmetry, Symmetries, discrete

Array = NDArray[np.float64]

TURNS = 2.0 * np.pi * np.modf(np.arange(1, 17) * (np.sqrt(5.0) - 1.0) / 2.0)[0]
"""Angles that stand for all angles: multiples of the golden one, even over a turn and over its fractions."""

SAME_AXIS = np.radians(6.0)
"""Axes nearer than this are one; the flips of a 12-fold prism are 15 degrees apart."""

SAME_ROTATION = np.radians(12.0)
"""Rotations nearer than this are one; those of a 12-fold axis are 30 degrees apart."""

MOST_ROTATIONS = 60
"""Of a finite group of rotations, as the icosahedron has them."""


@dataclass(frozen=True, eq=False)
class SymmetryAxis:
    """An axis about which an object can be turned onto itself."""

    axis: Array
    """(3,), unit length, in the mesh frame."""
    origin: Array
    """(3,), metres: a point of the axis; the one nearest to the surface's centroid where it was suggested."""
    fold: int | None
    """Turns by 1 / fold of a full turn; None: by any angle."""

    @property
    def transforms(self) -> Array:
        """The rotations (K, 4, 4) without the identity; 16 that stand for all where any angle will do."""
        return turns(self.axis, self.origin, angles_of(self.fold))


@dataclass(frozen=True, eq=False)
class SuggestedSymmetry(SymmetryAxis):
    """An axis that was found on a mesh."""

    residual: float
    """Metres: 99 % of the turned surface is nearer than this to the surface, after each of `transforms`."""


Axis = TypeVar("Axis", bound=SymmetryAxis)


def as_symmetries(suggestions: Sequence[SymmetryAxis]) -> Symmetries:
    """The symmetries that accepted suggestions, or other axes, amount to, as BOP writes them.

    Discrete axes give every rotation that can be composed of theirs: the three half turns of a box, 23
    rotations of a cube. With one axis of revolution, the flip is discrete, if there is one: BOP multiplies
    the two. BOP has no word for a sphere: its axes are listed side by side, which stands for the turns about
    each of them but not for those composed of several.

    Raises:
        ValueError: where `suggestions` contradict each other: their axes belong to no finite group.
    """
    revolutions = [s for s in suggestions if s.fold is None]
    continuous = tuple(ContinuousSymmetry(_triple(s.axis), _triple(s.origin)) for s in revolutions)
    if not revolutions:
        return discrete(closed([T for s in suggestions for T in s.transforms]))
    if len(revolutions) > 1:
        return Symmetries(continuous=continuous)
    half_turn = np.array([np.pi])
    over = [turns(s.axis, s.origin, half_turn)[0] for s in flips(suggestions, revolutions[0])[:1]]
    return Symmetries(discrete(over).discrete, continuous)


def closed(transforms: Sequence[Array]) -> list[Array]:
    """All rotations (4, 4) composed of some, without the identity; measured ones stand before products."""
    elements = [np.eye(4)]
    pending = list(transforms)
    while pending:
        T = pending.pop(0)
        traces = np.einsum("ij,kij->k", T[:3, :3], np.stack(elements)[:, :3, :3])
        if traces.max() > 1.0 + 2.0 * np.cos(SAME_ROTATION):
            continue
        elements.append(T)
        if len(elements) > MOST_ROTATIONS:
            raise ValueError("axes contradict each other: turns about them never close a cycle")
        pending += [product for E in elements for product in (T @ E, E @ T)]
    return elements[1:]


def order(suggestion: SymmetryAxis) -> float:
    """Number of rotations about its axis."""
    return np.inf if suggestion.fold is None else suggestion.fold


def flips(suggestions: Sequence[Axis], revolution: SymmetryAxis) -> list[Axis]:
    """Those that turn over an axis of revolution: half turns about an axis across it."""
    return [
        s
        for s in suggestions
        if s.fold is not None and s.fold % 2 == 0 and abs(s.axis @ revolution.axis) < np.sin(SAME_AXIS)
    ]


def angles_of(fold: int | None) -> Array:
    """The angles (K,) by which an axis of this order turns, without 0; 16 for an axis of revolution."""
    return TURNS if fold is None else 2.0 * np.pi * np.arange(1, fold) / fold


def axis_rotations(axis: Array, angles: Array) -> Array:
    """Rotation matrices (K, 3, 3) about an axis (3,), or about each of (K, 3), by angles (K,) or (1,)."""
    return Rotation.from_rotvec(angles[:, None] * axis).as_matrix()


def turns(axis: Array, origin: Array, angles: Array) -> Array:
    """The same as transforms (K, 4, 4) that leave `origin` (3,) where it is."""
    rotations = axis_rotations(axis, angles)
    transforms = np.tile(np.eye(4), (len(rotations), 1, 1))
    transforms[:, :3, :3] = rotations
    transforms[:, :3, 3] = origin - rotations @ origin
    return transforms


def _triple(values: Array) -> tuple[float, float, float]:
    x, y, z = values.tolist()
    return x, y, z
