"""Which frames of a scene a snap works on, and which ones check its result."""

from collections.abc import Mapping
from dataclasses import dataclass
from typing import Protocol

import numpy as np
from numpy.typing import NDArray

from app.labeling.snap_exchange import KnownObject
from app.scene_data import SceneData, camera_of
from app.tables import Frame, FrameChoice, Object
from registration_core.view_choice import best_views

Array = NDArray[np.float64]

Wanted = FrameChoice | tuple[int, ...]
"""The frames that see the object, the one that is shown, or these by their ids."""

MOST_USED = 4
"""More of them would make a snap slow and say little that is new."""
MOST_CHECKING = 2


@dataclass(frozen=True)
class SnapFrames:
    """Ids of frames, best first."""

    used: tuple[int, ...]
    """The pose is found in these."""
    checking: tuple[int, ...] = ()
    """It was not, but they see the object: whether they agree speaks for the pose, or against it."""


class ChooseFrames(Protocol):
    """Chooses the frames of a snap from a pose, `shown` being the frame that the operator looks at."""

    def __call__(
        self, shown: int, T_world_object: Array, known: tuple[KnownObject, ...], wanted: Wanted
    ) -> SnapFrames: ...


class FramesOfScene:
    """`choose` is what a session is handed as `ChooseFrames`.

    Args:
        data: Where depth comes from.
        frames: The scene's frames, by id.
        item: The object that is looked for.
    """

    def __init__(self, data: SceneData, frames: Mapping[int, Frame], item: Object) -> None:
        self._data = data
        self._frames = frames
        self._item = item

    def choose(
        self, shown: int, T_world_object: Array, known: tuple[KnownObject, ...], wanted: Wanted
    ) -> SnapFrames:
        """The frames that were asked for, and others that see the object to check the result by."""
        seeing = self._seeing(shown, T_world_object, known)
        if wanted == "auto":
            # Where three see it, one is better kept to check the result than used as well.
            used = seeing[: min(MOST_USED, len(seeing) - 1)] if len(seeing) > 2 else seeing
        else:
            used = [shown] if wanted == "current" else list(wanted)
        checking = [frame_id for frame_id in seeing if frame_id not in used]
        return SnapFrames(tuple(used) or (shown,), tuple(checking[:MOST_CHECKING]))

    def _seeing(self, shown: int, T_world_object: Array, known: tuple[KnownObject, ...]) -> list[int]:
        if len(self._frames) == 1:
            return [shown]
        ids = list(self._frames)
        cameras = [(camera_of(frame), np.array(frame.T_world_camera)) for frame in self._frames.values()]
        best = best_views(
            self._data.thinned_model(self._item),
            cameras,
            lambda index: self._data.depth(self._frames[ids[index]]),
            T_world_object,
            [(one.model, one.T_world_object) for one in known],
            ids.index(shown),
            MOST_USED + MOST_CHECKING,
        )
        return [ids[index] for index in best]
