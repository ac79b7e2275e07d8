"""One live session with all that belongs to it."""

import threading
from collections.abc import Callable
from dataclasses import dataclass, field

import trimesh

from app.labeling.live.page_lease import PageLease
from app.labeling.scene.depth_reading import DepthReading
from app.labeling.scene.neighbours import Neighbours
from app.labeling.session import LabelingSession
from app.labeling.snaps.session_object import SessionObject
from app.storage.tables import Frame, Registration
from app.views3d.view import SceneView
from registration_core import ObjectModel


@dataclass
class LiveSession:
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
    page_lease: PageLease = field(default_factory=PageLease)
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
