"""A million log events turned into the report of a study."""

import gc
import resource
import time
from collections.abc import Iterator, Sequence
from datetime import timedelta
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import insert, select

from app.analysis.curves import MARGINS
from app.analysis.report import study_report
from app.auth import Auth, Role
from app.database import Database
from app.tables import Event, Participant, Registration, Study, Task, Trial, User, utc_now
from benchmarks.figures import Figure, Target
from benchmarks.scenes import known_tasks
from benchmarks.server import DEMO_SCENES, database_of, prepare_state
from registration_core import pose

Array = NDArray[np.float64]

TITLE = "A log turned into curves: drags at 20 Hz, views, idle stretches"
SECONDS, MEGABYTES = Target(30.0), Target(2000.0)
EVENTS, QUICK_EVENTS = 1_000_000, 4_000
EVENTS_A_TRIAL = 200
TRIALS_AN_OPERATOR = 8
DRAG_SECONDS, HERTZ = 1.2, 20.0
SECONDS_BETWEEN = 2.0
"""From the start of one event to that of the next."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """Write the log, then read it back as a report; the memory is that of this process at its most."""
    state = folder / "state"
    prepare_state(state, [DEMO_SCENES])
    events = QUICK_EVENTS if quick else EVENTS
    with database_of(state) as database:
        study_id = _write_study(database, [task.id for task in known_tasks(state)], events // EVENTS_A_TRIAL)
        gc.collect()
        began = time.perf_counter()
        report = study_report(database, study_id)
        seconds = time.perf_counter() - began
    peak = resource.getrusage(resource.RUSAGE_SELF).ru_maxrss / 1024
    assert len(report.collected.trials) == events // EVENTS_A_TRIAL
    assert all(len(cell.human.curve.margins) == len(MARGINS[cell.error]) for cell in report.cells)
    return [
        Figure("events", events, "events"),
        Figure("to curves", seconds, "s", None if quick else SECONDS),
        Figure("memory at its most", peak, "MB", None if quick else MEGABYTES),
    ]


def _write_study(database: Database, task_ids: Sequence[int], trials: int) -> int:
    """A study of manual trials, all accurate, by as many operators as it takes."""
    researcher = Auth(database).create_user("researcher", Role.ADMIN)
    with database.write() as session:
        study = Study(name="a million", plan={}, seed=0, user_id=researcher.id, is_simulated=True)
        session.add(study)
        session.flush()
        tasks = session.scalars(select(Task).where(Task.id.in_(task_ids[:TRIALS_AN_OPERATOR]))).all()
        for task in tasks:
            task.condition = "manual"
        for number in range(-(-trials // len(tasks))):
            user = User(name=f"operator {number}", role="participant")
            session.add(user)
            session.flush()
            who = Participant(
                study_id=study.id, user_id=user.id, code=f"P{number:04d}", group="novice", row=number
            )
            session.add(who)
            session.flush()
            for place, task in enumerate(tasks[: trials - number * len(tasks)]):
                session.add(Trial(participant_id=who.id, place=place, task_id=task.id, is_practice=False))
                _write_trial(session, task, user.id, np.random.default_rng([number, place]))
        return study.id


def _write_trial(session: Any, task: Task, user_id: int, rng: np.random.Generator) -> None:
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
