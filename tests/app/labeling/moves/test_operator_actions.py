"""The operator's hand: drags, poses that are set, undo and redo."""

import numpy as np
import pytest

from app.labeling.moves.pose_record import ActionError
from app.labeling.session import BROKEN_DRAG
from app.labeling.session_state import SessionState
from app.storage.roles import Actor
from registration_core.geometry import pose
from tests.app.labeling.bench import START, Bench, result, shifted


def test_a_drag_is_recorded_with_its_way_and_its_degrees_of_freedom(bench):
    bench.drag(shifted(0.01), shifted(0.02), shifted(0.03))
    (event,) = bench.log.events
    assert (event.kind, event.actor, event.dof) == ("drag", Actor.HUMAN, ("tx",))
    assert np.array_equal(event.T_before, START)
    assert np.array_equal(event.T_after, shifted(0.03))
    path = np.array(event.path)
    assert path.shape == (4, 8)
    assert path[0, 0] == 0.0 and (np.diff(path[:, 0]) >= 0).all()
    assert path[-1, 0] <= event.duration_seconds + 1e-3
    ways = [START, shifted(0.01), shifted(0.02), shifted(0.03)]
    assert np.allclose(path[:, 1:4], [T[:3, 3] for T in ways], atol=1e-6)
    assert np.allclose(np.linalg.norm(path[:, 4:], axis=1), 1.0, atol=1e-5)
    assert path[0, 4] > 0.9  # w comes first: START turns by little


def test_during_a_drag_the_pose_follows_the_hand_and_nothing_is_recorded(bench):
    bench.session.start_drag()
    bench.session.drag_to(shifted(0.01))
    assert bench.state.dragging
    assert np.array_equal(bench.state.T_world_object, shifted(0.01))
    assert bench.state.confidence is None
    assert bench.log.events == []
    bench.session.end_drag()
    assert not bench.state.dragging
    assert np.array_equal(bench.state.T_world_object, shifted(0.01))
    assert bench.state.can_undo


def test_a_drag_that_goes_nowhere_is_no_change(bench):
    bench.drag(shifted(0.05), START)
    assert bench.log.events == []
    assert not bench.state.can_undo
    assert not bench.state.dragging


@pytest.mark.parametrize("where", [1e308, -1e9, np.nan, np.inf])
def test_a_drag_out_of_all_reach_leaves_the_object_where_it_was(bench, where):
    far = shifted(0.01)
    far[0, 3] = where
    bench.drag(shifted(0.02), far)
    assert np.array_equal(bench.state.T_world_object, shifted(0.02))


def test_a_drag_that_a_lost_connection_ends_is_kept_and_told():
    bench = Bench(condition="auto")
    bench.session.start_drag()
    bench.session.drag_to(shifted(0.02))
    bench.session.end_drag(broken=True)
    assert np.array_equal(bench.state.T_world_object, shifted(0.02))
    assert bench.state.message == BROKEN_DRAG
    assert [event.kind for event in bench.log.events] == ["drag"]  # no sign to the machine
    bench.session.undo(Actor.HUMAN)
    assert bench.state.message is None


def test_moves_and_ends_without_a_start_are_ignored(bench):
    bench.session.drag_to(shifted(0.5))
    bench.session.end_drag()
    assert np.array_equal(bench.state.T_world_object, START)
    assert bench.log.events == []


def test_a_drag_along_the_worlds_axes_is_recorded_as_such(bench):
    bench.session.align_gizmo("world")
    assert bench.state.gizmo_axes == "world"
    along_y = START.copy()
    along_y[1, 3] += 0.02
    bench.drag(along_y)
    (event,) = bench.log.events
    assert (event.dof, event.detail) == (("ty",), {"axes": "world"})
    bench.session.start_drag()
    with pytest.raises(ActionError, match="being dragged"):
        bench.session.align_gizmo("object")
    assert bench.state.gizmo_axes == "world"


def test_a_move_starts_from_the_present_pose_and_says_how(bench):
    for _ in range(3):
        bench.session.move(lambda T: T @ pose.exp([0.01, 0, 0, 0, 0, 0]), Actor.HUMAN, "nudge")
    assert np.allclose(bench.state.T_world_object, shifted(0.03))
    assert [event.detail for event in bench.log.events] == [{"technique": "nudge"}] * 3
    bench.session.start_drag()
    with pytest.raises(ActionError, match="being dragged"):
        bench.session.move(lambda T: pytest.fail("it is held"), Actor.HUMAN, "nudge")


def test_a_drag_that_cannot_be_recorded_is_taken_back_and_said_so(bench):
    told: list[SessionState] = []
    bench.session.subscribe(told.append)
    bench.log.broken = True
    bench.session.start_drag()
    bench.session.drag_to(shifted(0.1))
    with pytest.raises(OSError, match="no space left"):
        bench.session.end_drag()
    assert np.array_equal(told[-1].T_world_object, START)
    assert not told[-1].dragging and not told[-1].can_undo
    assert told[-1].message is not None and "no space left" in told[-1].message
    bench.log.broken = False
    bench.drag(shifted(0.1))
    assert bench.state.message is None


def test_undo_redo_and_reset_record_where_they_lead(bench):
    bench.drag(shifted(0.1))
    bench.session.undo(Actor.HUMAN)
    bench.session.redo(Actor.SCRIPT)
    bench.session.reset(Actor.HUMAN)
    drag, undo, redo, reset = bench.log.events
    assert [drag.kind, undo.kind, redo.kind, reset.kind] == ["drag", "undo", "redo", "reset"]
    assert [e.actor for e in (undo, redo, reset)] == [Actor.HUMAN, Actor.SCRIPT, Actor.HUMAN]
    for event, before, after in [
        (undo, shifted(0.1), START),
        (redo, START, shifted(0.1)),
        (reset, shifted(0.1), START),
    ]:
        assert np.array_equal(event.T_before, before) and np.array_equal(event.T_after, after)
    bench.session.undo(Actor.HUMAN)
    assert np.array_equal(bench.state.T_world_object, shifted(0.1))


def test_nothing_to_undo_or_redo_is_said(bench):
    with pytest.raises(ActionError, match="nothing to undo"):
        bench.session.undo(Actor.HUMAN)
    with pytest.raises(ActionError, match="nothing to redo"):
        bench.session.redo(Actor.HUMAN)
    assert bench.log.events == []


def test_undo_brings_an_estimates_confidence_back(bench):
    bench.session.snap(Actor.HUMAN)
    bench.workers.snaps[0].end(result(shifted(0.05), 0.8))
    assert bench.state.confidence == 0.8
    bench.drag(shifted(0.06))
    assert bench.state.confidence is None
    bench.session.undo(Actor.HUMAN)
    assert bench.state.confidence == 0.8


def test_what_the_machine_found_and_the_operator_took_is_the_machines(bench):
    assert bench.state.posed_by == "start"
    bench.session.set_pose(shifted(0.01), Actor.HUMAN, "proposal")
    assert bench.state.posed_by == "machine"
    bench.session.start_drag()
    assert bench.state.posed_by == "human"
    bench.session.drag_to(shifted(0.02))
    bench.session.end_drag()
    assert bench.state.posed_by == "human"
    bench.session.reset(Actor.HUMAN)
    assert bench.state.posed_by == "start"
    bench.session.undo(Actor.HUMAN)
    bench.session.undo(Actor.HUMAN)
    bench.session.submit(Actor.HUMAN)
    assert bench.state.posed_by == "machine"
