"""Studies put into a database by hand, event by event."""

from collections.abc import Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session

from app.storage.database import Database
from app.storage.tables import (
    Event,
    Frame,
    Object,
    OfflineSnap,
    Participant,
    Registration,
    Scene,
    Study,
    Task,
    Trial,
    User,
)
from app.study.plan import StudyPlan, TaskRef
from registration_core import ALGORITHM
from tests.app.analysis.hand_made import NOON, Entry, at, moved, view

START = at(0.1, 1.0)
"""Where the object of every task begins: 0.1 m and 1 rad off the world's origin, which is about the truth."""


class HandMadeStudy:
    """A study on the first scene and object of a database with an imported dataset."""

    def __init__(
        self, database: Database, name: str = "a study", groups: Mapping[str, int] | None = None
    ) -> None:
        self.database = database
        plan = StudyPlan(tasks=[TaskRef(scene_id=1, object_id=1)]).model_dump(mode="json")
        plan["groups"] = dict(groups or {})
        with database.write() as session:
            admin = User(name=f"researcher of {name}", role="admin")
            session.add(admin)
            session.flush()
            study = Study(name=name, plan=plan, seed=1, user_id=admin.id)
            session.add(study)
            session.flush()
            self.id = study.id

    def participant(self, code: str, group: str = "novice", **more: Any) -> Participant:
        """Somebody new."""
        with self.database.write() as session:
            user = User(name=f"{self.id} {code}", role="participant")
            session.add(user)
            session.flush()
            row = Participant(study_id=self.id, user_id=user.id, code=code, group=group, row=0, **more)
            session.add(row)
        return row

    def trial(
        self,
        participant: Participant,
        entries: Sequence[Entry],
        mode: str = "accurate",
        condition: str = "manual",
        state: str | None = "submitted",
        instance: int = 90,
        reference: np.ndarray | None = None,
        is_practice: bool = False,
        skip_sequence: int = 0,
    ) -> int | None:
        """A trial of a task that is made where it is not there; the id of its registration.

        Args:
            participant: Whose.
            entries: Of the log.
            mode: Of the task.
            condition: Of the task.
            state: Of the registration; None for a trial that was not begun.
            instance: Of the task; one that imported tasks do not have.
            reference: T_world_object (4, 4) of the task, where it is to have one.
            is_practice: Whether it counts.
            skip_sequence: A sequence number that is missing in the log.
        """
        with self.database.write() as session:
            task = task_of(session, instance, mode, condition, reference)
            places = select(Trial).where(Trial.participant_id == participant.id)
            session.add(
                Trial(
                    participant_id=participant.id,
                    place=len(session.scalars(places).all()),
                    task_id=task.id,
                    is_practice=is_practice,
                )
            )
            if state is None:
                return None
            return write_log(session, task, participant.user_id, entries, state, skip_sequence)

    def snaps(
        self,
        registration_id: int,
        results: Mapping[float, np.ndarray | None],
        algorithm: str | None = ALGORITHM,
        method: str = "default",
    ) -> None:
        """Offline snaps by seconds of the trace; None is one that failed."""
        with self.database.write() as session:
            session.add_all(
                OfflineSnap(
                    registration_id=registration_id,
                    seconds=seconds,
                    T_world_object_start=START.tolist(),
                    input_hash=f"{seconds} {algorithm} {method}",
                    method=method,
                    config={},
                    seed=1,
                    T_world_object=None if T is None else T.tolist(),
                    snap_seconds=0.01,
                    evaluations=1,
                    version="0",
                    algorithm=algorithm,
                    hardware="paper",
                )
                for seconds, T in results.items()
            )


def ordinary_work(
    database: Database, name: str, entries: Sequence[Entry], instance: int, state: str = "submitted"
) -> int:
    """A registration that belongs to no study, of a task that nobody else is shown; its id."""
    with database.write() as session:
        user = session.scalars(select(User).where(User.name == name)).first()
        if user is None:
            user = User(name=name, role="operator")
            session.add(user)
            session.flush()
        task = task_of(session, instance, "accurate", "snap")
        return write_log(session, task, user.id, entries, state)


def task_of(
    session: Session, instance: int, mode: str, condition: str, reference: np.ndarray | None = None
) -> Task:
    """A task on the first scene and object, made where it is not there."""
    scene = session.scalars(select(Scene).order_by(Scene.id)).first()
    assert scene is not None
    thing = session.scalars(
        select(Object).where(Object.dataset_id == scene.dataset_id).order_by(Object.id)
    ).first()
    frame = session.scalars(select(Frame).where(Frame.scene_id == scene.id).order_by(Frame.id)).first()
    assert thing is not None and frame is not None
    key = {
        "scene_id": scene.id,
        "object_id": thing.id,
        "instance": instance,
        "mode": mode,
        "condition": condition,
    }
    task = session.scalars(select(Task).filter_by(**key)).first()
    if task is None:
        given = None if reference is None else reference.tolist()
        task = Task(
            **key,
            frame_id=frame.id,
            T_world_object_start=START.tolist(),
            T_world_object_reference=given,
            is_for_studies=True,
        )
        session.add(task)
        session.flush()
    return task


def write_log(
    session: Session,
    task: Task,
    user_id: int,
    entries: Sequence[Entry],
    state: str,
    skip_sequence: int = 0,
) -> int:
    """A registration with its events, but for one that is missing; its id."""
    registration = Registration(
        task_id=task.id,
        user_id=user_id,
        state=state,
        T_world_object=entries[-1].T_after if entries else START.tolist(),
        submitted_at=NOON,
        skip_reason="no depth" if state == "skipped" else None,
    )
    session.add(registration)
    session.flush()
    session.add_all(
        event_of(registration, sequence, entry)
        for sequence, entry in enumerate(entries, start=1)
        if sequence != skip_sequence
    )
    return registration.id


def snapped(seconds: float, name: str, T: np.ndarray, kind: str = "snap_applied") -> Entry:
    """The result of a snap."""
    return moved(seconds, kind, T, actor="machine", snap_id=name, detail={"confidence": 0.9})


def event_of(registration: Registration, sequence: int, entry: Entry) -> Event:
    """A row of the log."""
    return Event(
        registration_id=registration.id,
        user_id=registration.user_id,
        sequence=sequence,
        kind=entry.kind,
        actor=entry.actor,
        utc=entry.utc,
        monotonic_seconds=entry.monotonic_seconds,
        boot_id=entry.boot_id,
        duration_seconds=entry.duration_seconds,
        T_after=entry.T_after,
        dof=entry.dof,
        path=entry.path,
        snap_id=entry.snap_id,
        detail=entry.detail,
    )


def two_moves(half_way: float, end: float, T_end: np.ndarray) -> list[Entry]:
    """Seen after 1 s; moved to 0.05 m at `half_way`, to the end pose at `end`, and submitted there."""
    return [
        Entry(0.0, "opened"),
        view(1.0, 0.0),
        moved(half_way, "set_pose", at(0.05, 0.5)),
        moved(end, "set_pose", T_end),
        moved(end, "submit", T_end),
    ]


def every_half_second(end: float, T: np.ndarray) -> dict[float, np.ndarray | None]:
    """The same result of a snap from each sample of such a log."""
    return {1.0 + 0.5 * i: T for i in range(int(2 * (end - 1.0)) + 1)}
