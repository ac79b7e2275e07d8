"""One simulated operator before one object: a motor model at the session of browsers, on its own clock."""

from collections.abc import Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray

from app.labeling.session import LabelingSession
from app.storage.clock import SIMULATED, Clock
from app.storage.roles import Actor
from app.storage.tables import Mode
from app.study.simulated.motor_model import EXPERT, NOVICE, PRESS, MotorModel, seen_offset, stroke_along
from registration_core.geometry import pose

Array = NDArray[np.float64]

MOTOR_MODELS: Mapping[str, MotorModel] = MappingProxyType({"novice": NOVICE, "expert": EXPERT})
"""By group."""
FIRST_LOOK = 2.0
"""Seconds until an operator begins to think of what to do."""
MOST_STROKES = 60
"""After which an operator lets the object be as it is."""


@dataclass(frozen=True)
class Care:
    """How exact somebody wants to be."""

    width: tuple[float, float]
    """Along and about every axis, metres and radians: what is aimed at, and where it is left at that."""
    looks: int
    """Before each stroke."""


CARES: Mapping[Mode, Care] = MappingProxyType(
    {
        "quick": Care((0.008, np.radians(8.0)), looks=1),
        "accurate": Care((0.004, np.radians(4.0)), looks=3),
    }
)


class SimulatedClock(Clock):
    """A clock that stands still until it is told how long something took.

    Args:
        name: Marks the events of this clock, which is no real one.
        began: What it counts from.
        seconds: Where it stands.
    """

    def __init__(self, name: str, began: datetime, seconds: float = 0.0) -> None:
        self._name = name
        self._began = began
        self._seconds = seconds

    @property
    def boot_id(self) -> str:
        """Marks what happened as simulated."""
        return f"{SIMULATED}{self._name}"

    def monotonic(self) -> float:
        """Simulated seconds."""
        return self._seconds

    def utc(self) -> datetime:
        """The beginning, and the simulated seconds since."""
        return self._began + timedelta(seconds=self._seconds)

    def advance(self, seconds: float) -> None:
        """So long took what somebody did."""
        self._seconds += seconds


@dataclass(frozen=True)
class SimulatedOperator:
    """Somebody at work."""

    motor: MotorModel
    care: Care
    clock: SimulatedClock
    rng: np.random.Generator

    def register(self, session: LabelingSession, pivot: Array, twins: Array) -> None:
        """Drag the object of a session to where it seems to belong, and submit it.

        Args:
            session: Open, with the object anywhere.
            pivot: The gizmo's place (3,) on the object, metres, in the object's frame.
            twins: Poses T_world_object (S, 4, 4) at which the object looks as it should.
        """
        motor, clock = self.motor, self.clock
        T_object_gizmo = pose.from_rotation_translation(np.eye(3), pivot)
        T_gizmo = session.snapshot().T_world_object @ T_object_gizmo
        T_wanted = self._seems_wanted(T_gizmo, twins @ T_object_gizmo)
        width = np.array(self.care.width)
        clock.advance(FIRST_LOOK)
        for _ in range(MOST_STROKES):
            clock.advance((self.care.looks - 1) * motor.decide)
            offset = seen_offset(T_gizmo, T_wanted, motor, self.rng, self.care.looks)
            if (np.abs(offset) <= np.repeat(width, 3)).all():
                break
            stroke = stroke_along(T_gizmo, offset, width, motor, self.rng)
            clock.advance(stroke.reach)
            session.start_drag()
            for seconds, T in zip(np.diff(stroke.seconds_held, prepend=0.0), stroke.path, strict=True):
                clock.advance(float(seconds))
                session.drag_to(T @ pose.inverse(T_object_gizmo))
            session.end_drag()
            T_gizmo = stroke.path[-1]
        clock.advance(motor.decide + motor.point + PRESS)
        session.submit(Actor.SCRIPT)

    def _seems_wanted(self, T_gizmo: Array, twins: Array) -> Array:
        """The twin that takes least turning, as far off as this operator does not see."""
        turns = [pose.distance(T_gizmo, twin).rotation for twin in twins]
        offset = np.repeat(self.motor.biased, 3) * self.rng.normal(size=6)
        return twins[int(np.argmin(turns))] @ pose.exp(offset)
