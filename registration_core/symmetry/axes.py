"""Symmetries as a person handles them: the axes that they turn about, and whether axes go together."""

from collections.abc import Sequence
from dataclasses import replace
from itertools import combinations

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry.object_model import ObjectModel, Symmetries
from registration_core.symmetry.group import SAME_AXIS, SymmetryAxis, flips

Array = NDArray[np.float64]

HIGHEST_FOLD = 24
"""Turns by less than 15 degrees are as good as any angle, and BOP's list of them would be long."""

SAME_ANGLE = np.radians(2.0)
"""Angles nearer than this are one where folds are read off transforms."""

LARGEST_GAP = 0.05
"""Share of the diameter by which axes may pass each other: all symmetries leave the centroid where it is."""

LARGEST_MISS = 0.5
"""Share of the diameter by which an axis may pass the middle of the object."""


def axes_of(symmetries: Symmetries) -> tuple[SymmetryAxis, ...]:
    """The axes that symmetries turn about, each once with all its turns; those of any angle come first."""
    revolutions = [
        SymmetryAxis(_unit(np.array(s.axis)), np.array(s.offset), fold=None) for s in symmetries.continuous
    ]
    found: list[SymmetryAxis] = []
    angles: list[list[float]] = []
    for T in np.array(symmetries.discrete, dtype=np.float64).reshape(-1, 4, 4):
        vector = Rotation.from_matrix(T[:3, :3]).as_rotvec()
        angle = float(np.linalg.norm(vector))
        if angle < SAME_ANGLE:
            continue
        alike = [abs(one.axis @ vector) > angle * np.cos(SAME_AXIS) for one in found]
        if not any(alike):
            # The point of the axis that is nearest to the mesh's origin solves (1 - R) p = t.
            origin = np.linalg.pinv(np.eye(3) - T[:3, :3], rcond=1e-6) @ T[:3, 3]
            found.append(SymmetryAxis(vector / angle, origin, fold=2))
            angles.append([angle])
        else:
            angles[alike.index(True)].append(angle)
    turned = [
        replace(axis, fold=_fold_of(np.array(all_of_it)))
        for axis, all_of_it in zip(found, angles, strict=True)
    ]
    return (*revolutions, *turned)


def check_axes(axes: Sequence[SymmetryAxis], model: ObjectModel) -> None:
    """Raise ValueError, naming `axes[i]`, where axes cannot be those of the object's symmetries together."""
    for number, axis in enumerate(axes):
        miss = float(np.linalg.norm(np.cross(model.centre - axis.origin, axis.axis)))
        if miss > LARGEST_MISS * model.diameter:
            raise ValueError(
                f"axes[{number}] passes {1000 * miss:.4g} mm from the middle of the object, which is"
                f" {1000 * model.diameter:.4g} mm across; give its point in metres, in the mesh's frame"
            )
    for (first, one), (second, other) in combinations(enumerate(axes), 2):
        across = np.cross(one.axis, other.axis)
        sine = float(np.linalg.norm(across))
        if sine < np.sin(SAME_AXIS):
            raise ValueError(
                f"axes[{first}] and axes[{second}] have one direction; give it once, with its highest fold"
            )
        gap = abs(float((other.origin - one.origin) @ across)) / sine
        if gap > LARGEST_GAP * model.diameter:
            raise ValueError(
                f"axes[{first}] and axes[{second}] pass each other by {1000 * gap:.3g} mm;"
                " the axes of an object's symmetries all meet in one point"
            )
    _check_revolutions(axes)


def _check_revolutions(axes: Sequence[SymmetryAxis]) -> None:
    revolutions = [number for number, axis in enumerate(axes) if axis.fold is None]
    if not revolutions:
        return
    around = axes[revolutions[0]]
    others = [axis for axis in axes if axis.fold is not None]
    fitting = [axis for axis in flips(others, around) if axis.fold == 2] if len(revolutions) == 1 else []
    for number, axis in enumerate(axes):
        if axis.fold is not None and not any(axis is one for one in fitting):
            raise ValueError(
                f"axes[{number}] does not go with axes[{revolutions[0]}], which turns by any angle:"
                " beside it there can only be half turns, about axes across it"
            )


def _fold_of(angles: Array) -> int:
    """The least fold whose turns are these angles (K,), radians."""
    folds = np.arange(2, HIGHEST_FOLD + 1)
    shares = angles[:, None] * folds / (2.0 * np.pi)
    misses = (np.abs(shares - np.round(shares)) / folds).max(axis=0) * 2.0 * np.pi
    near = np.flatnonzero(misses < SAME_ANGLE)
    return int(folds[near[0]] if len(near) else folds[np.argmin(misses)])


def _unit(vector: Array) -> Array:
    return vector / np.linalg.norm(vector)
