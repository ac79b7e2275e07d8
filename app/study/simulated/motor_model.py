"""A simulated hand at the gizmo: how it moves the object nearer to where it belongs, and how long that takes.

Each stroke turns or shifts the object by one handle. Its constants are a model, not people:

- Deciding, reaching for a handle and pressing take the times of the keystroke-level model (Card, Moran and
  Newell, "The keystroke-level model for user performance time with interactive systems", CACM 23, 1980).
- The movement takes the time of Fitts' law in Shannon's form, and ends beside its aim with a standard
  deviation of the target's width over 4.133 (MacKenzie, "Fitts' law as a research and design tool in
  human-computer interaction", Human-Computer Interaction 7, 1992).
- On the way it is a movement of minimum jerk (Flash and Hogan, "The coordination of arm movements: an
  experimentally confirmed mathematical model", Journal of Neuroscience 5, 1985).
"""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core.geometry import pose

Array = NDArray[np.float64]

DECIDE, KEY, POINT, PRESS = 1.35, 0.28, 1.1, 0.1
"""Seconds of the keystroke-level model, for people of practice: M, K, P and B."""
CLICK = DECIDE + POINT + PRESS
"""Seconds to choose something and click it."""
CLOSE = np.array([0.005, np.radians(5.0)])
"""Metres and radians within which an object is aligned."""
DEVIATIONS_ACROSS = 4.133
"""Standard deviations that make up the width of a target."""
UPDATES_PER_SECOND = 20
"""Of the pose, during a drag."""


@dataclass(frozen=True)
class MotorModel:
    """Whoever moves the object: the speed of hand and mind, and how well they see what is left to do."""

    decide: float = DECIDE
    """Seconds to look and to choose the next stroke."""
    point: float = POINT
    """Seconds to reach for a handle."""
    fitts_a: float = 0.3
    """Seconds of any movement, ..."""
    fitts_b: float = 0.25
    """... and seconds a bit."""
    misjudged: float = 0.2
    """Standard deviation of how far off the object seems in one look, as a share of how far it is, ..."""
    unseen: tuple[float, float] = (0.003, np.radians(3.0))
    """... and the same however near it is, metres and radians along or about each axis."""
    biased: tuple[float, float] = (0.0015, np.radians(1.5))
    """Standard deviation of what looking again does not mend in one registration, metres and radians."""


EXPERT = MotorModel()
NOVICE = MotorModel(
    decide=2.0,
    point=1.5,
    fitts_a=0.4,
    fitts_b=0.35,
    misjudged=0.35,
    unseen=(0.004, np.radians(4.5)),
    biased=(0.003, np.radians(4.0)),
)


@dataclass(frozen=True)
class Stroke:
    """One drag of a handle."""

    reach: float
    """Seconds until the handle is held: to decide, and to get there."""
    seconds_held: Array
    """(P,), since the handle was held; the last one is when it is let go."""
    path: Array
    """Poses (P, 4, 4) of the gizmo at these times."""

    @property
    def seconds(self) -> float:
        """That it takes in all."""
        return self.reach + float(self.seconds_held[-1])


def seen_offset(
    T_gizmo: Array, T_wanted: Array, motor: MotorModel, rng: np.random.Generator, looks: int = 1
) -> Array:
    """How far off the gizmo seems, along and about its axes (6,), metres and radians.

    Args:
        T_gizmo: (4, 4), where the gizmo is, in the world.
        T_wanted: (4, 4), where it should be.
        motor: Who looks.
        rng: Of what is misjudged.
        looks: Whose mean is taken.
    """
    left = pose.log(pose.inverse(T_gizmo) @ T_wanted)
    share, floor = motor.misjudged * rng.normal(size=6), np.repeat(motor.unseen, 3) * rng.normal(size=6)
    return left + (left * share + floor) / np.sqrt(looks)


def stroke_along(
    T_gizmo: Array, offset: Array, width: Array, motor: MotorModel, rng: np.random.Generator
) -> Stroke:
    """Drag the one arrow or arc along or about which the gizmo seems farthest off, in units of `width`.

    Args:
        T_gizmo: (4, 4), where the gizmo is, in the world.
        offset: (6,), how far off it seems along and about its axes.
        width: (2,), of what is aimed at, metres and radians.
        motor: Who drags.
        rng: Of where the movement ends.
    """
    target = np.repeat(width, 3)
    axis = int(np.abs(offset / target).argmax())
    movement = motor.fitts_a + motor.fitts_b * float(np.log2(abs(offset[axis]) / target[axis] + 1.0))
    end = offset[axis] + target[axis] / DEVIATIONS_ACROSS * rng.normal()
    seconds = np.append(np.arange(1, np.ceil(movement * UPDATES_PER_SECOND)) / UPDATES_PER_SECOND, movement)
    twists = end * _minimum_jerk(seconds / movement)[:, None] * np.eye(6)[axis]
    reach = motor.decide + motor.point + PRESS
    return Stroke(reach, seconds, np.array([T_gizmo @ pose.exp(twist) for twist in twists]))


def next_stroke(
    T_gizmo: Array,
    T_wanted: Array,
    rng: np.random.Generator,
    motor: MotorModel = EXPERT,
    width: Array = CLOSE,
) -> Stroke:
    """Look once, and drag."""
    return stroke_along(T_gizmo, seen_offset(T_gizmo, T_wanted, motor, rng), width, motor, rng)


def _minimum_jerk(share_of_time: Array) -> Array:
    """Share of the way."""
    return share_of_time**3 * (10.0 - 15.0 * share_of_time + 6.0 * share_of_time**2)
