"""What a registration's log shows at any time: a pure function of its events."""

from bisect import bisect_right
from collections.abc import Sequence
from dataclasses import dataclass
from typing import Any, Generic, Protocol, TypeVar

import numpy as np
from numpy.typing import NDArray

from app.analysis.trace.trace import LoggedEvent, Span, Trace, moves, trace_of
from app.confidence.assessment import Assessment, assessment_in
from app.labeling.moves.history import PosedBy, after, start
from app.labeling.moves.viewpoint import Viewpoint, facing
from app.storage.clock import SIMULATED
from app.storage.tables import Pose

Array = NDArray[np.float64]
Value = TypeVar("Value")

ENDS_AN_OFFER = frozenset({"set_pose", "reset", "dismiss", "snap_requested", "submit"})
"""Kinds of events; undo and redo leave it, and a drag ends it when the object is let go."""


class ShownEvent(LoggedEvent, Protocol):
    """What playing back needs of an event."""

    @property
    def dof(self) -> list[str] | None: ...
    @property
    def detail(self) -> dict[str, Any]: ...


@dataclass(frozen=True)
class Ghost:
    """An estimate that stands in the view: on offer, or where the object was put by it."""

    T_world_object: Array
    confidence: float
    on_offer: bool
    assessment: Assessment | None


@dataclass(frozen=True)
class Moment:
    """What there was to see at one time."""

    T_world_object: Array
    confidence: float | None
    """Of the estimate that the pose stems from; None where a person set it."""
    assessment: Assessment | None
    """What was thought of that estimate."""
    posed_by: PosedBy
    frame_id: int
    ghost: Ghost | None
    viewpoint: Viewpoint | None
    """None where no camera was logged."""


class Recording:
    """A registration to be played back.

    Args:
        T_world_object_start: Where the object began (4, 4).
        frame_id: The frame that was shown first.
        events: In their order, up to the submission.
    """

    def __init__(self, T_world_object_start: Pose, frame_id: int, events: Sequence[ShownEvent]) -> None:
        self.events = events
        self.trace: Trace = trace_of(T_world_object_start, events)
        self._frames = _Steps(frame_id)
        self._confidences: _Steps[float | None] = _Steps(None)
        self._assessments: _Steps[Assessment | None] = _Steps(None)
        self._posers: _Steps[PosedBy] = _Steps("start")
        self._ghosts: _Steps[Ghost | None] = _Steps(None)
        cameras: list[tuple[Span, Array]] = []
        history = start(np.array(T_world_object_start))
        for event, span in zip(events, self.trace.spans, strict=True):
            history = after(history, event)
            if event.kind == "frame":
                self._frames.set(span.end, event.detail["frame_id"])
            if event.kind == "view":
                cameras.append((span, _numbers_of(event.detail)))
            if moves(event):
                moved = span.start if event.path else span.end
                self._confidences.set(moved, event.detail.get("confidence"))
                self._assessments.set(moved, assessment_in(event.detail))
                self._posers.set(moved, history.current.posed_by)
            self._note_ghost(event, span)
        self._cameras = _camera_knots(cameras)

    @property
    def is_simulated(self) -> bool:
        """Whether a script took the operator's part, in simulated time."""
        return any(event.boot_id.startswith(SIMULATED) for event in self.events)

    def at(self, seconds: float) -> Moment:
        """What there was to see so long after the first event."""
        return Moment(
            T_world_object=self.trace.motion.at([seconds])[0],
            confidence=self._confidences.at(seconds),
            assessment=self._assessments.at(seconds),
            posed_by=self._posers.at(seconds),
            frame_id=self._frames.at(seconds),
            ghost=self._ghosts.at(seconds),
            viewpoint=self._viewpoint_at(seconds),
        )

    def _note_ghost(self, event: ShownEvent, span: Span) -> None:
        present = self._ghosts.last
        if event.kind in {"snap_offered", "snap_applied", "accept"}:
            T, confidence = np.array(event.T_after), float(event.detail["confidence"])
            offered = event.kind == "snap_offered"
            self._ghosts.set(span.end, Ghost(T, confidence, offered, assessment_in(event.detail)))
        elif present is None:
            return
        elif event.kind == "drag":  # an offer stands until the drag ends, what the object left does not
            self._ghosts.set(span.end if present.on_offer else span.start, None)
        elif event.kind in ENDS_AN_OFFER if present.on_offer else moves(event):
            self._ghosts.set(span.end, None)

    def _viewpoint_at(self, seconds: float) -> Viewpoint | None:
        if self._cameras is None:
            return None
        times, rows = self._cameras
        numbers = np.array([np.interp(seconds, times, column) for column in rows.T])
        position, target, up, fov = numbers[:3], numbers[3:6], numbers[6:9], float(numbers[9])
        as_seen = Viewpoint(np.eye(4), 1.0, up, field_of_view=fov, aspect=1.0)
        return facing(as_seen, target, position - target, up, float(np.linalg.norm(position - target)))


class _Steps(Generic[Value]):
    """A value that changes at certain times; times are told in their order."""

    def __init__(self, first: Value) -> None:
        self._times = [-np.inf]
        self._values = [first]

    @property
    def last(self) -> Value:
        """What was set last."""
        return self._values[-1]

    def set(self, seconds: float, value: Value) -> None:
        """From then on it is this."""
        self._times.append(max(seconds, self._times[-1]))
        self._values.append(value)

    def at(self, seconds: float) -> Value:
        """What it was then."""
        return self._values[bisect_right(self._times, seconds) - 1]


def _numbers_of(camera: dict[str, Any]) -> Array:
    return np.array([*camera["position"], *camera["look_at"], *camera["up"], camera["fov"]])


def _camera_knots(cameras: Sequence[tuple[Span, Array]]) -> tuple[Array, Array] | None:
    """Times (K,) and numbers (K, 10), between which the camera moves evenly."""
    if not cameras:
        return None
    times, rows = [cameras[0][0].end], [cameras[0][1]]
    for (span, row), (_, before) in zip(cameras[1:], cameras, strict=False):
        times += [max(span.start, times[-1]), span.end]
        rows += [before, row]
    return np.array(times), np.array(rows)
