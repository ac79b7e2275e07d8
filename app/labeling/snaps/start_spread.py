"""How far off the start of a snap may be, told from the size of the operator's last drags.

Whoever just shifted the object along an axis by 3 cm is off along it by about as much at most: a small last
correction means that the object is near. Most drags use a single axis and do not vouch for the others, so an
axis is told by the last drag that used it, and the largest of them counts.
"""

from enum import Enum
from itertools import pairwise, takewhile

import numpy as np
from numpy.typing import NDArray

from app.labeling.moves.degrees_of_freedom import gizmo_motion
from app.labeling.moves.history import History
from registration_core.config import SpreadConfig

StartSpread = tuple[float, float]
"""Metres and radians."""

TRANSLATION_BOUNDS = (0.01, 0.06)
"""Metres. Nobody aims better by hand than the lower one, and whoever carries the object by half a metre to
its place does not leave it that far off."""
ROTATION_BOUNDS = (np.radians(8.0), np.radians(60.0))
"""Radians, for the same reasons."""


class Unsaid(Enum):
    """Stands for a spread that nobody gave, since None says that it is unknown."""

    FROM_DRAGS = "from the drags"


def spread_from_drags(
    history: History, pivot: NDArray[np.float64], default: SpreadConfig
) -> StartSpread | None:
    """How far off the present pose may be: along the worst axis, and about the worst one.

    Only the drags that led to the present pose, one after another, count; what was undone does not. A pose
    that was reset, set or found by a snap says nothing of how far off it is, and neither do the drags before
    it: who snaps again on an estimate doubts it, and wants the whole neighbourhood searched. Undoing an
    estimate leads back to the drags before it, and to their spread.

    Args:
        history: The poses so far.
        pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
        default: What an axis is off by that no drag has used.

    Returns:
        None, unknown, where there is no such drag.
    """
    steps = history.steps[: history.position + 1]
    dragged = len(list(takewhile(lambda step: step.dragged, reversed(steps))))
    way = [step.T_world_object for step in steps[len(steps) - dragged - 1 :]]
    motions = [gizmo_motion(before, after, pivot) for before, after in pairwise(way)]
    shift = _last_along_each_axis([motion.translation for motion in motions])
    turn = _last_along_each_axis([motion.rotation for motion in motions])
    if not shift.any() and not turn.any():
        return None
    return (
        float(np.clip(np.where(shift > 0, shift, default.translation).max(), *TRANSLATION_BOUNDS)),
        float(np.clip(np.where(turn > 0, turn, default.rotation).max(), *ROTATION_BOUNDS)),
    )


def _last_along_each_axis(vectors: list[NDArray[np.float64]]) -> NDArray[np.float64]:
    """Size (3,) of the last of the vectors (3,) along each axis that any of them uses; 0 along the others."""
    last = np.zeros(3)
    for vector in vectors:
        last = np.where(vector != 0, np.abs(vector), last)
    return last
