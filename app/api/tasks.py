"""Tasks: what is to be registered, and taking one up."""

from collections.abc import Callable, Collection, Sequence
from dataclasses import dataclass
from typing import Annotated, Any, Literal

import numpy as np
from fastapi import APIRouter, Depends, HTTPException, Response
from pydantic import BaseModel, Field
from sqlalchemy import ColumnElement, Select, select
from sqlalchemy.orm import Session, joinedload, selectinload

from app.access.auth import Identity
from app.api.dependencies import (
    AdminDep,
    AfterDep,
    AnyoneDep,
    Id,
    IdentityDep,
    LimitDep,
    Page,
    QueryId,
    ServicesDep,
    check_sees,
    page_of,
)
from app.api.problems import InputError
from app.api.registration_state import AssessmentOut, RegistrationOut, registration_out
from app.datasets.scene_data import camera_of
from app.datasets.start_pose import start_pose
from app.datasets.thumbnails import task_thumbnail
from app.labeling.moves.permissions import methods_of
from app.services import Services
from app.storage.roles import Role
from app.storage.tables import (
    LAST_ASSESSMENT,
    NAMED,
    OUTSIDE_STUDIES,
    Condition,
    Frame,
    Method,
    Mode,
    Object,
    Registration,
    Scene,
    Task,
)
from app.study.participation import require_turn

router = APIRouter(prefix="/api/tasks", tags=["tasks"])

TaskState = Literal["open", "in_progress", "submitted", "skipped"]


class NewTask(BaseModel):
    """What is asked for."""

    scene_id: int = Field(ge=1, le=2**31 - 1)
    object_id: int = Field(ge=1, le=2**31 - 1)
    mode: Mode = "accurate"
    condition: Condition = "snap"
    method: Method | None = Field(
        None,
        description="What Snap computes with unless the operator chooses; left out, the condition's own.",
    )


class Named(BaseModel):
    """A thing that a task refers to."""

    id: int
    name: str


class SceneRef(BaseModel):
    """The scene of a task."""

    id: int
    label: str


class ObjectRef(BaseModel):
    """The object of a task."""

    id: int
    obj_id: int
    name: str


class OperatorRef(BaseModel):
    """Who works on a task, and how far they are."""

    name: str
    state: str
    skip_reason: str | None
    registration_id: int
    is_here: bool = Field(description="Whether they have the task open in a page now.")
    assessment: AssessmentOut | None = Field(
        description="Of the machine's last estimate, for reviewers; null where there is none."
    )


class TaskOut(BaseModel):
    """An object of a scene that is to be registered."""

    id: int
    dataset: Named
    scene: SceneRef
    object: ObjectRef
    name: str = Field(description="The object's, with a number where it is in the scene several times.")
    instance: int = Field(description="From 0 on: #1 in the name.")
    instances: int
    """How often the object is in this scene, as far as any task says."""
    frame_id: int
    mode: str
    condition: str
    method: str
    """What Snap computes with unless the operator chooses."""
    state: TaskState
    operators: list[OperatorRef]
    mine: int | None
    """My registration's id, where I have begun one."""
    thumbnail_url: str


@dataclass(frozen=True)
class TaskFilter:
    """Which tasks: all, or those of a dataset, a scene, in a state, a mode, under a condition."""

    dataset_id: QueryId = None
    scene_id: QueryId = None
    state: TaskState | None = None
    mode: Mode | None = None
    condition: Condition | None = None


FilterDep = Annotated[TaskFilter, Depends()]


@router.get("")
def list_tasks(
    services: ServicesDep,
    identity: IdentityDep,
    wanted: FilterDep,
    after: AfterDep = 0,
    limit: LimitDep = 100,
) -> Page[TaskOut]:
    """All tasks, or those of a dataset, a scene, in a state, a mode, under a condition."""
    query = _ordinary_tasks(wanted)
    with services.database.read() as session:
        return page_of(session, query, Task.id, after, limit, _out_for(services, identity))


@router.get("/next")
def next_task(services: ServicesDep, identity: IdentityDep, wanted: FilterDep) -> TaskOut:
    """What I should do next, of all tasks or of a dataset, a scene, in a state, a mode, under a condition.

    That is what I have begun, or else what nobody has (in a state: what I have not); 404 where none is left.
    """
    mine = Registration.user_id == identity.user_id
    begun = Task.registrations.any(mine & (Registration.state == "open"))
    fresh = ~Task.registrations.any(mine) & _is_in_state(wanted.state or "open")
    query = _ordinary_tasks(wanted).order_by(Task.id).limit(1)
    with services.database.read() as session:
        for condition in (begun, fresh):
            row = session.scalars(query.where(condition)).unique().first()
            if row is not None:
                return _out_for(services, identity)(row)
    raise HTTPException(404, "All tasks that were asked for are done or in other hands.")


@router.get("/{task_id}")
def get_task(task_id: Id, services: ServicesDep, identity: AnyoneDep) -> TaskOut:
    """One task."""
    check_sees(services, identity, Task.id == task_id, f"task {task_id}")
    with services.database.read() as session:
        return _out_for(services, identity)(_task(session, task_id))


@router.post("", status_code=201)
def create_task(body: NewTask, services: ServicesDep, identity: AdminDep) -> TaskOut:
    """Ask for one more instance of an object in a scene."""
    method = _method(body)
    with services.database.read() as session:
        scene, item = session.get(Scene, body.scene_id), session.get(Object, body.object_id)
        if scene is None:
            raise InputError(f"scene_id {body.scene_id} is no scene; choose one of GET /api/scenes.")
        if item is None or item.dataset_id != scene.dataset_id:
            raise InputError(
                f"object_id {body.object_id} is no object of the scene's dataset;"
                f" choose one of GET /api/objects?dataset_id={scene.dataset_id}."
            )
        frame = scene.frames[0]
    start = _start(services, item, frame)
    with services.database.write() as session:
        key = {
            "scene_id": scene.id,
            "object_id": item.id,
            "mode": body.mode,
            "condition": body.condition,
        }
        same = select(Task.instance).filter_by(**key, is_for_studies=False)
        key["instance"] = max(session.scalars(same), default=-1) + 1
        task = session.scalar(select(Task).filter_by(**key))
        if task is None:
            task = Task(**key, frame_id=frame.id, T_world_object_start=start.tolist())
            session.add(task)
        task.is_for_studies = False
        task.method = method
        session.flush()
        return _out_for(services, identity)(_task(session, task.id))


@router.get("/{task_id}/thumbnail.jpg", response_class=Response)
def get_thumbnail(task_id: Id, services: ServicesDep, _identity: IdentityDep) -> Response:
    """A small picture of the scene and of the object that is asked for."""
    with services.database.read() as session:
        task = _task(session, task_id)
    picture = task_thumbnail(services.data.color(task.frame), services.data.model(task.object))
    return Response(picture, media_type="image/jpeg", headers={"cache-control": "private, max-age=86400"})


@router.post("/{task_id}/registration")
def start_registration(task_id: Id, services: ServicesDep, identity: AnyoneDep) -> RegistrationOut:
    """Begin my registration of this task, or go on with it where I left it.

    A participant of a study may begin only the task that comes next in it.
    """
    check_sees(services, identity, Task.id == task_id, f"task {task_id}")
    if identity.role is Role.PARTICIPANT:
        require_turn(services.database, identity.user_id, task_id)
    return registration_out(services.live_sessions.start(task_id, identity))


def _method(body: NewTask) -> Method:
    """What was asked for, or the condition's own."""
    methods = methods_of(body.condition, in_study=False)
    if body.method is None:
        return methods[0]
    if body.method not in methods:
        raise InputError(
            f"method {body.method!r} does not go with the condition {body.condition!r}; leave the method out,"
            f" or choose the condition 'snap' or 'auto'."
        )
    return body.method


def _start(services: Services, item: Object, frame: Frame) -> Any:
    T_world_camera = np.array(frame.T_world_camera)
    return start_pose(services.data.model(item), services.data.depth(frame), camera_of(frame), T_world_camera)


def _tasks() -> Select[Task]:
    return select(Task).options(
        joinedload(Task.scene).joinedload(Scene.dataset),
        *NAMED,
        joinedload(Task.frame),
        selectinload(Task.registrations).options(joinedload(Registration.user), LAST_ASSESSMENT),
    )


def _ordinary_tasks(wanted: TaskFilter) -> Select[Task]:
    """Those that are asked for, of no study."""
    query = _tasks().where(~Task.is_for_studies)
    if wanted.dataset_id is not None:
        query = query.join(Task.scene).where(Scene.dataset_id == wanted.dataset_id)
    if wanted.scene_id is not None:
        query = query.where(Task.scene_id == wanted.scene_id)
    if wanted.state is not None:
        query = query.where(_is_in_state(wanted.state))
    if wanted.mode is not None:
        query = query.where(Task.mode == wanted.mode)
    if wanted.condition is not None:
        query = query.where(Task.condition == wanted.condition)
    return query


def _task(session: Session, task_id: int) -> Task:
    row = session.scalars(_tasks().where(Task.id == task_id)).unique().first()
    if row is None:
        raise HTTPException(404, f"There is no task {task_id}.")
    return row


def _is_in_state(state: TaskState) -> ColumnElement[bool]:
    """As `_state_of` tells of one task."""
    begun, submitted, in_progress = (
        Task.registrations.any(OUTSIDE_STUDIES),
        Task.registrations.any(OUTSIDE_STUDIES & (Registration.state == "submitted")),
        Task.registrations.any(OUTSIDE_STUDIES & (Registration.state == "open")),
    )
    match state:
        case "submitted":
            return submitted
        case "in_progress":
            return in_progress & ~submitted
        case "skipped":
            return begun & ~in_progress & ~submitted
        case "open":
            return ~begun


def _state_of(registrations: Sequence[Registration]) -> TaskState:
    """What has come furthest counts; skipped is only what everybody who began it skipped."""
    states = {registration.state for registration in registrations}
    if not states:
        return "open"
    return "submitted" if "submitted" in states else "in_progress" if "open" in states else "skipped"


def _out_for(services: Services, identity: Identity) -> Callable[[Task], TaskOut]:
    """As somebody may know of tasks: a participant of a study of their own work, others of the ordinary."""

    at_work = services.live_sessions.at_work()

    def out(row: Task) -> TaskOut:
        mine = [r for r in row.registrations if r.user_id == identity.user_id]
        ordinary = [r for r in row.registrations if r.user.role != Role.PARTICIPANT]
        shown = mine if identity.role is Role.PARTICIPANT else ordinary
        return _out(row, shown, mine, at_work, identity.role.includes(Role.REVIEWER))

    return out


def _out(
    row: Task,
    registrations: Sequence[Registration],
    mine: Sequence[Registration],
    at_work: Collection[int],
    for_reviewers: bool,
) -> TaskOut:
    return TaskOut(
        id=row.id,
        dataset=Named(id=row.scene.dataset.id, name=row.scene.dataset.name),
        scene=SceneRef(id=row.scene.id, label=row.scene.label),
        object=ObjectRef(id=row.object.id, obj_id=row.object.obj_id, name=row.object.name),
        name=row.name,
        instance=row.instance,
        instances=row.instances,
        frame_id=row.frame_id,
        mode=row.mode,
        condition=row.condition,
        method=row.method,
        state=_state_of(registrations),
        operators=[
            OperatorRef(
                name=r.user.name,
                state=r.state,
                skip_reason=r.skip_reason,
                registration_id=r.id,
                is_here=r.id in at_work,
                assessment=AssessmentOut(**r.last_assessment)
                if for_reviewers and r.last_assessment
                else None,
            )
            for r in registrations
        ],
        mine=mine[0].id if mine else None,
        thumbnail_url=f"/api/tasks/{row.id}/thumbnail.jpg",
    )
