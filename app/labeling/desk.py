"""The live labelling sessions of this server, opened from the log and closed when idle."""

import logging
import threading
import time
from collections.abc import Callable
from pathlib import Path
from typing import cast

import numpy as np
from sqlalchemy import select

from app.auth import Identity, Role
from app.database import Database
from app.event_log import STATE_AFTER, ErasedError, EventLog, NewEvent
from app.labeling.depth_reading import DepthReading, DepthView
from app.labeling.dispatch import Dispatch
from app.labeling.history import replay
from app.labeling.live_view import view_of
from app.labeling.neighbours import Neighbours
from app.labeling.scene_things import things_of_scene
from app.labeling.seat import Seat
from app.labeling.session import LabelingSession
from app.labeling.session_object import SessionObject
from app.labeling.session_state import SessionState
from app.labeling.snap_frames import FramesOfScene
from app.labeling.tools import is_trial
from app.labeling.uncertainty import Uncertainty, uncertainty_of
from app.registration_rows import whole_registration
from app.scene_data import SceneData, camera_of
from app.snapping import Snapper
from app.standards import Standards
from app.tables import Condition, EstimateRow, Method, Object, Participant, Registration, Task

logger = logging.getLogger(__name__)

IDLE_SECONDS = 30 * 60
"""A session that nobody looks at and nobody used for so long is closed; its log brings it back."""


class NotFoundError(Exception):
    """There is no such thing, or it is not this user's to see; the message may be shown."""


class Desk:
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
        self._seats: dict[int, Seat] = {}
        self._lock = threading.Lock()

    def start(self, task_id: int, identity: Identity) -> Seat:
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
        return self.seat(registration.id, identity)

    def seat(self, registration_id: int, identity: Identity) -> Seat:
        """The live session of this user's registration, opened from the log where it is not live.

        Raises:
            NotFoundError: where there is none, or it is another user's.
        """
        with self._lock:
            is_live = registration_id in self._seats
        if not is_live:  # a large mesh takes seconds, in which others are not to wait for the lock
            self._data.model(self._owned(registration_id, identity).task.object)
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

    def live_state(self, registration_id: int) -> SessionState | None:
        """What the session of a registration tells; None where it is not live."""
        with self._lock:
            seat = self._seats.get(registration_id)
        return seat.session.snapshot() if seat else None

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
        sides = np.ptp(seat.model.vertices, axis=0)
        return uncertainty_of(estimate, T_world_camera, seat.model.centre, sides)

    def view_socket(self, seat: Seat) -> Path:
        """The socket file of a session's view, which is made where there is none."""
        with seat.lock:
            if seat.view is None:
                seat.view = view_of(seat, self._data, lambda snap_id: self.uncertainty(seat, snap_id))
            return seat.view.socket_path

    def watch(self, seat: Seat) -> Callable[[], None]:
        """Keep a session alive until the returned function is called."""
        with self._lock:
            seat.watchers += 1

        def leave() -> None:
            with self._lock:
                seat.watchers -= 1

        return leave

    def at_work(self) -> frozenset[int]:
        """The registrations that somebody has before them in a page now."""
        with self._lock:
            return frozenset(number for number, seat in self._seats.items() if seat.chair.is_taken)

    def tell_others(self, seat: Seat) -> None:
        """Tell the others who are at a task that somebody came or went."""
        for other in self._others(seat.registration):
            other.session.tell()

    def leave(self, user_id: int) -> None:
        """Close the sessions of a user who may not go on."""
        with self._lock:
            theirs = [seat for seat in self._seats.values() if seat.registration.user_id == user_id]
            for seat in theirs:
                del self._seats[seat.registration.id]
        for seat in theirs:
            _close(seat)

    def renew_object(self, object_id: int) -> None:
        """Let the sessions of an object go on with its present symmetries, and tell them."""
        with self._database.read() as session:
            self._data.model(session.get_one(Object, object_id))  # before the lock, as in `seat`
        with self._lock:
            with self._database.read() as session:
                row = session.get_one(Object, object_id)
            model = self._data.model(row)
            seats = [seat for seat in self._seats.values() if seat.registration.task.object_id == object_id]
            for seat in seats:
                seat.object.renew(model, row.symmetries_version)
        if seats:
            self._snapper.prepare(model)
        for seat in seats:
            seat.session.tell()

    def close_idle(self, idle_seconds: float = IDLE_SECONDS) -> int:
        """Close sessions that nobody watches and nobody used lately; returns how many."""
        oldest = time.monotonic() - idle_seconds
        with self._lock:
            idle = [s for s in self._seats.values() if s.watchers == 0 and s.session.last_used <= oldest]
            for seat in idle:
                del self._seats[seat.registration.id]
        for seat in idle:
            _close(seat)
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
        sought = SessionObject(model, task.object.symmetries_version)
        self._snapper.prepare(model)
        neighbours = Neighbours(lambda: things_of_scene(self._database, self._data, registration), self._data)

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
            there = (other for other in self._others(registration) if other.chair.is_taken)
            return tuple(sorted(other.registration.user.name for other in there))

        return Seat(registration, session, frames, sought, neighbours, reading, textured, names_of_others)

    def _others(self, registration: Registration) -> list[Seat]:
        """The other live sessions of a task; who takes part in a study neither has any nor is one."""
        if is_trial(registration):
            return []
        with self._lock:
            there = [
                seat for seat in self._seats.values() if seat.registration.task_id == registration.task_id
            ]
        return [s for s in there if s.registration.id != registration.id and not is_trial(s.registration)]

    def _renew_scene(self, scene_id: int) -> None:
        """Tell all who work in a scene that something in it was submitted, skipped or reopened."""
        with self._lock:
            seats = [seat for seat in self._seats.values() if seat.registration.task.scene_id == scene_id]
        for seat in seats:
            try:
                seat.neighbours.renew()
            except Exception:  # what happened is on the disk, whoever cannot be told of it
                logger.exception("registration %d was not told of its scene", seat.registration.id)


def _close(seat: Seat) -> None:
    try:
        seat.close()
    except ErasedError:
        pass  # nor is anything of it to be written down
    except Exception:  # the disk is full, perhaps: the others are closed all the same
        logger.exception("registration %d: the end of its session was not written down", seat.registration.id)


def _not_found(registration_id: int) -> NotFoundError:
    return NotFoundError(f"There is no registration {registration_id} of yours.")
