"""One live session with all that belongs to it."""

import threading
from dataclasses import dataclass, field

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
        self.session.close()
        with self.lock:
            if self.view is not None:
                self.view.close()
