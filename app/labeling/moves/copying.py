"""Poses that can be copied into a registration: of its neighbours in the video, and of other operators.

An image without a camera pose is a scene of its own. Its neighbours are the other such images of the same BOP
scene: a pose is copied between them in the axes of the camera.
"""

from collections.abc import Iterator
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray
from sqlalchemy import ColumnElement, Select, func, select
from sqlalchemy.orm import joinedload

from app.access.auth import Identity
from app.labeling.moves.history import PosedBy, Step, replay
from app.storage.database import Database
from app.storage.event_log import EventLog
from app.storage.roles import Role
from app.storage.tables import NAMED, OUTSIDE_STUDIES, Frame, Registration, Scene, Task
from registration_core.geometry import pose

MOST_COPIES = 20
"""Nearest neighbours first."""


@dataclass(frozen=True)
class Copy:
    """A pose that can be copied."""

    source: Registration
    T_world_object: NDArray[np.float64]
    """(4, 4), in the world that it is copied into."""
    confidence: float | None
    """Of the estimate that the pose stems from; None where a person set it."""
    posed_by: PosedBy
    is_neighbour: bool
    """Whether it comes from another frame, not from another operator."""


def copies_for(
    registration: Registration, identity: Identity, database: Database, log: EventLog
) -> Iterator[Copy]:
    """What this user may copy into their registration, other operators' poses first.

    Others' poses can be copied once they are submitted, but not into a task without a machine, where
    everybody works alone: there, nothing comes from a task with a machine either. Reviewers may copy any.
    Nothing comes from a study: what its participants do is theirs alone.
    """
    task = registration.task
    same_task = _registrations(identity, task).where(
        Registration.task_id == task.id, Registration.id != registration.id
    )
    with database.read() as session:
        colleagues = session.scalars(same_task.order_by(Registration.id).limit(MOST_COPIES)).all()
        neighbours = [] if task.frame.posed else session.scalars(_neighbours(identity, task)).unique().all()
    for source in colleagues:
        if (now := _pose_now(source, log)) is not None:
            yield Copy(source, now.T_world_object, now.confidence, now.posed_by, is_neighbour=False)
    for source in neighbours:
        if (now := _pose_now(source, log)) is not None:
            T_camera_object = pose.inverse(np.array(source.task.frame.T_world_camera)) @ now.T_world_object
            T_world_object = np.array(task.frame.T_world_camera) @ T_camera_object
            yield Copy(source, T_world_object, now.confidence, now.posed_by, is_neighbour=True)


def _registrations(identity: Identity, task: Task) -> Select[Registration]:
    query = select(Registration).options(
        joinedload(Registration.user),
        joinedload(Registration.task).options(*NAMED),
        joinedload(Registration.task).joinedload(Task.frame),
        joinedload(Registration.task).joinedload(Task.scene),
    )
    return query.where(_may_copy(identity, task), OUTSIDE_STUDIES)


def _may_copy(identity: Identity, task: Task) -> ColumnElement[bool]:
    if identity.role.includes(Role.REVIEWER):
        return Registration.id.is_not(None)
    mine = Registration.user_id == identity.user_id
    return mine if task.condition == "manual" else mine | (Registration.state == "submitted")


def _neighbours(identity: Identity, task: Task) -> Select[Registration]:
    scene = task.scene
    query = (
        _registrations(identity, task)
        .join(Registration.task)
        .join(Task.scene)
        .join(Task.frame)
        .where(
            Task.object_id == task.object_id,
            Scene.dataset_id == scene.dataset_id,
            Scene.split == scene.split,
            Scene.bop_scene_id == scene.bop_scene_id,
            Scene.id != scene.id,
            Frame.posed.is_(False),
        )
        .order_by(func.abs(Frame.image_id - task.frame.image_id), Registration.id)
        .limit(MOST_COPIES)
    )
    return query.where(Task.condition == "manual") if task.condition == "manual" else query


def _pose_now(registration: Registration, log: EventLog) -> Step | None:
    """None where nobody has moved the object, nor said that it is right as it is."""
    history = replay(np.array(registration.task.T_world_object_start), log.events(registration.id))
    return history.current if history.can_undo or registration.state == "submitted" else None
