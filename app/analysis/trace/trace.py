"""The trace of a registration: what its log tells of where the object was when, and when nothing happened.

Times are seconds since the first event. Within one run of the server they come from its monotonic clock;
several runs are joined by their UTC.
"""

from collections.abc import Sequence
from dataclasses import dataclass
from datetime import datetime
from typing import Protocol, TypeVar

import numpy as np
from numpy.typing import ArrayLike, NDArray

from app.analysis.trace.motion import Motion, MotionWriter
from app.storage.event_log import STATE_AFTER
from app.storage.roles import Actor

Array = NDArray[np.float64]

IDLE_SECONDS = 10.0
"""So long without input and without a movement of the camera is idle."""
SAMPLE_SECONDS = 0.5
SNAP_ENDS = frozenset({"snap_applied", "snap_offered", "snap_failed", "snap_cancelled"})
"""Kinds of events that a snap ends with; it began when it was requested."""


class LoggedEvent(Protocol):
    """What a trace needs of an event."""

    @property
    def kind(self) -> str: ...
    @property
    def actor(self) -> str: ...
    @property
    def utc(self) -> datetime: ...
    @property
    def monotonic_seconds(self) -> float: ...
    @property
    def boot_id(self) -> str: ...
    @property
    def duration_seconds(self) -> float | None: ...
    @property
    def T_after(self) -> Sequence[Sequence[float]] | None: ...
    @property
    def path(self) -> Sequence[Sequence[float]] | None: ...
    @property
    def snap_id(self) -> str | None: ...


Logged = TypeVar("Logged", bound=LoggedEvent)


@dataclass(frozen=True)
class Span:
    """A stretch of time, seconds."""

    start: float
    end: float


@dataclass(frozen=True)
class Trace:
    """A registration over time, up to its submission or to what was done last."""

    spans: tuple[Span, ...]
    """When each event began and ended; most are over at once."""
    motion: Motion
    """T_world_object over time."""
    idle: tuple[Span, ...]
    first_sight: float
    """When the scene was first seen; 0 where no camera was logged."""

    @property
    def duration(self) -> float:
        """Seconds from the first event to the last one."""
        return self.spans[-1].end if self.spans else 0.0

    @property
    def T_world_object(self) -> Array:
        """The last pose (4, 4)."""
        return self.motion.at([self.duration])[0]

    def sample_times(self, step: float = SAMPLE_SECONDS) -> Array:
        """(M,), every `step` seconds from the first sight, and the end."""
        times = np.arange(self.first_sight, self.duration, step)
        return np.append(times, self.duration)

    def is_idle(self, seconds: ArrayLike) -> NDArray[np.bool_]:
        """Whether each of these times (M,) lies inside of an idle stretch."""
        times = np.asarray(seconds, dtype=np.float64)
        inside = np.zeros(len(times), dtype=np.bool_)
        for span in self.idle:
            inside |= (times > span.start) & (times < span.end)
        return inside

    def idle_before(self, seconds: ArrayLike) -> Array:
        """How many seconds before each of these times (M,), since the first sight, were idle."""
        times = np.asarray(seconds, dtype=np.float64)
        total = np.zeros(len(times))
        for span in self.idle:
            start = max(span.start, self.first_sight)
            total += np.clip(times - start, 0.0, max(0.0, span.end - start))
        return total


def until_submission(events: Sequence[Logged]) -> Sequence[Logged]:
    """The events up to the one that submitted or skipped, unless the registration was reopened since; what a
    page does afterwards is none of it.
    """
    changes = [index for index, event in enumerate(events) if event.kind in STATE_AFTER]
    if not changes or STATE_AFTER[events[changes[-1]].kind] == "open":
        return events
    return events[: changes[-1] + 1]


def trace_of(T_world_object_start: ArrayLike, events: Sequence[LoggedEvent]) -> Trace:
    """The trace that the events of a registration, in their order, amount to.

    Args:
        T_world_object_start: Where the object began (4, 4).
        events: Up to the submission.
    """
    spans = _spans(events)
    writer = MotionWriter(T_world_object_start)
    for event, span in zip(events, spans, strict=True):
        if event.path is not None and event.T_after is not None:
            writer.follow(span.start, event.path, event.T_after)
        elif moves(event):
            assert event.T_after is not None
            writer.jump(span.end, event.T_after)
    seen = (span.start for event, span in zip(events, spans, strict=True) if event.kind == "view")
    return Trace(spans, writer.motion(), _idle(events, spans), next(seen, 0.0))


def moves(event: LoggedEvent) -> bool:
    """Whether the event changes the pose."""
    return event.T_after is not None and event.kind not in {"snap_offered", *STATE_AFTER}


def _spans(events: Sequence[LoggedEvent]) -> tuple[Span, ...]:
    requested: dict[str | None, float] = {}
    spans = []
    for event, end in zip(events, _seconds(events), strict=True):
        start = end - (event.duration_seconds or 0.0)
        if event.kind == "snap_requested":
            requested[event.snap_id] = end
        elif event.kind in SNAP_ENDS:
            start = requested.get(event.snap_id, start)
        spans.append(Span(max(0.0, start), end))
    return tuple(spans)


def _seconds(events: Sequence[LoggedEvent]) -> list[float]:
    """When each event was over; never before the one that was logged before it."""
    seconds: list[float] = []
    first_of_boot = events[0] if events else None
    for event in events:
        assert first_of_boot is not None
        if event.boot_id != first_of_boot.boot_id:
            first_of_boot = event
        boot_began = (first_of_boot.utc - events[0].utc).total_seconds()
        now = boot_began + event.monotonic_seconds - first_of_boot.monotonic_seconds
        seconds.append(max(now, seconds[-1]) if seconds else now)
    return seconds


def _idle(events: Sequence[LoggedEvent], spans: Sequence[Span]) -> tuple[Span, ...]:
    idle, busy_until = [], 0.0
    for start, end in sorted(_activity(events, spans)):
        if start - busy_until >= IDLE_SECONDS:
            idle.append(Span(busy_until, start))
        busy_until = max(busy_until, end)
    return tuple(idle)


def _activity(events: Sequence[LoggedEvent], spans: Sequence[Span]) -> list[tuple[float, float]]:
    """When something was done by hand or script, or looked at from elsewhere; at the end, too."""
    active = [
        (span.end if event.kind in SNAP_ENDS else span.start, span.end)
        for event, span in zip(events, spans, strict=True)
        if event.actor != Actor.MACHINE
    ]
    return active + [(span.end, span.end) for span in spans[-1:]]
