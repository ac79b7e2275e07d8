"""A million log events turned into the report of a study."""

import resource
import time
from collections.abc import Iterator, Sequence
from concurrent.futures import ProcessPoolExecutor
from datetime import timedelta
from multiprocessing import get_context
from pathlib import Path
from typing import Any, NamedTuple

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import insert, update
from sqlalchemy.orm import Session

from app.access.auth import Auth
from app.analysis.report.report import study_report
from app.resources import DEMO_SCENES
from app.storage.database import Database
from app.storage.roles import Role
from app.storage.tables import Event, Participant, Registration, Study, Task, Trial, User, utc_now
from benchmarks.figures import Figure, Target
from benchmarks.scenes import known_tasks
from benchmarks.server import database_of, prepare_state
from registration_core.geometry import pose

Array = NDArray[np.float64]

TITLE = "A log turned into curves: drags at 20 Hz, views, idle stretches"
SECONDS, MEGABYTES = Target(30.0), Target(2000.0)
EVENTS, QUICK_EVENTS = 1_000_000, 4_000
EVENTS_A_TRIAL = 200
TRIALS_AN_OPERATOR = 8
DRAG_SECONDS, HERTZ = 1.2, 20.0
SECONDS_BETWEEN = 2.0
"""From the start of one event to that of the next."""


class Measured(NamedTuple):
    """What it took to make a report."""

    trials: int
    seconds: float
    megabytes: float
    """Of the process at its most."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """Write the log, then make the report of it in a process of its own."""
    state = folder / "state"
    prepare_state(state, [DEMO_SCENES])
    events = QUICK_EVENTS if quick else EVENTS
    trials = events // EVENTS_A_TRIAL
    with database_of(state) as database:
        task_ids = [task.id for task in known_tasks(state)][:TRIALS_AN_OPERATOR]
        study_id = _write_study(database, task_ids, trials)
    with ProcessPoolExecutor(1, get_context("spawn")) as alone:
        measured = alone.submit(_measure, state, study_id).result()
    assert measured.trials == trials
    return [
        Figure("events", events, "events"),
        Figure("to curves", measured.seconds, "s", None if quick else SECONDS),
        Figure("memory at its most", measured.megabytes, "MB", None if quick else MEGABYTES),
    ]


def _measure(state: Path, study_id: int) -> Measured:
    with database_of(state) as database:
        began = time.perf_counter()
        report = study_report(database, study_id)
        seconds = time.perf_counter() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    return Measured(len(report.collected.trials), seconds, peak)


def _write_study(database: Database, task_ids: Sequence[int], trials: int) -> int:
    """A study of accurate trials by hand, by as many operators as it takes; its id."""
    researcher = Auth(database).create_user("researcher", Role.ADMIN)
    with database.write() as session:
        study = Study(name="a million", plan={}, seed=0, user_id=researcher.id, is_simulated=True)
        session.add(study)
        session.execute(update(Task).where(Task.id.in_(task_ids)).values(condition="manual"))
    for number in range(-(-trials // len(task_ids))):
        _write_operator(database, study.id, number, task_ids[: trials - number * len(task_ids)])
    return study.id


def _write_operator(database: Database, study_id: int, number: int, task_ids: Sequence[int]) -> None:
    with database.write() as session:
        user = User(name=f"operator {number}", role=Role.PARTICIPANT)
        session.add(user)
        session.flush()
        who = Participant(
            study_id=study_id, user_id=user.id, code=f"P{number:04d}", group="novice", row=number
        )
        session.add(who)
        session.flush()
        for place, task_id in enumerate(task_ids):
            session.add(Trial(participant_id=who.id, place=place, task_id=task_id, is_practice=False))
            task = session.get_one(Task, task_id)
            _write_trial(session, task, user.id, np.random.default_rng([number, place]))


def _write_trial(session: Session, task: Task, user_id: int, rng: np.random.Generator) -> None:
    T_end = np.array(task.T_world_object_reference) @ pose.exp(0.002 * rng.normal(size=6))
    registration = Registration(
        task_id=task.id,
        user_id=user_id,
        state="submitted",
        T_world_object=T_end.tolist(),
        submitted_at=utc_now(),
    )
    session.add(registration)
    session.flush()
    rows = _rows(np.array(task.T_world_object_start), T_end, rng)
    session.execute(
        insert(Event), [row | {"registration_id": registration.id, "user_id": user_id} for row in rows]
    )


def _rows(T_start: Array, T_end: Array, rng: np.random.Generator) -> Iterator[dict[str, Any]]:
    """Drags that each go half of what is left of the way, with views between, up to the submission."""
    noon, T = utc_now(), T_start
    for sequence in range(1, EVENTS_A_TRIAL + 1):
        seconds = SECONDS_BETWEEN * sequence
        row: dict[str, Any] = {
            "sequence": sequence,
            "actor": "human",
            "utc": noon + timedelta(seconds=seconds),
            "monotonic_seconds": seconds,
            "boot_id": "of the benchmark",
            "kind": "view",
            "duration_seconds": 0.5,
            "T_after": None,
            "path": None,
            "detail": {"position": [0, 0, 1], "look_at": [0, 0, 0], "up": [0, 1, 0], "fov": 0.8},
        }
        if sequence == EVENTS_A_TRIAL:
            row |= {"kind": "submit", "T_after": T_end.tolist(), "duration_seconds": None, "detail": {}}
        elif sequence % 2 == 0:
            twist = pose.log(pose.inverse(T) @ T_end) * rng.uniform(0.0, 0.2)
            T = T @ pose.exp(twist)
            row |= {
                "kind": "drag",
                "duration_seconds": DRAG_SECONDS,
                "T_after": T.tolist(),
                "path": _path(T, rng),
                "detail": {"axes": "object"},
            }
        yield row


def _path(T: Array, rng: np.random.Generator) -> list[list[float]]:
    """Rows of a drag at 20 Hz that trembles about its end."""
    times = np.arange(0.0, DRAG_SECONDS, 1.0 / HERTZ)
    places = T[:3, 3] + 0.001 * rng.normal(size=(len(times), 3))
    turns = np.tile([1.0, 0.0, 0.0, 0.0], (len(times), 1))
    return np.round(np.column_stack([times, places, turns]), 6).tolist()
