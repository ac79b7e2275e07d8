"""Simulated operators: a `Hand` that does a study's tasks through the same session as a browser, on a clock
of its own.

For tests and demonstrations only. Whatever they do is marked: their studies and participants are simulated,
and their events come from a run of the server that is named so (`SimulatedClock.boot_id`).
"""

from collections.abc import Callable, Mapping
from dataclasses import dataclass
from datetime import datetime, timedelta
from types import MappingProxyType

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import func, select
from sqlalchemy.orm import joinedload

from app.auth import Actor, Identity, Role
from app.clock import Clock
from app.database import Database
from app.event_log import EventLog
from app.labeling.desk import Desk, Seat
from app.scene_data import SceneData
from app.snapping import Snapper
from app.study.hand import EXPERT, NOVICE, PRESS, Hand, seen_offset, stroke_along
from app.tables import Event, Participant, Registration, Task, Trial, utc_now
from registration_core import pose

Array = NDArray[np.float64]

HANDS: Mapping[str, Hand] = MappingProxyType({"novice": NOVICE, "expert": EXPERT})
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


CARES: Mapping[str, Care] = MappingProxyType(
    {
        "quick": Care((0.008, np.radians(8.0)), looks=1),
        "accurate": Care((0.004, np.radians(4.0)), looks=3),
    }
)
"""By mode."""


class SimulationError(Exception):
    """A study cannot be simulated; the message says why and may be shown."""


class SimulatedClock(Clock):
    """A clock that stands still until somebody says how long something took."""

    def __init__(self, name: str, began: datetime, seconds: float = 0.0) -> None:
        self._name = name
        self._began = began
        self._seconds = seconds

    @property
    def boot_id(self) -> str:
        """Marks what happened as simulated."""
        return f"simulated-{self._name}"

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
class Workplace:
    """What simulated operators work with."""

    database: Database
    data: SceneData
    snapper: Snapper


def simulate(workplace: Workplace, study_id: int, on_done: Callable[[int, int], None]) -> None:
    """Let all simulated participants of a study do what they have not done yet.

    Args:
        workplace: Where the study is.
        study_id: Whose participants.
        on_done: Told how many trials are done, and of how many.

    Raises:
        SimulationError: where one of them cannot; nothing has been done then.
    """
    participants = _participants(workplace.database, study_id)
    for participant in participants:
        _check(participant)
    done, total = 0, sum(len(participant.trials) for participant in participants)
    for number, participant in enumerate(participants):
        clock = _clock_of(workplace.database, participant)
        desk = Desk(
            workplace.database, EventLog(workplace.database, clock), workplace.data, workplace.snapper
        )
        try:
            for trial in participant.trials:
                rng = np.random.default_rng([participant.study.seed, number, trial.place])
                _do_trial(workplace.database, desk, clock, participant, trial, rng)
                done += 1
                on_done(done, total)
        finally:
            desk.close()
        _finish(workplace.database, participant.id)


def register(seat: Seat, clock: SimulatedClock, hand: Hand, care: Care, rng: np.random.Generator) -> None:
    """Drag the object of a session to where it seems to belong, and submit it."""
    session, reference = seat.session, seat.registration.task.T_world_object_reference
    assert reference is not None
    T_object_gizmo = pose.from_rotation_translation(np.eye(3), seat.model.centre)
    twins = np.array(reference) @ seat.model.symmetry_transforms @ T_object_gizmo
    T_wanted = _nearest(twins, session.snapshot().T_world_object @ T_object_gizmo)
    T_wanted = T_wanted @ pose.exp(np.repeat(hand.biased, 3) * rng.normal(size=6))
    width = np.array(care.width)
    clock.advance(FIRST_LOOK)
    for _ in range(MOST_STROKES):
        T_gizmo = session.snapshot().T_world_object @ T_object_gizmo
        clock.advance((care.looks - 1) * hand.decide)
        offset = seen_offset(T_gizmo, T_wanted, hand, rng, care.looks)
        if (np.abs(offset) <= np.repeat(width, 3)).all():
            break
        stroke = stroke_along(T_gizmo, offset, width, hand, rng)
        clock.advance(stroke.reach)
        session.start_drag()
        for seconds, T in zip(np.diff(stroke.seconds_held, prepend=0.0), stroke.path, strict=True):
            clock.advance(float(seconds))
            session.drag_to(T @ pose.inverse(T_object_gizmo))
        session.end_drag()
    clock.advance(hand.decide + hand.point + PRESS)
    session.submit(Actor.SCRIPT)


def _nearest(twins: Array, T: Array) -> Array:
    turns = [pose.distance(T, twin).rotation for twin in twins]
    return twins[int(np.argmin(turns))]


def _participants(database: Database, study_id: int) -> list[Participant]:
    with database.read() as session:
        query = (
            select(Participant)
            .where(
                Participant.study_id == study_id, Participant.is_simulated, Participant.withdrawn_at.is_(None)
            )
            .order_by(Participant.id)
            .options(
                joinedload(Participant.study),
                joinedload(Participant.trials).joinedload(Trial.task).joinedload(Task.object),
            )
        )
        return list(session.scalars(query).unique())


def _check(participant: Participant) -> None:
    if participant.group not in HANDS:
        raise SimulationError(
            f"simulated operators are of the groups {' and '.join(HANDS)}, not {participant.group!r}"
        )
    for trial in participant.trials:
        task = trial.task
        if task.T_world_object_reference is None:
            raise SimulationError(
                f"task {task.id} ({task.object.name}) has no reference pose: a simulated operator would not"
                " know where the object belongs"
            )
        if task.condition != "manual":
            raise SimulationError(
                f"simulated operators work by hand alone: the condition {task.condition!r} needs people"
            )


def _clock_of(database: Database, participant: Participant) -> SimulatedClock:
    """It goes on where it stood when the simulation was interrupted; all participants begin at once."""
    with database.read() as session:
        last = session.scalar(
            select(func.max(Event.monotonic_seconds)).where(Event.user_id == participant.user_id)
        )
    return SimulatedClock(
        f"{participant.study_id}-{participant.id}", participant.study.created_at, last or 0.0
    )


def _do_trial(
    database: Database,
    desk: Desk,
    clock: SimulatedClock,
    participant: Participant,
    trial: Trial,
    rng: np.random.Generator,
) -> None:
    with database.read() as session:
        state = session.scalar(
            select(Registration.state).filter_by(task_id=trial.task_id, user_id=participant.user_id)
        )
    if state not in (None, "open"):
        return
    identity = Identity(participant.user_id, participant.code, Role.OPERATOR, Actor.SCRIPT)
    seat = desk.start(trial.task_id, identity)
    register(seat, clock, HANDS[participant.group], CARES[trial.task.mode], rng)


def _finish(database: Database, participant_id: int) -> None:
    with database.write() as session:
        participant = session.get_one(Participant, participant_id)
        participant.finished_at = participant.finished_at or utc_now()
