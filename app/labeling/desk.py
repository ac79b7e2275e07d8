"""The live labelling sessions of this server, opened from the log and closed when idle."""

import logging
import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field
from itertools import product
from typing import cast

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import joinedload

from app import __version__
from app.auth import Identity, Role
from app.database import Database
from app.event_log import EventLog, NewEvent
from app.labeling.camera_watch import CameraWatch
from app.labeling.chair import Chair
from app.labeling.frame_view import first_view_of, show_cloud_of
from app.labeling.history import replay
from app.labeling.machine import SamePose
from app.labeling.session import LabelingSession, SessionState
from app.labeling.snap_exchange import Offer, SnapFailure, SnapOrder, SnapResult, SnapStatus
from app.labeling.view import DragHandlers, SceneView
from app.memory import give_back
from app.scene_data import SceneData, camera_of
from app.snapping import SnapError, Snapper
from app.tables import Condition, EstimateRow, Frame, Registration, Scene, Task
from app.worker import JobResult, SnapJob
from registration_core import ObjectModel, pose
from registration_core.pose_error import mssd
from registration_core.problem import region_of_interest

logger = logging.getLogger(__name__)

IDLE_SECONDS = 30 * 60
"""A session that nobody looks at and nobody used for so long is closed; its log brings it back."""


LIVE_PRIORITY = -1
"""Where workers have to choose, they do what somebody waits for first."""


class NotFoundError(Exception):
    """There is no such thing, or it is not this user's to see; the message may be shown."""


@dataclass
class Seat:
    """One live session with all that belongs to it."""

    registration: Registration
    session: LabelingSession
    frames: dict[int, Frame]
    model: ObjectModel
    view: SceneView | None = None
    watchers: int = 0
    """Open pages and streams."""
    chair: Chair = field(default_factory=Chair)
    lock: threading.Lock = field(default_factory=threading.Lock)


class Desk:
    """Opens sessions and keeps the live ones."""

    def __init__(self, database: Database, log: EventLog, data: SceneData, snapper: Snapper) -> None:
        self._database = database
        self._log = log
        self._data = data
        self._snapper = snapper
        self._seats: dict[int, Seat] = {}
        self._lock = threading.Lock()

    def start(self, task_id: int, identity: Identity) -> Seat:
        """This user's registration of a task: begun, or gone on with.

        Raises:
            NotFoundError: where there is no such task.
        """
        with self._database.write() as session:
            if session.get(Task, task_id) is None:
                raise NotFoundError(f"There is no task {task_id}.")
            registration = session.scalar(
                select(Registration).filter_by(task_id=task_id, user_id=identity.user_id)
            )
            if registration is None:
                registration = Registration(task_id=task_id, user_id=identity.user_id)
                session.add(registration)
                session.flush()
        self._log.append(registration.id, identity.user_id, NewEvent(kind="opened", actor=identity.actor))
        return self.seat(registration.id, identity)

    def seat(self, registration_id: int, identity: Identity) -> Seat:
        """The live session of this user's registration, opened from the log where it is not live.

        Raises:
            NotFoundError: where there is none, or it is another user's.
        """
        with self._lock:
            seat = self._seats.get(registration_id)
            if seat is None:
                seat = self._open(self._owned(registration_id, identity))
                self._seats[registration_id] = seat
        if seat.registration.user_id != identity.user_id:
            raise _not_found(registration_id)
        return seat

    def check_readable(self, registration_id: int, identity: Identity) -> None:
        """Raise `NotFoundError` unless the user may read this registration: its owner, or a reviewer."""
        with self._database.read() as session:
            registration = session.get(Registration, registration_id)
        if registration is None or not (
            registration.user_id == identity.user_id or identity.role.includes(Role.REVIEWER)
        ):
            raise _not_found(registration_id)

    def live_snap(self, registration_id: int) -> SnapStatus | None:
        """The last snap of a registration whose session is live."""
        with self._lock:
            seat = self._seats.get(registration_id)
        return seat.session.snapshot().snap if seat else None

    def view_port(self, seat: Seat) -> int:
        """The loopback port of a session's view, which is made where there is none."""
        with seat.lock:
            if seat.view is None:
                seat.view = self._make_view(seat)
            return seat.view.port

    def watch(self, seat: Seat) -> Callable[[], None]:
        """Keep a session alive until the returned function is called."""
        with self._lock:
            seat.watchers += 1

        def leave() -> None:
            with self._lock:
                seat.watchers -= 1

        return leave

    def close_idle(self, idle_seconds: float = IDLE_SECONDS) -> int:
        """Close sessions that nobody watches and nobody used lately; returns how many."""
        oldest = time.monotonic() - idle_seconds
        with self._lock:
            idle = [s for s in self._seats.values() if s.watchers == 0 and s.session.last_used <= oldest]
            for seat in idle:
                del self._seats[seat.registration.id]
        for seat in idle:
            _close(seat)
        if idle:
            give_back()
        return len(idle)

    def close(self) -> None:
        """Close all sessions."""
        with self._lock:
            seats, self._seats = list(self._seats.values()), {}
        for seat in seats:
            _close(seat)

    def _owned(self, registration_id: int, identity: Identity) -> Registration:
        registration = whole_registration(self._database, registration_id)
        if registration is None or registration.user_id != identity.user_id:
            raise _not_found(registration_id)
        return registration

    def _open(self, registration: Registration) -> Seat:
        task = registration.task
        events = self._log.events(registration.id)
        frames = {frame.id: frame for frame in task.scene.frames}
        frame_id = task.frame_id
        for event in events:
            frame_id = event.detail["frame_id"] if event.kind == "frame" else frame_id
        model = self._data.model(task.object)
        self._snapper.prepare(model)

        def record_event(event: NewEvent, estimate: EstimateRow | None = None) -> None:
            self._log.append(registration.id, registration.user_id, event, estimate)

        def request_snap(
            order: SnapOrder,
            on_progress: Callable[[float], None],
            on_end: Callable[[SnapResult | SnapFailure], None],
        ) -> Callable[[], None]:
            return self._request_snap(frames[order.frame_id], model, order, on_progress, on_end)

        session = LabelingSession(
            registration_id=registration.id,
            history=replay(np.array(task.T_world_object_start), events),
            state=registration.state,
            frame_id=frame_id,
            frame_ids=tuple(frames),
            pivot=model.centre,
            condition=cast(Condition, task.condition),
            same_pose=_same_pose_of(model),
            record_event=record_event,
            request_snap=request_snap,
        )
        return Seat(registration, session, frames, model)

    def _request_snap(
        self,
        frame: Frame,
        model: ObjectModel,
        order: SnapOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SnapResult | SnapFailure], None],
    ) -> Callable[[], None]:
        T_world_camera = np.array(frame.T_world_camera)

        def ended(outcome: JobResult | SnapError) -> None:
            if isinstance(outcome, SnapError):
                on_end(SnapFailure(str(outcome)))
                return
            T_world_object = T_world_camera @ outcome.estimate.T_camera_object
            on_end(SnapResult(outcome.estimate, T_world_object, __version__, outcome.hardware))

        try:
            job = self._job(frame, model, order, pose.inverse(T_world_camera) @ order.T_world_object)
        except ValueError as error:
            on_end(SnapFailure(f"The snap cannot work on this: {error}."))
            return lambda: None
        priority = LIVE_PRIORITY if order.is_live else 0
        return self._snapper.request(job, model, on_progress, ended, priority)

    def _job(
        self, frame: Frame, model: ObjectModel, order: SnapOrder, T_camera_object: np.ndarray
    ) -> SnapJob:
        camera = camera_of(frame)
        whole = self._data.depth(frame)
        left, top, width, height = region_of_interest(model, camera, T_camera_object, order.config)
        depth = whole[top : top + height, left : left + width]
        if not depth.any():  # nothing near the object is no error, a camera that saw nothing is one
            left, top, depth = 0, 0, whole
        return SnapJob(
            snap_id=order.snap_id,
            topic="" if order.is_live else self._snapper.topic,
            model_hash=model.content_hash,
            depth=np.ascontiguousarray(depth),
            camera=camera.cropped(left, top, depth.shape[1], depth.shape[0]),
            T_camera_object=T_camera_object,
            config=order.config,
            seed=order.seed,
            start_spread=order.start_spread,
        )

    def _make_view(self, seat: Seat) -> SceneView:
        state = seat.session.snapshot()
        drag = DragHandlers(seat.session.start_drag, seat.session.drag_to, seat.session.end_drag)
        frame = seat.frames[state.frame_id]
        first_view = first_view_of(frame, self._data.depth(frame))
        view = SceneView(seat.model, state.T_world_object, first_view, drag)
        view.watch_camera(CameraWatch(seat.session.look_from))
        shown = _Shown(view, self._data, seat.frames)
        shown.update(state)
        seat.session.subscribe(shown.update)
        return view


def whole_registration(database: Database, registration_id: int) -> Registration | None:
    """A registration with its task, object, scene and frames."""
    with database.read() as session:
        return session.scalar(
            select(Registration)
            .where(Registration.id == registration_id)
            .options(
                joinedload(Registration.task).joinedload(Task.object),
                joinedload(Registration.task).joinedload(Task.scene).selectinload(Scene.frames),
                joinedload(Registration.task).joinedload(Task.frame),
                joinedload(Registration.user),
            )
        )


class _Shown:
    """Keeps a view in step with its session."""

    def __init__(self, view: SceneView, data: SceneData, frames: dict[int, Frame]) -> None:
        self._view = view
        self._data = data
        self._frames = frames
        self._frame_id: int | None = None
        self._ghost: Offer | None = None

    def update(self, state: SessionState) -> None:
        """Draw what changed."""
        if state.frame_id != self._frame_id:
            self._frame_id = state.frame_id
            frame = self._frames[state.frame_id]
            show_cloud_of(self._view, frame, self._data.cloud(frame))
        if not state.dragging:
            self._view.move_object(state.T_world_object, state.gizmo_axes)
        ghost = state.live or state.offer
        if ghost is not self._ghost:
            self._ghost = ghost
            self._view.show_ghost(ghost.T_world_object if ghost else None)
        if state.state != "open":
            self._view.lock_object()


def _same_pose_of(model: ObjectModel) -> SamePose:
    """Two poses are the same where a snap's confidence calls both right: an MSSD of 5 % of the diameter."""
    sides = zip(model.vertices.min(axis=0), model.vertices.max(axis=0), strict=True)
    corners = np.array(list(product(*sides)))

    def same(T_a: np.ndarray, T_b: np.ndarray) -> bool:
        return mssd(T_a, T_b, corners, model.symmetry_transforms) < 0.05 * model.diameter

    return same


def _close(seat: Seat) -> None:
    seat.session.close()
    with seat.lock:
        if seat.view is not None:
            seat.view.close()


def _not_found(registration_id: int) -> NotFoundError:
    return NotFoundError(f"There is no registration {registration_id} of yours.")
