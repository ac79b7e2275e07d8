"""A scripted hand at the gizmo: how it moves the object nearer to where it belongs, and how long that takes.

Movements take the time of Fitts' law, everything else that of the keystroke-level model (Card, Moran and
Newell, "The keystroke-level model for user performance time with interactive systems", CACM 23, 1980). The
hand knows where the object belongs, but misjudges what is left: the constants below are a model, not people.
"""

from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core import pose

Array = NDArray[np.float64]

DECIDE, KEY, POINT, PRESS = 1.35, 0.28, 1.1, 0.1
"""Seconds of the keystroke-level model: M, K, P and B."""
CLICK = DECIDE + POINT + PRESS
"""Seconds to choose something and click it."""
FITTS_A, FITTS_B = 0.3, 0.25
"""Seconds, and seconds a bit, of the movement in a drag."""
MISJUDGED = 0.2
"""Standard deviation of how far off the object seems, as a share of how far it is, ..."""
UNSEEN = np.array([0.003, np.radians(3.0)])
"""... and the same however near it is, metres and radians."""
CLOSE = np.array([0.005, np.radians(5.0)])
"""Metres and radians within which an object is aligned."""
UPDATES = 10
"""Poses that a drag goes through."""


@dataclass(frozen=True)
class Stroke:
    """One drag of a handle."""

    path: Sequence[Array]
    """Poses (4, 4) of the gizmo."""
    seconds: float
    """That a person takes for it, deciding and reaching for the handle included."""


def next_stroke(T_gizmo: Array, T_wanted: Array, rng: np.random.Generator) -> Stroke:
    """Drag the one arrow or arc along or about which the gizmo seems farthest off, measured in `CLOSE`.

    Args:
        T_gizmo: (4, 4), where the gizmo is, in the world.
        T_wanted: (4, 4), where it should be.
        rng: of what the hand misjudges.
    """
    left = pose.log(pose.inverse(T_gizmo) @ T_wanted)
    seems = left * (1.0 + MISJUDGED * rng.normal(size=6)) + np.repeat(UNSEEN, 3) * rng.normal(size=6)
    unit = np.repeat(CLOSE, 3)
    axis = int(np.abs(seems / unit).argmax())
    twists = np.linspace(0.0, seems[axis], UPDATES + 1)[1:, None] * np.eye(6)[axis]
    movement = FITTS_A + FITTS_B * np.log2(abs(seems[axis]) / unit[axis] + 1.0)
    return Stroke([T_gizmo @ pose.exp(twist) for twist in twists], DECIDE + POINT + PRESS + float(movement))
