"""Logs made by hand."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from datetime import UTC, datetime, timedelta
from typing import Any

import numpy as np

from app.labeling.moves.drag import _path_row
from registration_core.geometry import pose

NOON = datetime(2026, 1, 1, 12, tzinfo=UTC)
START = np.eye(4)


@dataclass(frozen=True)
class Entry:
    """An event as it is logged, at seconds after noon."""

    seconds: float
    kind: str
    T_after: list[list[float]] | None = None
    duration_seconds: float | None = None
    path: Sequence[Sequence[float]] | None = None
    actor: str = "human"
    snap_id: str | None = None
    dof: list[str] | None = None
    detail: dict[str, Any] = field(default_factory=dict)
    boot_id: str = "first"
    clock: float = 1000.0
    """What the server's monotonic clock showed at noon."""
    late: float = 0.0
    """Seconds by which UTC was put forward."""

    @property
    def utc(self) -> datetime:
        return NOON + timedelta(seconds=self.seconds + self.late)

    @property
    def monotonic_seconds(self) -> float:
        return self.clock + self.seconds


def at(x: float, turn: float = 0.0) -> np.ndarray:
    """A pose x metres along the world's x axis, turned about its z axis, radians."""
    return pose.exp([x, 0.0, 0.0, 0.0, 0.0, turn])


def drag(end: float, duration: float, *way: np.ndarray, **more: Any) -> Entry:
    """A drag through poses at even times."""
    times = np.linspace(0.0, duration, len(way))
    path = [[float(time), *_path_row(T)] for time, T in zip(times, way, strict=True)]
    return Entry(end, "drag", way[-1].tolist(), duration, path, **more)


def moved(seconds: float, kind: str, T: np.ndarray, **more: Any) -> Entry:
    """An event that puts the object at a pose."""
    return Entry(seconds, kind, T.tolist(), **more)


def view(end: float, duration: float, x: float = 0.0, **more: Any) -> Entry:
    """The camera moved to one metre above (x, 0, 0)."""
    camera = {"position": [x, 0.0, 1.0], "look_at": [x, 0.0, 0.0], "up": [0.0, 1.0, 0.0], "fov": 0.8}
    return Entry(end, "view", duration_seconds=duration, detail=camera, **more)
