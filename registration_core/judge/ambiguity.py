"""What depth cannot tell about a pose: other modes of like weight, and motions that change nothing seen."""

from collections.abc import Callable
from dataclasses import dataclass
from typing import Literal

import numpy as np
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.config import SelectionConfig
from registration_core.geometry import pose
from registration_core.geometry.kernels import from_rows
from registration_core.judge.selection import scores
from registration_core.search.polish import scaled_covariances
from registration_core.search.viewpoint_model import ViewpointModel

Array = NDArray[np.float64]

LIKE_WEIGHT = 0.5
"""A mode with this share of the best one's weight could as well be the right one."""
LEAST_TURN = 0.1
"""Radians: modes whose rotations differ by less are told apart by their shift."""
UNHELD = 0.02
"""A motion is looked at if its standard deviation is larger than this share of the diameter."""
PROBE = 0.1
"""It is tried by as large a move, share of the diameter, ..."""
UNNOTICED = 1.0
"""... and is free if the evidence falls by less than this, log-odds."""
KNOWN_AXIS = 0.95
"""Cosine from which on an axis is that of a known symmetry."""


@dataclass(frozen=True)
class Ambiguity:
    """Something about a pose that the depth does not tell."""

    kind: Literal["other mode", "free motion"]
    """Another mode of like weight, or a motion that changes nothing that is seen."""
    motion: Literal["turn", "shift"]
    axis: tuple[float, ...]
    """(3,), direction in the mesh frame: about which the object could be turned, or along which shifted."""
    extent: float
    """Radians or metres: how far off the other mode is, or the standard deviation of the free motion."""


def ambiguities(
    modes: Array,
    masses: Array,
    hessian: Array,
    evidence: Callable[[Array], Array],
    model: ViewpointModel,
    config: SelectionConfig,
) -> tuple[Ambiguity, ...]:
    """What is ambiguous about the best of the modes (N, 4, 4), which comes first.

    Args:
        modes: poses of the frame moved to the object's centre.
        masses: (N,), the share of the belief that each has.
        hessian: (6, 6), as `polish.systems` scales it, at the best mode.
        evidence: gives the evidence (N, COUNT) of poses (N, 4, 4) such as these.
    """
    return (*_other_modes(modes, masses, model), *_free_motions(modes[0], hessian, evidence, model, config))


def _other_modes(modes: Array, masses: Array, model: ViewpointModel) -> list[Ambiguity]:
    found = []
    for mode in modes[1:][masses[1:] >= LIKE_WEIGHT * masses[0]]:
        twins = pose.inverse(modes[0]) @ mode @ from_rows(model.symmetries)
        least_turned = np.argmax(np.trace(twins[:, :3, :3], axis1=1, axis2=2))
        difference = pose.log(twins[least_turned])
        angle, length = float(np.linalg.norm(difference[3:])), float(np.linalg.norm(difference[:3]))
        if angle >= LEAST_TURN:
            found.append(Ambiguity("other mode", "turn", tuple(difference[3:] / angle), angle))
        else:
            found.append(Ambiguity("other mode", "shift", tuple(difference[:3] / max(length, 1e-12)), length))
    return found


def _free_motions(
    T: Array,
    hessian: Array,
    evidence: Callable[[Array], Array],
    model: ViewpointModel,
    config: SelectionConfig,
) -> list[Ambiguity]:
    """Principal motions that the polish does not hold and that the evidence does not notice either."""
    variances, motions = np.linalg.eigh(scaled_covariances(hessian, model.radius))
    found = []
    for variance, motion in zip(variances[::-1], motions.T[::-1], strict=True):
        if np.sqrt(variance) < UNHELD * model.diameter:
            break
        is_turn = np.linalg.norm(motion[3:]) > np.linalg.norm(motion[:3])
        axis = T[:3, :3].T @ (motion[3:] if is_turn else motion[:3])
        axis /= np.linalg.norm(axis)
        if is_turn and _is_known(axis, model):
            continue
        step = np.concatenate([motion[:3], motion[3:] / model.radius]) * PROBE * model.diameter
        tried = np.stack([T, _moved(T, step), _moved(T, -step)])
        there, *beside = scores(evidence(tried), np.zeros(3), config)
        if there - max(beside) < UNNOTICED:
            extent = np.sqrt(variance) / (model.radius if is_turn else 1.0)
            found.append(Ambiguity("free motion", "turn" if is_turn else "shift", tuple(axis), float(extent)))
    return found


def _moved(T: Array, step: Array) -> Array:
    moved = T.copy()
    moved[:3, 3] += step[:3]
    moved[:3, :3] = Rotation.from_rotvec(step[3:]).as_matrix() @ T[:3, :3]
    return moved


def _is_known(axis: Array, model: ViewpointModel) -> bool:
    """Whether there are small turns about this axis (3,) among the object's symmetries."""
    turns = Rotation.from_matrix(model.symmetries[1:, :, :3].astype(np.float64)).as_rotvec()
    angles = np.linalg.norm(turns, axis=1)
    small = (angles > 1e-6) & (angles < 0.5)
    return bool((np.abs(turns[small] @ axis) > KNOWN_AXIS * angles[small]).any())
