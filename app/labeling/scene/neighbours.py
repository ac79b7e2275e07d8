"""What is done of a scene beside the thing that is worked on: shown in the 3-D view, and known to snaps."""

from collections.abc import Callable, Sequence

import numpy as np
from numpy.typing import NDArray

from app.datasets.scene_data import SceneData, camera_of
from app.labeling.scene.instances import SceneInstance
from app.labeling.scene.known_object import KnownObject
from app.storage.tables import Frame
from registration_core import explained_pixels
from registration_core.geometry import pose

Listener = Callable[[Sequence[SceneInstance]], None]


class Neighbours:
    """What one registration knows of its scene, read anew whenever somebody ends or reopens another.

    Args:
        read: Reads the things of the scene.
        data: Where depth comes from.
    """

    def __init__(self, read: Callable[[], tuple[SceneInstance, ...]], data: SceneData) -> None:
        self._read = read
        self._data = data
        self._listeners: list[Listener] = []
        self._explained: dict[int, NDArray[np.bool_]] = {}
        """By frame, for what was known last."""
        self._explained_by: tuple[KnownObject, ...] = ()
        self.shown = True
        """Whether the 3-D view shows what is done; snaps know it all the same."""
        self.things = read()
        self.known = _known(self.things)

    def renew(self) -> None:
        """Read what changed."""
        self.things = self._read()
        self.known = _known(self.things)
        self._tell()

    def show(self, on: bool) -> None:
        """Show what is done in the 3-D view, or hide it."""
        self.shown = on
        self._tell()

    def subscribe(self, listener: Listener) -> None:
        """Call `listener` with the things that are to be seen, now and whenever they change."""
        self._listeners.append(listener)
        listener(self._visible())

    def explained(self, frame: Frame, known: tuple[KnownObject, ...]) -> NDArray[np.bool_] | None:
        """The pixels (H, W) of a frame that known objects explain; None where nothing is known."""
        if not known:
            return None
        if self._explained_by is not known:
            self._explained, self._explained_by = {}, known
        if frame.id not in self._explained:
            T_camera_world = pose.inverse(np.array(frame.T_world_camera))
            placed = [(one.model, T_camera_world @ one.T_world_object) for one in known]
            self._explained[frame.id] = explained_pixels(self._data.depth(frame), camera_of(frame), placed)
        return self._explained[frame.id]

    def _visible(self) -> list[SceneInstance]:
        return [thing for thing in self.things if thing.known] if self.shown else []

    def _tell(self) -> None:
        for listener in self._listeners:
            listener(self._visible())


def _known(things: tuple[SceneInstance, ...]) -> tuple[KnownObject, ...]:
    return tuple(thing.known for thing in things if thing.known)
