"""The replays that people look at: a 3-D view of its own for each person and registration."""

import threading
import time
from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from app.analysis.trace.trace import until_submission
from app.datasets.scene_data import SceneData
from app.labeling.live.sessions import NotFoundError
from app.replay.recording import Moment, Recording
from app.storage.database import Database
from app.storage.event_log import EventLog
from app.storage.registration_rows import whole_registration
from app.storage.tables import Frame, Registration
from app.views3d.frame_view import first_view_of, show_cloud_of
from app.views3d.view import DragHandlers, SceneView
from registration_core import ObjectModel

IDLE_SECONDS = 120
"""A replay that nobody watches and nobody moved for so long is closed."""


@dataclass
class Replay:
    """One person's look at one recording."""

    recording: Recording
    model: ObjectModel
    frames: dict[int, Frame]
    view: SceneView
    watchers: int = 0
    last_used: float = field(default_factory=time.monotonic)
    frame_id: int | None = None
    """The frame whose cloud is shown."""
    lock: threading.Lock = field(default_factory=threading.Lock)


class Replays:
    """Opens replays, moves them to a time, and closes idle ones."""

    def __init__(self, database: Database, log: EventLog, data: SceneData) -> None:
        self._database = database
        self._log = log
        self._data = data
        self._replays: dict[tuple[int, int], Replay] = {}
        self._lock = threading.Lock()

    def recorded(self, registration_id: int) -> tuple[Registration, Recording]:
        """A registration and what its log holds by now.

        Raises:
            NotFoundError: where there is none.
        """
        registration = whole_registration(self._database, registration_id)
        if registration is None:
            raise NotFoundError(f"There is no registration {registration_id}.")
        task, events = registration.task, until_submission(self._log.events(registration_id))
        return registration, Recording(task.T_world_object_start, task.frame_id, events)

    def model(self, registration: Registration) -> ObjectModel:
        """What was registered."""
        return self._data.model(registration.task.object)

    def open(self, registration_id: int, user_id: int) -> Replay:
        """This user's replay, with what the log and the object's symmetries are by now."""
        registration, recording = self.recorded(registration_id)
        with self._lock:
            replay = self._replays.get((registration_id, user_id))
            if replay is None:
                replay = self._make(registration, recording)
                self._replays[registration_id, user_id] = replay
            replay.recording, replay.model = recording, self.model(registration)
        return replay

    def get(self, registration_id: int, user_id: int) -> Replay:
        """This user's replay, opened where it is not."""
        with self._lock:
            replay = self._replays.get((registration_id, user_id))
        return replay or self.open(registration_id, user_id)

    def show(
        self, replay: Replay, seconds: float, follow: bool, frame_id: int | None
    ) -> tuple[Moment, Frame]:
        """Show what there was to see at a time.

        Args:
            replay: Whose view is changed.
            seconds: Since the first event.
            follow: Let the camera stand where the operator's stood.
            frame_id: The frame to show; the operator's where it is None.

        Returns:
            The moment, and the frame that is shown.

        Raises:
            NotFoundError: where the scene has no such frame.
        """
        with replay.lock:
            replay.last_used = time.monotonic()
            moment = replay.recording.at(seconds)
            frame = replay.frames.get(moment.frame_id if frame_id is None else frame_id)
            if frame is None:
                raise NotFoundError(f"Frame {frame_id} does not belong to this scene.")
            if frame.id != replay.frame_id:
                show_cloud_of(replay.view, frame, self._data.cloud(frame))
                replay.frame_id = frame.id
            replay.view.move_object(moment.T_world_object)
            replay.view.show_ghost(moment.ghost.T_world_object if moment.ghost else None)
            if follow and moment.viewpoint is not None:
                replay.view.look(moment.viewpoint)
        return moment, frame

    def watch(self, replay: Replay) -> Callable[[], None]:
        """Keep a replay open until the returned function is called."""
        with self._lock:
            replay.watchers += 1

        def leave() -> None:
            with self._lock:
                replay.watchers -= 1
                replay.last_used = time.monotonic()

        return leave

    def close_idle(self, idle_seconds: float = IDLE_SECONDS) -> int:
        """Close replays that nobody watches and nobody moved lately; returns how many."""
        oldest = time.monotonic() - idle_seconds
        with self._lock:
            idle = [key for key, r in self._replays.items() if r.watchers == 0 and r.last_used <= oldest]
            closed = [self._replays.pop(key) for key in idle]
        for replay in closed:
            replay.view.close()
        return len(closed)

    def close(self) -> None:
        """Close all replays."""
        with self._lock:
            replays, self._replays = list(self._replays.values()), {}
        for replay in replays:
            replay.view.close()

    def _make(self, registration: Registration, recording: Recording) -> Replay:
        task = registration.task
        first_view = first_view_of(task.frame, self._data.depth(task.frame))
        T_start = np.array(task.T_world_object_start)
        model = self.model(registration)
        view = SceneView(model, T_start, first_view, NO_DRAGS, self._data.drawable)
        view.lock_object(True)
        return Replay(recording, model, {frame.id: frame for frame in task.scene.frames}, view)


NO_DRAGS = DragHandlers(lambda: None, lambda T_world_object: None, lambda *broken: None)
"""What a locked object hears of; a page that moves it all the same moves nothing that counts."""
