"""A snap uses the frames that see the object, the one at hand first, and keeps one to check the result by."""

from collections.abc import Sequence
from typing import cast

import numpy as np
import pytest

from app.datasets.scene_data import SceneData
from app.labeling.snaps.snap_exchange import SnapFrames
from app.labeling.snaps.snap_frames import MOST_OTHERS, MOST_USED, FramesOfScene
from app.storage.tables import Frame, Object
from registration_core import ObjectModel
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth
from tests.app.export.site import CAMERA, TOOL, mesh_of, model_of

MODEL = model_of(mesh_of(TOOL))
AWAY = pose.exp([0, 0, -0.5, 0, 0, 0]) @ pose.exp([0, 0, 0, 0, np.pi, 0])


class Pictures:
    """Depth of the tool alone, as the cameras of some frames see it."""

    def thinned_model(self, item: Object) -> ObjectModel:
        return MODEL

    def depth(self, frame: Frame) -> np.ndarray:
        drawn = render_depth(MODEL, CAMERA, pose.inverse(np.array(frame.T_world_camera)))
        return np.where(drawn > 0, drawn, np.float32(2.0))


def scene(*angles: float | None) -> FramesOfScene:
    """Frames 1, 2, ... that look at the tool from so many degrees around it; None looks away."""

    def frame(number: int, degrees: float | None) -> Frame:
        around = pose.exp([0, 0, 0, 0, np.radians(degrees or 0.0), 0])
        T = AWAY if degrees is None else around @ pose.exp([0, 0, -0.5, 0, 0, 0])
        size = {"width": CAMERA.width, "height": CAMERA.height}
        lens = {"fx": CAMERA.fx, "fy": CAMERA.fy, "cx": CAMERA.cx, "cy": CAMERA.cy}
        return Frame(id=number, T_world_camera=T.tolist(), **size, **lens)

    frames = {number: frame(number, degrees) for number, degrees in enumerate(angles, start=1)}
    return FramesOfScene(cast(SceneData, Pictures()), frames, Object())


@pytest.mark.parametrize(
    ("angles", "used", "others"),
    [
        ([0], [1], 0),
        ([0, 40], [1, 2], 0),
        ([0, 40, None], [1, 2], 0),
        ([0, 40, 90], [1, 2], 1),
        ([None, 40, 90], [2, 3], 0),
        ([None, None], [1], 0),
        ([0, 60, 120, 180, 240, 300, 30], [1], MOST_OTHERS),
    ],
)
def test_all_that_see_it_are_used_but_for_one_of_three(
    angles: Sequence[float | None], used: list[int], others: int
) -> None:
    chosen = scene(*angles).choose(1, np.eye(4), (), "auto")
    assert list(chosen.used[: len(used)]) == used
    assert len(chosen.used) <= MOST_USED
    assert len(chosen.others) == others
    assert not set(chosen.used) & set(chosen.others)


def test_the_frames_that_were_asked_for_are_used_and_others_check() -> None:
    frames = scene(0, 40, 90)
    assert frames.choose(2, np.eye(4), (), "current") == SnapFrames((2,), (1, 3))
    assert frames.choose(2, np.eye(4), (), (3, 1)) == SnapFrames((3, 1), (2,))
