"""The colours of depth agreement reach the view: only when wanted, only what is newest."""

from dataclasses import dataclass, field, replace
from threading import Event

import numpy as np
import pytest

from app.labeling.layers import Layers
from app.labeling.live.coloring import COLORS, MOST_POINTS, Coloring
from app.labeling.scene.depth_reading import DepthReading
from app.labeling.session_state import SessionState
from registration_core.geometry import pose
from registration_core.rendering.depth_verdicts import Verdict
from tests.app.labeling.bench import Bench
from tests.app.labeling.scene.test_depth_reading import MODEL, T_CAMERA_OBJECT, T_WORLD_CAMERAS, Frames
from tests.app.waiting import wait_until

TRUE = T_WORLD_CAMERAS[3] @ T_CAMERA_OBJECT
NEARER = T_WORLD_CAMERAS[3] @ pose.exp([0.0, 0.0, -0.03, 0.0, 0.0, 0.0]) @ T_CAMERA_OBJECT


@dataclass
class View:
    """Keeps what it was to show; holds the first up until it may go on."""

    shown: list[tuple[np.ndarray, np.ndarray]] = field(default_factory=list)
    may_go_on: Event = field(default_factory=Event)

    def __call__(self, points: np.ndarray, colors: np.ndarray) -> None:
        self.shown.append((points, colors))
        self.may_go_on.wait(60)


@pytest.fixture
def state() -> SessionState:
    return replace(Bench().state, frame_id=3, T_world_object=TRUE, layers=Layers(agreement=True))


def test_points_have_the_colours_of_their_verdicts(state: SessionState) -> None:
    view = View()
    coloring = Coloring(DepthReading(lambda: MODEL, Frames()), view)
    coloring.update(state)
    wait_until(lambda: view.shown, "the first colours")
    for _ in range(20):  # while that is being shown
        coloring.update(replace(state, T_world_object=TRUE @ pose.exp([0.001, 0, 0, 0, 0, 0])))
    coloring.update(replace(state, T_world_object=NEARER))
    view.may_go_on.set()
    wait_until(lambda: len(view.shown) > 1, "the newest")
    (points, first), (_, second) = view.shown
    assert len(points) == len(first) <= MOST_POINTS
    assert (first == COLORS[Verdict.MATCH]).all()
    assert (second == COLORS[Verdict.IN_FRONT]).all(axis=1).mean() > 0.5
    coloring.update(replace(state, layers=Layers()))
    wait_until(lambda: len(view.shown) > 2, "nothing to be shown")
    assert view.shown[-1][0].shape == (0, 3)


def test_nothing_is_computed_for_colours_that_nobody_wants(state: SessionState) -> None:
    frames = Frames()
    view = View()
    coloring = Coloring(DepthReading(lambda: MODEL, frames), view)
    coloring.update(replace(state, layers=Layers()))
    assert frames.asked == 0
    assert view.shown == []
