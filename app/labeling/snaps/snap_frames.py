"""Which frames of a scene a snap works on, and which ones check its result."""

from collections.abc import Mapping

import numpy as np
from numpy.typing import NDArray

from app.datasets.scene_data import SceneData, camera_of
from app.labeling.moves.permissions import Wanted
from app.labeling.scene.known_object import KnownObject
from app.labeling.snaps.snap_exchange import SnapFrames
from app.storage.tables import Frame, Object
from registration_core.search.view_choice import best_views

Array = NDArray[np.float64]

MOST_USED = 4
"""More of them would make a snap slow and say little that is new."""
MOST_OTHERS = 2


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
        used = used or [shown]
        others = [frame_id for frame_id in seeing if frame_id not in used]
        return SnapFrames(tuple(used), tuple(others[:MOST_OTHERS]))

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
            MOST_USED + MOST_OTHERS,
        )
        return [ids[index] for index in best]
