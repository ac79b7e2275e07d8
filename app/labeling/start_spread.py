"""How far off the start of a snap may be, told from the size of the operator's last drags.

Whoever moved the object by 3 cm just now is off by about as much at most: a small last correction means that
the object is near. A drag uses few degrees of freedom, so translation and rotation are told apart.
"""

from enum import Enum
from itertools import pairwise, takewhile

import numpy as np
from numpy.typing import NDArray

from app.labeling.degrees_of_freedom import gizmo_motion
from app.labeling.history import History
from registration_core.snap_config import SpreadConfig

StartSpread = tuple[float, float]
"""Metres and radians."""

TRANSLATION_BOUNDS = (0.01, 0.06)
"""Metres. A drag by a millimetre corrects one axis and does not vouch for the others; one of half a metre
carries the object to its place, and no operator leaves it that far off."""
ROTATION_BOUNDS = (np.radians(8.0), np.radians(60.0))
"""Radians, for the same reasons."""


class Unsaid(Enum):
    """Stands for a spread that nobody gave, since None says that it is unknown."""

    FROM_DRAGS = "from the drags"


def spread_from_drags(
    history: History, pivot: NDArray[np.float64], default: SpreadConfig
) -> StartSpread | None:
    """How far off the present pose may be: as far as the last shift went, and by as much as the last turn.

    Only the drags that led to the present pose, one after another, count; what was undone does not. A pose
    that was reset, set or found by a snap says nothing of how far off it is, and neither do the drags before
    it: who snaps again on an estimate doubts it, and wants the whole neighbourhood searched. Undoing an
    estimate leads back to the drags before it, and to their spread.

    Args:
        history: The poses so far.
        pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
        default: Has the part that no drag tells, where another tells the other.

    Returns:
        None, unknown, where there is no such drag.
    """
    steps = history.steps[: history.position + 1]
    dragged = len(list(takewhile(lambda step: step.dragged, reversed(steps))))
    way = [step.T_world_object for step in steps[len(steps) - dragged - 1 :]]
    motions = [gizmo_motion(before, after, pivot) for before, after in pairwise(way)]
    lengths = [float(np.linalg.norm(motion.translation)) for motion in motions if motion.translation.any()]
    angles = [float(np.linalg.norm(motion.rotation)) for motion in motions if motion.rotation.any()]
    if not lengths and not angles:
        return None
    return (
        float(np.clip(lengths[-1], *TRANSLATION_BOUNDS)) if lengths else default.translation,
        float(np.clip(angles[-1], *ROTATION_BOUNDS)) if angles else default.rotation,
    )
