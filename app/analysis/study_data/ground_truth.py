"""Where an object truly is, as far as operators agree: the mean of where they put it."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.analysis.trace.pose_errors import pose_errors
from registration_core.geometry import pose

Array = NDArray[np.float64]

MOST_ROUNDS = 20
"""The twins that are nearest to the mean settle after two or three."""


@dataclass(frozen=True, eq=False)
class GroundTruth:
    """A pose that errors are measured from."""

    T_world_object: Array
    """(4, 4)."""
    count: int
    """Registrations that it is the mean of; 0 where it was given."""
    translation_spread: float
    """Metres, root mean square of the registrations about the mean; NaN for less than two."""
    rotation_spread: float
    """Radians, the same."""


def given_truth(T_world_object: Array) -> GroundTruth:
    """A reference pose (4, 4) that came with the data."""
    return GroundTruth(T_world_object, 0, np.nan, np.nan)


def mean_truth(T: Array, symmetries: Array) -> GroundTruth:
    """The mean of poses T (N, 4, 4), N >= 1, of an object with symmetries (S, 4, 4).

    Translation: the mean. Rotation: the chordal L2 mean (Hartley et al., "Rotation averaging", IJCV, 2013).
    Each pose is replaced by its symmetric twin nearest to the mean first, again and again until none changes.
    """
    assert len(T) > 0
    T_mean, chosen = T[0], np.full(len(T), -1)
    for _ in range(MOST_ROUNDS):
        before, chosen = chosen, _nearest_twins(T, T_mean, symmetries)
        if np.array_equal(before, chosen):
            break
        T_mean = pose.mean(T @ symmetries[chosen])
    errors = pose_errors(T, T_mean, symmetries)
    return GroundTruth(T_mean, len(T), _spread(errors.translation), _spread(errors.rotation))


def _nearest_twins(T: Array, T_mean: Array, symmetries: Array) -> NDArray[np.intp]:
    """(N,): the symmetry that turns each pose nearest to the mean."""
    twins = T[:, None, :3, :3] @ symmetries[None, :, :3, :3]
    return np.einsum("nsij,ij->ns", twins, T_mean[:3, :3]).argmax(axis=1)


def _spread(errors: Array) -> float:
    return float(np.sqrt(np.mean(errors**2))) if len(errors) > 1 else np.nan
