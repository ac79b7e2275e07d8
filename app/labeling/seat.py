"""One live session with all that belongs to it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import trimesh

from app.labeling.chair import Chair
from app.labeling.depth_reading import DepthReading
from app.labeling.neighbours import Neighbours
from app.labeling.session import LabelingSession
from app.labeling.session_object import SessionObject
from app.labeling.view import SceneView
from app.tables import Frame, Registration
from registration_core import ObjectModel


@dataclass
class Seat:
    """Where somebody works on one registration."""

    registration: Registration
    session: LabelingSession
    frames: dict[int, Frame]
    object: SessionObject
    neighbours: Neighbours
    reading: DepthReading
    textured: trimesh.Trimesh | None
    """The object in its own colours, metres, where it has any."""
    others: Callable[[], tuple[str, ...]]
    """Names of those who have the same task before them now, each on a registration of their own."""
    view: SceneView | None = None
    watchers: int = 0
    """Open pages and streams."""
    viewers: int = 0
    """Open connections of the 3-D view."""
    chair: Chair = field(default_factory=Chair)
    lock: threading.Lock = field(default_factory=threading.Lock)

    @property
    def model(self) -> ObjectModel:
        """The object, with its present symmetries."""
        return self.object.present.model

    def close(self) -> None:
        """End the session, and its view with it."""
        try:
            self.session.close()
        finally:
            with self.lock:
                if self.view is not None:
                    self.view.close()
