"""The tasks that a study needs: ordinary rows, hidden from everybody else where only studies ask for them."""

from dataclasses import dataclass

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session, selectinload

from app.datasets.scene_data import SceneData, camera_of
from app.datasets.start_pose import start_pose
from app.labeling.moves.permissions import methods_of
from app.storage.database import Database
from app.storage.tables import Object, Pose, Scene, Task
from app.study.plan import Slot, StudyError, TaskRef


@dataclass(frozen=True)
class Start:
    """Where a thing stands when its registration begins, in all modes and conditions alike."""

    frame_id: int
    T_world_object_start: Pose
    T_world_object_reference: Pose | None


def start_of(database: Database, data: SceneData, ref: TaskRef) -> Start:
    """Where the first task that asks for this thing has it; before what is seen where nobody asked yet.

    Raises:
        StudyError: where there is no such scene or object.
    """
    with database.read() as session:
        scene = session.scalar(
            select(Scene).where(Scene.id == ref.scene_id).options(selectinload(Scene.frames))
        )
        item = session.get(Object, ref.object_id)
        if scene is None:
            raise StudyError(f"there is no scene {ref.scene_id}; choose one of GET /api/scenes")
        if item is None or item.dataset_id != scene.dataset_id:
            raise StudyError(
                f"object {ref.object_id} is none of the dataset of scene {ref.scene_id};"
                f" choose one of GET /api/objects?dataset_id={scene.dataset_id}"
            )
        first = session.scalar(select(Task).filter_by(**ref.model_dump()).order_by(Task.id).limit(1))
    if first is not None:
        return Start(first.frame_id, first.T_world_object_start, first.T_world_object_reference)
    frame = scene.frames[0]
    T_world_camera = np.array(frame.T_world_camera)
    T = start_pose(data.model(item), data.depth(frame), camera_of(frame), T_world_camera)
    return Start(frame.id, T.tolist(), None)


def find_task(session: Session, slot: Slot) -> Task | None:
    """The task of a slot, where it was made."""
    return session.scalar(
        select(Task).filter_by(**slot.task.model_dump(), mode=slot.mode, condition=slot.condition)
    )


def ensure_task(session: Session, slot: Slot, start: Start) -> None:
    """Make the task of a slot where there is none."""
    if find_task(session, slot) is None:
        session.add(
            Task(
                **slot.task.model_dump(),
                mode=slot.mode,
                condition=slot.condition,
                frame_id=start.frame_id,
                T_world_object_start=start.T_world_object_start,
                T_world_object_reference=start.T_world_object_reference,
                is_for_studies=True,
                method=methods_of(slot.condition, in_study=True)[0],
            )
        )
