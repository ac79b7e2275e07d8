"""Durable events a second, by the application's own log on a file of its own."""

import time
from collections.abc import Sequence
from concurrent.futures import ThreadPoolExecutor
from pathlib import Path

import numpy as np
from sqlalchemy import func, select

from app.access.auth import Auth
from app.resources import DEMO_SCENES
from app.storage.database import Database
from app.storage.event_log import EventLog, NewEvent
from app.storage.roles import Actor, Role
from app.storage.tables import Event, Registration
from benchmarks.figures import Figure, Target
from benchmarks.scenes import known_tasks
from benchmarks.server import database_of, prepare_state

TITLE = "The log: durable drag events a second (a path of 60 rows each, synced to the disk one by one)"
TARGET = Target(500.0, at_least=True)
PATH_ROWS = 60
"""A drag of three seconds."""


class LostEventsError(Exception):
    """What was written is not there."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """One writer after another, and twenty operators at once."""
    state = folder / "state"
    prepare_state(state, [DEMO_SCENES])
    figures = []
    with database_of(state) as database:
        for threads in (1, 20):
            registrations = _registrations(database, state, threads)
            count = (20 if quick else 2000) // threads
            rate = _events_a_second(database, registrations, count)
            figures.append(Figure(f"{threads} thread{'s' * (threads > 1)}", rate, "events/s", TARGET))
    return figures


def _registrations(database: Database, state: Path, count: int) -> list[Registration]:
    user = Auth(database).create_user(f"writer {count}", Role.OPERATOR)
    task_ids = [task.id for task in known_tasks(state)][:count]
    with database.write() as session:
        rows = [Registration(task_id=task_id, user_id=user.id) for task_id in task_ids]
        session.add_all(rows)
    return rows


def _events_a_second(database: Database, registrations: Sequence[Registration], count: int) -> float:
    log = EventLog(database)
    event = drag_event()

    def write(registration: Registration) -> None:
        for _ in range(count):
            log.append(registration.id, registration.user_id, event)

    with ThreadPoolExecutor(len(registrations)) as pool:
        began = time.perf_counter()
        list(pool.map(write, registrations))
        seconds = time.perf_counter() - began
    ids = [registration.id for registration in registrations]
    with database.read() as session:
        written = session.scalar(select(func.count()).where(Event.registration_id.in_(ids)))
    if written != count * len(registrations):
        raise LostEventsError(f"{count * len(registrations)} events were written, {written} are there")
    return count * len(registrations) / seconds


def drag_event() -> NewEvent:
    """A drag as a session records it."""
    rng = np.random.default_rng(0)
    path = [[0.05 * row, *np.round(rng.normal(size=7), 6).tolist()] for row in range(PATH_ROWS)]
    T = rng.normal(size=(4, 4)).tolist()
    return NewEvent(
        kind="drag",
        actor=Actor.HUMAN,
        T_before=T,
        T_after=T,
        dof=("tx", "rz"),
        path=path,
        duration_seconds=0.05 * PATH_ROWS,
    )
