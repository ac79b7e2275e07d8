"""The poses that operators passed through, as inputs of offline snaps."""

import hashlib
import json
from collections.abc import Iterator, Sequence
from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from app.analysis.study_data.runs import runs_of
from app.analysis.trace.trace import trace_of, until_submission
from app.storage.database import Database
from app.storage.event_log import EventLog
from app.storage.registration_rows import whole_registration
from app.storage.tables import Event, Frame, Object, Task
from registration_core import ALGORITHM, SnapConfig

Array = NDArray[np.float64]

POSE_DIGITS = 9
"""Decimals of a sampled pose, so that an object that rests is one input, whatever rounding did to it."""


@dataclass(frozen=True, eq=False)
class Sample:
    """A pose in the course of a registration."""

    registration_id: int
    seconds: float
    """Of the trace."""
    T_world_object: Array
    """(4, 4)."""
    view: "SampledView"
    input_hash: str
    """Of all that a snap from there depends on."""

    @property
    def seed(self) -> int:
        """Of the snap: another one for each input, and always the same for it."""
        return int(self.input_hash[:8], 16) >> 1


class SampledView:
    """What snaps of one object in one frame share."""

    def __init__(self, item: Object, frame: Frame, config: SnapConfig) -> None:
        self.object = item
        self.frame = frame
        content = [
            ALGORITHM,
            config.to_dict(),
            [item.mesh_hash, item.mesh_format, item.symmetries],
            [frame.depth_hash, frame.depth_scale, frame.fx, frame.fy, frame.cx, frame.cy],
            frame.color_hash,
            frame.T_world_camera,
        ]
        self._hash = hashlib.sha256(json.dumps(content, sort_keys=True).encode())

    @property
    def key(self) -> tuple[int, int]:
        """Tells views apart."""
        return self.object.id, self.frame.id

    def input_hash(self, T_world_object: Array) -> str:
        """The hash of a snap's input: by content, so that it holds in other databases, too."""
        whole = self._hash.copy()
        whole.update(T_world_object.tobytes())
        return whole.hexdigest()


def registrations_of(database: Database, study_id: int) -> list[int]:
    """The registrations of a study that count."""
    with database.read() as session:
        runs, _ = runs_of(session, study_id)
    return [run.registration.id for run in runs]


def samples_of(database: Database, registration_id: int, config: SnapConfig) -> Iterator[Sample]:
    """The samples of a registration, each with the frame that was shown then."""
    registration = whole_registration(database, registration_id)
    assert registration is not None
    task = registration.task
    events = until_submission(EventLog(database).events(registration_id))
    trace = trace_of(task.T_world_object_start, events)
    times = trace.sample_times()
    poses = np.round(trace.motion.at(times), POSE_DIGITS) + 0.0  # no -0.0, which would be another input
    views = {frame.id: SampledView(task.object, frame, config) for frame in task.scene.frames}
    frames = _frames_at(times, task, events, [span.end for span in trace.spans])
    for seconds, T, frame_id in zip(times.tolist(), poses, frames, strict=True):
        view = views[frame_id]
        yield Sample(registration_id, seconds, T, view, view.input_hash(T))


def _frames_at(times: Array, task: Task, events: Sequence[Event], ends: Sequence[float]) -> list[int]:
    """The frame that was shown at each of the times (M,)."""
    shown = [
        (end, event.detail["frame_id"])
        for end, event in zip(ends, events, strict=True)
        if event.kind == "frame"
    ]
    places = np.searchsorted([end for end, _ in shown], times, side="right")
    return [shown[place - 1][1] if place else task.frame_id for place in places]
