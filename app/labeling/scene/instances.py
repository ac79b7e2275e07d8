"""The things that a scene's tasks ask for: how far the work on each is, and where it is if that is done."""

from collections import defaultdict
from collections.abc import Sequence
from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import selectinload

from app.datasets.scene_data import SceneData
from app.labeling.scene.known_object import KnownObject
from app.storage.database import Database
from app.storage.registration_rows import is_trial
from app.storage.tables import ENDED_BY, NAMED, OUTSIDE_STUDIES, Registration, Task

COLORS = ("#2fb98a", "#f2e35e", "#cf7fbb", "#d3d7dc", "#8f7cf0", "#a5843c")
"""They differ in lightness, for those who cannot tell hues, and none is the human's or the machine's."""


@dataclass(frozen=True, eq=False)
class SceneInstance:
    """One instance of an object in a scene."""

    task_id: int
    name: str
    """With its number, where the object is there several times."""
    is_current: bool
    """Whether it is what the operator works on."""
    state: str
    """open, submitted or skipped."""
    skip_reason: str | None
    color: str
    """Of its mesh in the 3-D view, #rrggbb."""
    known: KnownObject | None
    """Where it is, if it is submitted."""


def instances_of_scene(
    database: Database, data: SceneData, registration: Registration
) -> tuple[SceneInstance, ...]:
    """What is asked for in a registration's scene, in the order of the tasks.

    A participant of a study knows only of the thing that is asked for, and nobody knows of what studies do.
    Of tasks for one and the same thing, in other modes or conditions, one stands for all. How far it is says
    the operator's own registration, if it is done, else the newest that anybody submitted.
    """
    own = registration.task
    groups = defaultdict(list)
    for task in _tasks(database, registration):
        groups[task.object_id, task.instance].append(task)
    return tuple(
        _thing(tasks, own, registration.user_id, COLORS[index % len(COLORS)], data)
        for index, tasks in enumerate(groups.values())
    )


def _tasks(database: Database, registration: Registration) -> Sequence[Task]:
    own = registration.task
    if is_trial(registration):
        wanted, counted = Task.id == own.id, Registration.id == registration.id
    else:
        wanted, counted = (Task.scene_id == own.scene_id) & ~Task.is_for_studies, OUTSIDE_STUDIES
    with database.read() as session:
        return session.scalars(
            select(Task)
            .where(wanted)
            .options(
                *NAMED,
                selectinload(Task.registrations.and_(counted)).options(ENDED_BY),
            )
            .order_by(Task.id)
        ).all()


def _thing(tasks: list[Task], own: Task, user_id: int, color: str, data: SceneData) -> SceneInstance:
    task = min(tasks, key=lambda t: (t.id != own.id, t.mode != own.mode, t.condition != own.condition, t.id))
    done = _newest([r for t in tasks for r in t.registrations if r.state != "open"], user_id)
    is_current = task.id == own.id
    known = None
    if done is not None and done.T_world_object is not None and not is_current:
        T_world_object = np.array(done.T_world_object)
        known = KnownObject(done.id, task.object_id, T_world_object, data.model(task.object))
    return SceneInstance(
        task_id=task.id,
        name=task.name,
        is_current=is_current,
        state=done.state if done else "open",
        skip_reason=done.skip_reason if done else None,
        color=color,
        known=known,
    )


def _newest(done: list[Registration], user_id: int) -> Registration | None:
    """Mine goes before others', a pose before none, and the newest before older ones."""
    return max(
        done,
        key=lambda r: (r.user_id == user_id, r.state == "submitted", r.ended_by or 0, r.id),
        default=None,
    )
