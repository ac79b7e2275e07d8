"""What the drags tell of how far off a pose may be, over a table of histories."""

import numpy as np
import pytest

from app.labeling.moves.history import replay
from app.labeling.snaps.start_spread import ROTATION_BOUNDS, TRANSLATION_BOUNDS, spread_from_drags
from registration_core.config import SpreadConfig
from registration_core.geometry import pose
from tests.app.labeling.moves.test_degrees_of_freedom import about
from tests.app.labeling.moves.test_history import Logged

START = pose.exp([0.1, 0.2, 0.8, 0.3, -0.2, 0.1])
PIVOT = np.array([0.3, -0.2, 0.1])
"""Far from the origin, so that a turn about the one is a long way of the other."""
DEFAULT = SpreadConfig()


def gizmo(x: float = 0.0, y: float = 0.0, z: float = 0.0, turn: float = 0.0) -> np.ndarray:
    """A motion in the gizmo's axes, metres and radians, as one of the object."""
    return about(PIVOT, pose.exp([x, y, z, 0, 0, 0]) @ pose.exp([0, 0, 0, 0, turn, 0]))


def turned(x: float, y: float, z: float) -> np.ndarray:
    """A turn about several axes of the gizmo at once, radians."""
    return about(PIVOT, pose.exp([0, 0, 0, x, y, z]))


def told(*actions: tuple[str, np.ndarray] | str) -> tuple[float, float] | None:
    """The spread after events: names of events, or a name and how the object moved."""
    log: list[Logged] = []
    for action in actions:
        kind, motion = (action, np.eye(4)) if isinstance(action, str) else action
        current = replay(START, log).current.T_world_object
        T_after = START if kind == "reset" else current @ motion
        log.append(Logged(kind, T_after.tolist()))
    return spread_from_drags(replay(START, log), PIVOT, DEFAULT)


SHIFT = ("drag", gizmo(x=0.05))
SMALL_SHIFT = ("drag", gizmo(x=0.012))
FREE_SHIFT = ("drag", gizmo(x=0.02, y=0.015, z=0.01))
TURN = ("drag", gizmo(turn=0.7))
FREE_TURN = ("drag", turned(0.2, 0.3, 0.25))
BOTH = ("drag", gizmo(x=0.05, turn=0.7))
SNAP = ("snap_applied", gizmo(x=0.01, turn=0.1))
SET = ("set_pose", gizmo(x=0.02, turn=0.3))
ACCEPT = ("accept", gizmo(y=0.02, turn=0.3))


@pytest.mark.parametrize(
    ("actions", "expected"),
    [
        ([SHIFT], (0.05, DEFAULT.rotation)),
        ([TURN], (DEFAULT.translation, 0.7)),
        ([BOTH], (0.05, 0.7)),
        ([SHIFT, TURN], (0.05, 0.7)),
        ([SMALL_SHIFT], (DEFAULT.translation, DEFAULT.rotation)),
        ([SHIFT, SMALL_SHIFT], (DEFAULT.translation, DEFAULT.rotation)),
        ([FREE_SHIFT], (0.02, DEFAULT.rotation)),
        ([FREE_SHIFT, SMALL_SHIFT], (0.015, DEFAULT.rotation)),
        ([FREE_SHIFT, SHIFT], (0.05, DEFAULT.rotation)),
        ([FREE_TURN], (DEFAULT.translation, 0.3)),
        ([FREE_TURN, FREE_SHIFT], (0.02, 0.3)),
        ([SHIFT, "snap_requested", "snap_failed", "frame", "dismiss"], (0.05, DEFAULT.rotation)),
        ([SHIFT, "snap_requested", TURN, "snap_offered"], (0.05, 0.7)),
    ],
)
def test_the_last_use_of_the_worst_axis_tells(actions, expected):
    assert told(*actions) == pytest.approx(expected, rel=1e-6)


@pytest.mark.parametrize("other", [SNAP, SET, ACCEPT, "reset"])
def test_a_pose_that_no_hand_brought_about_is_unknown_and_what_was_before_does_not_count(other):
    assert told(BOTH, other) is None
    assert told(BOTH, other, FREE_SHIFT) == pytest.approx((0.02, DEFAULT.rotation))
    assert told(BOTH, other, TURN) == pytest.approx((DEFAULT.translation, 0.7))
    assert told(BOTH, other, "undo") == pytest.approx((0.05, 0.7))
    assert told(BOTH, other, "undo", "redo") is None


@pytest.mark.parametrize(
    ("actions", "expected"),
    [
        ([SHIFT, FREE_SHIFT, "undo"], (0.05, DEFAULT.rotation)),
        ([SHIFT, FREE_SHIFT, "undo", "redo"], (0.02, DEFAULT.rotation)),
        ([SHIFT, TURN, "undo", "undo", FREE_TURN], (DEFAULT.translation, 0.3)),
        ([SHIFT, "undo"], None),
        ([SHIFT, SNAP, "undo", "undo"], None),
    ],
)
def test_only_the_present_branch_counts(actions, expected):
    assert told(*actions) == (None if expected is None else pytest.approx(expected))


def test_where_nothing_was_dragged_it_is_unknown():
    assert told() is None


def test_a_drag_that_is_mere_rounding_tells_nothing():
    assert told(("drag", gizmo(x=5e-5, turn=5e-4))) is None
    assert told(BOTH, ("drag", gizmo(x=5e-5, turn=5e-4))) == pytest.approx((0.05, 0.7))


@pytest.mark.parametrize(
    ("drag", "expected"),
    [
        (
            gizmo(x=0.002, y=0.001, z=0.001) @ turned(0.02, 0.01, 0.02),
            (TRANSLATION_BOUNDS[0], ROTATION_BOUNDS[0]),
        ),
        (gizmo(x=0.4, turn=np.radians(170)), (TRANSLATION_BOUNDS[1], ROTATION_BOUNDS[1])),
    ],
)
def test_no_drag_vouches_for_less_or_leaves_it_farther_off(drag, expected):
    assert told(("drag", drag)) == expected


def test_it_is_what_json_can_hold():
    spread = told(BOTH)
    assert spread is not None and [type(part) for part in spread] == [float, float]
