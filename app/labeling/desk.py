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

from app import __version__
from app.auth import Identity, Role
from app.database import Database
from app.event_log import STATE_AFTER, EventLog, NewEvent
from app.labeling.camera_watch import CameraWatch
from app.labeling.chair import Chair
from app.labeling.coloring import Coloring
from app.labeling.depth_reading import DepthReading, DepthView
from app.labeling.frame_view import first_view_of, show_cloud_of
from app.labeling.history import replay
from app.labeling.layers import Layers
from app.labeling.machine import SamePose
from app.labeling.neighbours import Neighbours
from app.labeling.scene_things import things_of_scene
from app.labeling.search import SearchOrder, SearchResult
from app.labeling.session import LabelingSession, SessionState
from app.labeling.snap_exchange import SnapFailure, SnapOrder, SnapResult, SnapStatus
from app.labeling.tools import is_trial
from app.labeling.uncertainty import Uncertainty, uncertainty_of
from app.labeling.view import DragHandlers, SceneView
from app.memory import give_back
from app.registration_rows import whole_registration
from app.scene_data import SceneData, camera_of
from app.snapping import SnapError, Snapper
from app.tables import Condition, EstimateRow, Frame, Registration, Task
from app.worker import JobResult, Proposals, SearchJob, SnapJob
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
    neighbours: Neighbours
    reading: DepthReading
    view: SceneView | None = None
    watchers: int = 0
    """Open pages and streams."""
    viewers: int = 0
    """Open connections of the 3-D view."""
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

    def uncertainty(self, seat: Seat, snap_id: str | None) -> Uncertainty | None:
        """What is not known about a pose that stems from a snap; None where it stems from none.

        None as well where the task is done without knowing that.
        """
        if snap_id is None or "uncertainty" not in seat.session.tools:
            return None
        estimate = self._log.estimate(snap_id)
        if estimate is None:
            return None
        T_world_camera = np.array(seat.frames[estimate.frame_id].T_world_camera)
        return uncertainty_of(estimate, T_world_camera, seat.model.centre)

    def live_search(self, registration_id: int) -> SnapStatus | None:
        """The last search of a registration whose session is live."""
        with self._lock:
            seat = self._seats.get(registration_id)
        return seat.session.snapshot().search if seat else None

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

    def leave(self, user_id: int) -> None:
        """Close the sessions of a user who may not go on."""
        with self._lock:
            theirs = [seat for seat in self._seats.values() if seat.registration.user_id == user_id]
            for seat in theirs:
                del self._seats[seat.registration.id]
        for seat in theirs:
            _close(seat)

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
        neighbours = Neighbours(lambda: things_of_scene(self._database, self._data, registration), self._data)

        def record_event(event: NewEvent, estimate: EstimateRow | None = None) -> None:
            self._log.append(registration.id, registration.user_id, event, estimate)
            if event.kind in STATE_AFTER:
                self._renew_scene(task.scene_id)

        def request_snap(
            order: SnapOrder,
            on_progress: Callable[[float], None],
            on_end: Callable[[SnapResult | SnapFailure], None],
        ) -> Callable[[], None]:
            frame = frames[order.frame_id]
            return self._request_snap(frame, model, neighbours, order, on_progress, on_end)

        def request_search(
            order: SearchOrder,
            on_progress: Callable[[float], None],
            on_end: Callable[[SearchResult | SnapFailure], None],
        ) -> Callable[[], None]:
            frame = frames[order.frame_id]
            return self._request_search(frame, model, neighbours, order, on_progress, on_end)

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
            skip_reason=registration.skip_reason,
            known_objects=lambda: neighbours.known,
            request_search=request_search,
            now=self._log.clock.monotonic,
            in_study=is_trial(registration),
        )

        def depth_view(frame_id: int) -> DepthView:
            frame = frames[frame_id]
            return DepthView(self._data.depth(frame), camera_of(frame), np.array(frame.T_world_camera))

        reading = DepthReading(lambda: self._data.thinned_model(task.object), depth_view)
        return Seat(registration, session, frames, model, neighbours, reading)

    def _renew_scene(self, scene_id: int) -> None:
        """Tell all who work in a scene that something in it was submitted, skipped or reopened."""
        with self._lock:
            seats = [seat for seat in self._seats.values() if seat.registration.task.scene_id == scene_id]
        for seat in seats:
            try:
                seat.neighbours.renew()
            except Exception:  # what happened is on the disk, whoever cannot be told of it
                logger.exception("registration %d was not told of its scene", seat.registration.id)

    def _request_snap(
        self,
        frame: Frame,
        model: ObjectModel,
        neighbours: Neighbours,
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
            explained = neighbours.explained(frame, order.known)
            job = self._job(
                frame, model, order, explained, pose.inverse(T_world_camera) @ order.T_world_object
            )
        except ValueError as error:
            on_end(SnapFailure(f"The snap cannot work on this: {error}."))
            return lambda: None
        priority = LIVE_PRIORITY if order.is_live else 0
        return self._snapper.request(job, model, on_progress, ended, priority)

    def _request_search(
        self,
        frame: Frame,
        model: ObjectModel,
        neighbours: Neighbours,
        order: SearchOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SearchResult | SnapFailure], None],
    ) -> Callable[[], None]:
        def ended(outcome: Proposals | SnapError) -> None:
            if isinstance(outcome, SnapError):
                on_end(SnapFailure(str(outcome)))
            else:
                on_end(SearchResult(outcome.hypotheses, outcome.seconds, __version__, outcome.hardware))

        depth = self._data.depth(frame)
        explained = neighbours.explained(frame, order.known)
        job = SearchJob(
            snap_id=order.search_id,
            topic=self._snapper.topic,
            model_hash=model.content_hash,
            depth=depth if explained is None else np.where(explained, 0.0, depth),
            camera=camera_of(frame),
            config=order.config,
            seed=order.seed,
            region=order.region,
        )
        return self._snapper.request(job, model, on_progress, ended)

    def _job(
        self,
        frame: Frame,
        model: ObjectModel,
        order: SnapOrder,
        explained: np.ndarray | None,
        T_camera_object: np.ndarray,
    ) -> SnapJob:
        camera = camera_of(frame)
        whole = self._data.depth(frame)
        left, top, width, height = region_of_interest(model, camera, T_camera_object, order.config)
        if not whole[top : top + height, left : left + width].any():
            left, top, (height, width) = 0, 0, whole.shape  # nothing near is no error, nothing seen at all is
        rows, columns = slice(top, top + height), slice(left, left + width)
        return SnapJob(
            snap_id=order.snap_id,
            topic="" if order.is_live else self._snapper.topic,
            model_hash=model.content_hash,
            depth=np.ascontiguousarray(whole[rows, columns]),
            camera=camera.cropped(left, top, width, height),
            explained=None if explained is None else np.ascontiguousarray(explained[rows, columns]),
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
        shown = _Shown(view, self._data, seat.frames, lambda snap_id: self.uncertainty(seat, snap_id))
        shown.update(state)
        seat.session.subscribe(shown.update)
        seat.neighbours.subscribe(view.neighbours.show)
        coloring = Coloring(seat.reading, view.show_on_object)
        coloring.update(state)
        seat.session.subscribe(coloring.update)
        return view


class _Shown:
    """Keeps a view in step with its session."""

    def __init__(
        self,
        view: SceneView,
        data: SceneData,
        frames: dict[int, Frame],
        uncertainty: Callable[[str | None], Uncertainty | None],
    ) -> None:
        self._view = view
        self._data = data
        self._frames = frames
        self._uncertainty = uncertainty
        self._frame_id: int | None = None
        self._locked = False
        self._ghost: np.ndarray | None = None
        self._snap_id: str | None = None
        self._layers = Layers()

    def update(self, state: SessionState) -> None:
        """Draw what changed."""
        if state.frame_id != self._frame_id:
            self._frame_id = state.frame_id
            frame = self._frames[state.frame_id]
            show_cloud_of(self._view, frame, self._data.cloud(frame))
        if not state.dragging:
            self._view.move_object(state.T_world_object, state.gizmo_axes)
        offer = state.live or state.offer
        ghost = state.preview if offer is None or state.preview is not None else offer.T_world_object
        if ghost is not self._ghost:
            self._ghost = ghost
            self._view.show_ghost(ghost)
        if state.estimate_snap_id != self._snap_id:
            self._snap_id = state.estimate_snap_id
            self._view.uncertainty.show(self._uncertainty(self._snap_id))
        locked = state.state != "open"
        if locked is not self._locked:
            self._locked = locked
            self._view.lock_object(locked)
        if state.layers != self._layers:
            self._layers = state.layers
            self._view.show_layers(state.layers)


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
