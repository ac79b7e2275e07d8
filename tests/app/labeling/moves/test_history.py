"""Undo and redo against the simplest model there is: a list and a place in it."""

from dataclasses import dataclass, field

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from app.labeling.moves.history import NEW_POSE_KINDS, History, Step, replay

START = np.eye(4)


def pose_at(x: float) -> np.ndarray:
    T = np.eye(4)
    T[0, 3] = x
    return T


def place(history: History) -> float:
    return float(history.current.T_world_object[0, 3])


@dataclass(frozen=True)
class Logged:
    """What a row of the log holds, as far as it matters here."""

    kind: str
    T_after: list[list[float]] | None = None
    detail: dict[str, object] = field(default_factory=dict)
    snap_id: str | None = None


@dataclass
class Model:
    """Undo and redo as everybody knows them."""

    places: list[float] = field(default_factory=lambda: [0.0])
    at: int = 0
    log: list[Logged] = field(default_factory=list)

    def act(self, action: str | float) -> bool:
        """Do it where it is possible, and write it down; tells whether it was."""
        if action == "undo" and self.at > 0:
            self.at -= 1
        elif action == "redo" and self.at < len(self.places) - 1:
            self.at += 1
        elif isinstance(action, float):
            self.places = [*self.places[: self.at + 1], action]
            self.at += 1
        else:
            return False
        kind = (
            action if isinstance(action, str) else sorted(NEW_POSE_KINDS)[len(self.log) % len(NEW_POSE_KINDS)]
        )
        self.log.append(Logged(kind, pose_at(self.places[self.at]).tolist()))
        return True


actions = st.lists(st.one_of(st.sampled_from(["undo", "redo"]), st.floats(-9.0, 9.0)), max_size=40)


def apply(history: History, action: str | float) -> History:
    if action == "undo":
        return history.undone()
    if action == "redo":
        return history.redone()
    return history.pushed(Step(pose_at(float(action))))


@given(actions)
def test_any_sequence_of_actions_does_what_the_model_does(sequence):
    model, history = Model(), History((Step(START),))
    for action in sequence:
        assert history.can_undo == (model.at > 0)
        assert history.can_redo == (model.at < len(model.places) - 1)
        if model.act(action):
            history = apply(history, action)
        assert place(history) == model.places[model.at]


@given(actions)
def test_replaying_the_log_gives_the_same_history(sequence):
    model, history = Model(), History((Step(START),))
    for action in sequence:
        if model.act(action):
            history = apply(history, action)
    again = replay(START, model.log)
    assert [step.T_world_object[0, 3] for step in again.steps] == model.places
    assert again.position == model.at == history.position


@given(actions, st.data())
def test_what_moves_nothing_changes_nothing(sequence, data):
    model = Model()
    for action in sequence:
        model.act(action)
    others = ["opened", "snap_requested", "snap_offered", "snap_cancelled", "snap_failed", "dismiss", "frame"]
    log = list(model.log)
    for kind in data.draw(st.lists(st.sampled_from(others), max_size=10)):
        log.insert(data.draw(st.integers(0, len(log))), Logged(kind, pose_at(99.0).tolist()))
    again = replay(START, log)
    assert place(again) == model.places[model.at]
    assert len(again.steps) == len(model.places)


@given(st.lists(st.floats(-9.0, 9.0), min_size=1, max_size=10))
def test_undoing_everything_leads_back_to_the_start_and_redoing_to_the_end(places):
    history = History((Step(START),))
    for x in places:
        history = history.pushed(Step(pose_at(x)))
    end = history
    while history.can_undo:
        history = history.undone()
    assert place(history) == 0.0
    while history.can_redo:
        history = history.redone()
    assert history == end


def test_confidence_and_estimate_stay_with_their_pose():
    log = [
        Logged("snap_applied", pose_at(1.0).tolist(), {"confidence": 0.75}, "a"),
        Logged("drag", pose_at(2.0).tolist()),
        Logged("undo", pose_at(1.0).tolist()),
    ]
    history = replay(START, log)
    assert (history.current.confidence, history.current.snap_id) == (0.75, "a")
    assert (history.redone().current.confidence, history.redone().current.snap_id) == (None, None)


def test_what_was_dragged_is_known_as_such():
    log = [Logged(kind, pose_at(1.0).tolist()) for kind in sorted(NEW_POSE_KINDS)]
    (start, *steps) = replay(START, log).steps
    assert not start.dragged
    assert [step.dragged for step in steps] == [event.kind == "drag" for event in log]


def test_a_step_past_either_end_is_a_programming_error():
    with pytest.raises(AssertionError):
        History((Step(START),)).undone()
    with pytest.raises(AssertionError):
        History((Step(START),)).redone()


def test_whose_a_pose_is_goes_by_what_led_to_it():
    log = [
        Logged("drag", pose_at(1.0).tolist()),
        Logged("set_pose", pose_at(2.0).tolist(), {"technique": "nudge"}),
        Logged("set_pose", pose_at(3.0).tolist(), {"technique": "proposal"}),
        Logged("set_pose", pose_at(3.0).tolist(), {"technique": "mode"}),
        Logged("snap_applied", pose_at(4.0).tolist()),
        Logged("accept", pose_at(5.0).tolist()),
        Logged("reset", START.tolist()),
    ]
    history = replay(START, log)
    posers = [step.posed_by for step in history.steps]
    assert posers == ["start", "human", "human", "machine", "machine", "machine", "machine", "start"]
