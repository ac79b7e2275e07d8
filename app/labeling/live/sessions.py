"""The live labelling sessions of this server, opened from the log and closed when idle."""

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import cast

import numpy as np
from sqlalchemy import select

from app.access.auth import Identity
from app.confidence.standards import Standards
from app.confidence.uncertainty import Uncertainty, uncertainty_of
from app.datasets.scene_data import SceneData, camera_of
from app.labeling.live.live_session import LiveSession
from app.labeling.live.session_view import view_of
from app.labeling.moves.history import replay
from app.labeling.scene.depth_reading import DepthReading, DepthView
from app.labeling.scene.instances import instances_of_scene
from app.labeling.scene.neighbours import Neighbours
from app.labeling.session import LabelingSession
from app.labeling.session_state import SessionState
from app.labeling.snaps.session_object import SessionObject
from app.labeling.snaps.snap_frames import FramesOfScene
from app.labeling.snaps.snap_jobs import Dispatch
from app.storage.database import Database
from app.storage.event_log import STATE_AFTER, ErasedError, EventLog, NewEvent
from app.storage.registration_rows import is_trial, whole_registration
from app.storage.roles import Role
from app.storage.tables import Condition, EstimateRow, Method, Object, Participant, Registration, Task
from app.workers.pool import Snapper

logger = logging.getLogger(__name__)

IDLE_SECONDS = 30 * 60
"""A session that nobody looks at and nobody used for so long is closed; its log brings it back."""


class NotFoundError(Exception):
    """There is no such thing, or it is not this user's to see; the message may be shown."""


class LiveSessions:
    """Opens sessions and keeps the live ones.

    Args:
        database, log, data, snapper: What sessions work with.
        standards: What is asked of estimates before the machine may take over.
    """

    def __init__(
        self, database: Database, log: EventLog, data: SceneData, snapper: Snapper, standards: Standards
    ) -> None:
        self._database = database
        self._log = log
        self._data = data
        self._snapper = snapper
        self._standards = standards
        self._sessions: dict[int, LiveSession] = {}
        self._lock = threading.Lock()

    def start(self, task_id: int, identity: Identity) -> LiveSession:
        """This user's registration of a task: begun, or gone on with.

        Raises:
            NotFoundError: where there is no such task, or the user has withdrawn from their study.
        """
        with self._database.write() as session:
            if session.scalar(select(Participant.withdrawn_at).filter_by(user_id=identity.user_id)):
                raise NotFoundError("You have withdrawn from the study.")  # while the request was on its way
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
        return self.open(registration.id, identity)

    def open(self, registration_id: int, identity: Identity) -> LiveSession:
        """The live session of this user's registration, opened from the log where it is not live.

        Raises:
            NotFoundError: where there is none, or it is another user's.
        """
        with self._lock:
            is_live = registration_id in self._sessions
        if not is_live:  # a large mesh takes seconds, in which others are not to wait for the lock
            self._data.model(self._owned(registration_id, identity).task.object)
        with self._lock:
            live_session = self._sessions.get(registration_id)
            if live_session is None:
                live_session = self._open(self._owned(registration_id, identity))
                self._sessions[registration_id] = live_session
        if live_session.registration.user_id != identity.user_id:
            raise _not_found(registration_id)
        return live_session

    def check_readable(self, registration_id: int, identity: Identity) -> None:
        """Raise `NotFoundError` unless the user may read this registration: its owner, or a reviewer."""
        with self._database.read() as session:
            registration = session.get(Registration, registration_id)
        if registration is None or not (
            registration.user_id == identity.user_id or identity.role.includes(Role.REVIEWER)
        ):
            raise _not_found(registration_id)

    def live_state(self, registration_id: int) -> SessionState | None:
        """What the session of a registration tells; None where it is not live."""
        with self._lock:
            live_session = self._sessions.get(registration_id)
        return live_session.session.snapshot() if live_session else None

    def uncertainty(self, live_session: LiveSession, snap_id: str | None) -> Uncertainty | None:
        """What is not known about a pose that stems from a snap; None where it stems from none.

        None as well where the task is done without knowing that.
        """
        if snap_id is None or "uncertainty" not in live_session.session.tools:
            return None
        estimate = self._log.estimate(snap_id)
        if estimate is None:
            return None
        T_world_camera = np.array(live_session.frames[estimate.frame_id].T_world_camera)
        sides = np.ptp(live_session.model.vertices, axis=0)
        return uncertainty_of(estimate, T_world_camera, live_session.model.centre, sides)

    def view_socket(self, live_session: LiveSession) -> Path:
        """The socket file of a session's view, which is made where there is none."""
        with live_session.lock:
            if live_session.view is None:
                live_session.view = view_of(
                    live_session, self._data, lambda snap_id: self.uncertainty(live_session, snap_id)
                )
            return live_session.view.socket_path

    def watch(self, live_session: LiveSession) -> Callable[[], None]:
        """Keep a session alive until the returned function is called."""
        with self._lock:
            live_session.watchers += 1

        def leave() -> None:
            with self._lock:
                live_session.watchers -= 1

        return leave

    def at_work(self) -> frozenset[int]:
        """The registrations that somebody has before them in a page now."""
        with self._lock:
            return frozenset(
                number for number, live_session in self._sessions.items() if live_session.page_lease.is_taken
            )

    def tell_others(self, live_session: LiveSession) -> None:
        """Tell the others who are at a task that somebody came or went."""
        for other in self._others(live_session.registration):
            other.session.tell()

    def leave(self, user_id: int) -> None:
        """Close the sessions of a user who may not go on."""
        with self._lock:
            theirs = [
                live_session
                for live_session in self._sessions.values()
                if live_session.registration.user_id == user_id
            ]
            for live_session in theirs:
                del self._sessions[live_session.registration.id]
        for live_session in theirs:
            _close(live_session)

    def renew_object(self, object_id: int) -> None:
        """Let the sessions of an object go on with its present symmetries, and tell them."""
        with self._database.read() as session:
            self._data.model(session.get_one(Object, object_id))  # before the lock, as in `open`
        with self._lock:
            with self._database.read() as session:
                row = session.get_one(Object, object_id)
            model = self._data.model(row)
            live_sessions = [
                live_session
                for live_session in self._sessions.values()
                if live_session.registration.task.object_id == object_id
            ]
            for live_session in live_sessions:
                live_session.object.renew(model, row.symmetries_version)
        if live_sessions:
            self._snapper.prepare(model)
        for live_session in live_sessions:
            live_session.session.tell()

    def close_idle(self, idle_seconds: float = IDLE_SECONDS) -> int:
        """Close sessions that nobody watches and nobody used lately; returns how many."""
        oldest = time.monotonic() - idle_seconds
        with self._lock:
            idle = [s for s in self._sessions.values() if s.watchers == 0 and s.session.last_used <= oldest]
            for live_session in idle:
                del self._sessions[live_session.registration.id]
        for live_session in idle:
            _close(live_session)
        return len(idle)

    def close(self) -> None:
        """Close all sessions."""
        with self._lock:
            live_sessions, self._sessions = list(self._sessions.values()), {}
        for live_session in live_sessions:
            _close(live_session)

    def _owned(self, registration_id: int, identity: Identity) -> Registration:
        registration = whole_registration(self._database, registration_id)
        if registration is None or registration.user_id != identity.user_id:
            raise _not_found(registration_id)
        return registration

    def _open(self, registration: Registration) -> LiveSession:
        task = registration.task
        events = self._log.events(registration.id)
        frames = {frame.id: frame for frame in task.scene.frames}
        frame_id = task.frame_id
        for event in events:
            frame_id = event.detail["frame_id"] if event.kind == "frame" else frame_id
        model = self._data.model(task.object)
        sought = SessionObject(model, task.object.symmetries_version)
        self._snapper.prepare(model)
        neighbours = Neighbours(
            lambda: instances_of_scene(self._database, self._data, registration), self._data
        )

        def record_event(event: NewEvent, estimate: EstimateRow | None = None) -> None:
            self._log.append(registration.id, registration.user_id, event, estimate)
            if event.kind in STATE_AFTER:
                self._renew_scene(task.scene_id)

        scene_frames = FramesOfScene(self._data, frames, task.object)
        dataset_id = task.scene.dataset_id
        dispatch = Dispatch(
            self._snapper, self._data, frames, sought, neighbours, lambda: self._standards.of(dataset_id)
        )
        session = LabelingSession(
            registration_id=registration.id,
            history=replay(np.array(task.T_world_object_start), events),
            state=registration.state,
            frame_id=frame_id,
            frame_ids=tuple(frames),
            pivot=model.centre,
            condition=cast(Condition, task.condition),
            same_pose=sought.same_pose,
            record_event=record_event,
            request_snap=dispatch.snap,
            skip_reason=registration.skip_reason,
            known_objects=lambda: neighbours.known,
            request_search=dispatch.search,
            choose_frames=scene_frames.choose,
            now=self._log.clock.monotonic,
            in_study=is_trial(registration),
            method=cast(Method, task.method),
        )

        def depth_view(frame_id: int) -> DepthView:
            frame = frames[frame_id]
            return DepthView(self._data.depth(frame), camera_of(frame), np.array(frame.T_world_camera))

        reading = DepthReading(lambda: self._data.thinned_model(task.object), depth_view)
        textured = self._data.textured(task.object)

        def names_of_others() -> tuple[str, ...]:
            there = (other for other in self._others(registration) if other.page_lease.is_taken)
            return tuple(sorted(other.registration.user.name for other in there))

        return LiveSession(
            registration, session, frames, sought, neighbours, reading, textured, names_of_others
        )

    def _others(self, registration: Registration) -> list[LiveSession]:
        """The other live sessions of a task; who takes part in a study neither has any nor is one."""
        if is_trial(registration):
            return []
        with self._lock:
            there = [
                live_session
                for live_session in self._sessions.values()
                if live_session.registration.task_id == registration.task_id
            ]
        return [s for s in there if s.registration.id != registration.id and not is_trial(s.registration)]

    def _renew_scene(self, scene_id: int) -> None:
        """Tell all who work in a scene that something in it was submitted, skipped or reopened."""
        with self._lock:
            live_sessions = [
                live_session
                for live_session in self._sessions.values()
                if live_session.registration.task.scene_id == scene_id
            ]
        for live_session in live_sessions:
            try:
                live_session.neighbours.renew()
            except Exception:  # what happened is on the disk, whoever cannot be told of it
                logger.exception("registration %d was not told of its scene", live_session.registration.id)


def _close(live_session: LiveSession) -> None:
    try:
        live_session.close()
    except ErasedError:
        pass  # nor is anything of it to be written down
    except Exception:  # the disk is full, perhaps: the others are closed all the same
        logger.exception(
            "registration %d: the end of its session was not written down", live_session.registration.id
        )


def _not_found(registration_id: int) -> NotFoundError:
    return NotFoundError(f"There is no registration {registration_id} of yours.")
