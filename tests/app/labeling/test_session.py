"""What may be done in a session, in which order, and what is recorded."""

from collections.abc import Callable

import numpy as np
import pytest

from app.labeling.layers import Layers
from app.labeling.moves.camera_watch import Camera
from app.labeling.moves.pose_record import ActionError
from app.labeling.session import LabelingSession
from app.labeling.session_state import SessionState
from app.storage.roles import Actor
from tests.app.labeling.bench import FRAMES, START, Bench, result, shifted


def same(a: SessionState, b: SessionState) -> bool:
    """Whether nothing changed but the revision and the message."""
    names = set(a.__dataclass_fields__) - {"revision", "message", "T_world_object"}
    return np.array_equal(a.T_world_object, b.T_world_object) and all(
        getattr(a, name) == getattr(b, name) for name in names
    )


@pytest.mark.parametrize("action", ["undo", "redo", "reset", "submit", "accept"])
def test_while_the_object_is_held_nothing_else_may_move_it(bench, action):
    bench.session.start_drag()
    with pytest.raises(ActionError, match="let go"):
        getattr(bench.session, action)(Actor.SCRIPT)
    with pytest.raises(ActionError, match="let go"):
        bench.session.set_pose(shifted(1.0), Actor.SCRIPT)
    assert bench.log.events == []


def test_what_the_view_shows_is_chosen_at_any_time_and_is_no_event(bench):
    chosen = Layers(cloud=False, agreement=True)
    bench.session.start_drag()
    bench.session.show_layers(chosen)
    assert bench.state.layers == chosen
    assert bench.state.dragging
    assert bench.log.events == []


# -- record first


def drag(session: LabelingSession) -> None:
    session.start_drag()
    session.drag_to(shifted(0.1))
    session.end_drag()


ACTIONS: dict[str, Callable[[LabelingSession], object]] = {
    "drag": drag,
    "set_pose": lambda session: session.set_pose(shifted(0.2), Actor.SCRIPT),
    "reset": lambda session: session.reset(Actor.HUMAN),
    "undo": lambda session: session.undo(Actor.HUMAN),
    "redo": lambda session: session.redo(Actor.HUMAN),
    "frame": lambda session: session.show_frame(FRAMES[1], Actor.HUMAN),
    "snap_requested": lambda session: session.snap(Actor.HUMAN),
    "live": lambda session: session.set_live(True, Actor.HUMAN),
    "accept": lambda session: session.accept(Actor.HUMAN),
    "dismiss": lambda session: session.dismiss(Actor.HUMAN),
    "submit": lambda session: session.submit(Actor.HUMAN),
}


def ready_for_anything() -> Bench:
    """A session in which each action is possible: something to undo, to redo and to accept."""
    bench = Bench()
    bench.session.set_pose(shifted(0.01), Actor.SCRIPT)
    bench.session.set_pose(shifted(0.02), Actor.SCRIPT)
    bench.session.snap(Actor.HUMAN)
    bench.session.undo(Actor.HUMAN)
    bench.workers.snaps[0].end(result(shifted(0.5)))
    state = bench.state
    assert state.can_undo and state.can_redo and state.offer is not None
    bench.log.events.clear()
    return bench


@pytest.mark.parametrize("kind", ACTIONS)
def test_each_action_is_recorded_before_it_is_seen(kind):
    bench = ready_for_anything()
    before = bench.state
    seen: list[SessionState] = []
    told: list[SessionState] = []
    bench.log.watch = lambda: seen.append(bench.state)
    bench.session.subscribe(told.append)
    ACTIONS[kind](bench.session)
    assert bench.log.kinds == [kind]
    assert same(seen[0], before)
    assert (told and not same(told[-1], before)) or kind == "drag"


@pytest.mark.parametrize("kind", ACTIONS)
def test_what_cannot_be_recorded_does_not_happen(kind):
    bench = ready_for_anything()
    before = bench.state
    bench.log.broken = True
    with pytest.raises(OSError, match="no space left"):
        ACTIONS[kind](bench.session)
    assert same(bench.state, before)
    assert len(bench.workers.snaps) == 1
    bench.log.broken = False
    ACTIONS[kind](bench.session)
    assert bench.log.kinds == [kind]


# -- frames, submission, closing


def test_snaps_go_against_the_frame_that_is_shown(bench):
    bench.session.show_frame(FRAMES[1], Actor.HUMAN)
    bench.session.snap(Actor.HUMAN)
    assert bench.state.frame_id == FRAMES[1]
    assert bench.workers.snaps[0].order.frame_id == FRAMES[1]
    assert bench.log.events[0].detail == {"frame_id": FRAMES[1]}
    with pytest.raises(ActionError, match="Frame 99"):
        bench.session.show_frame(99, Actor.HUMAN)
    assert bench.state.frame_id == FRAMES[1]


def test_a_submitted_registration_refuses_every_change(bench):
    bench.drag(shifted(0.1))
    bench.session.snap(Actor.HUMAN)
    bench.session.submit(Actor.HUMAN)
    assert bench.workers.snaps[0].cancelled
    assert bench.log.kinds == ["drag", "snap_requested", "snap_cancelled", "submit"]
    assert np.array_equal(bench.log.events[-1].T_after, shifted(0.1))
    assert bench.state.state == "submitted"
    assert not bench.state.can_undo and not bench.state.can_redo
    for act in (
        lambda: bench.session.undo(Actor.HUMAN),
        lambda: bench.session.redo(Actor.HUMAN),
        lambda: bench.session.reset(Actor.HUMAN),
        lambda: bench.session.set_pose(START, Actor.HUMAN),
        lambda: bench.session.snap(Actor.HUMAN),
        lambda: bench.session.accept(Actor.HUMAN),
        lambda: bench.session.dismiss(Actor.HUMAN),
        lambda: bench.session.submit(Actor.HUMAN),
    ):
        with pytest.raises(ActionError, match="submitted"):
            act()
    bench.drag(shifted(0.7))
    assert np.array_equal(bench.state.T_world_object, shifted(0.1))
    assert len(bench.log.events) == 4


def test_a_skipped_registration_says_why_and_refuses_changes(bench):
    bench.drag(shifted(0.1))
    bench.session.snap(Actor.HUMAN)
    bench.session.skip(Actor.HUMAN, "no depth")
    assert bench.workers.snaps[0].cancelled
    assert bench.log.kinds == ["drag", "snap_requested", "snap_cancelled", "skip"]
    assert bench.log.events[-1].detail == {"reason": "no depth"}
    assert (bench.state.state, bench.state.skip_reason) == ("skipped", "no depth")
    for act in (
        lambda: bench.session.undo(Actor.HUMAN),
        lambda: bench.session.submit(Actor.HUMAN),
        lambda: bench.session.skip(Actor.HUMAN, "ambiguous"),
    ):
        with pytest.raises(ActionError, match="was skipped; reopen it"):
            act()


@pytest.mark.parametrize("end", ["submit", "skip"])
def test_what_was_reopened_goes_on_where_it_was(bench, end):
    bench.drag(shifted(0.1))
    bench.drag(shifted(0.2))
    bench.session.undo(Actor.HUMAN)
    before = bench.state
    if end == "submit":
        bench.session.submit(Actor.HUMAN)
    else:
        bench.session.skip(Actor.HUMAN, "ambiguous")
    bench.session.reopen(Actor.HUMAN)
    assert bench.log.kinds[-2:] == [end, "reopen"]
    assert (bench.state.state, bench.state.skip_reason) == ("open", None)
    assert (bench.state.can_undo, bench.state.can_redo) == (before.can_undo, before.can_redo) == (True, True)
    bench.session.redo(Actor.HUMAN)
    assert np.array_equal(bench.state.T_world_object, shifted(0.2))
    with pytest.raises(ActionError, match="is open"):
        bench.session.reopen(Actor.HUMAN)


def test_nothing_ends_that_is_not_written_down(bench):
    bench.log.broken = True
    for act in (bench.session.submit, lambda actor: bench.session.skip(actor, "ambiguous")):
        with pytest.raises(OSError, match="no space"):
            act(Actor.HUMAN)
        assert bench.state.state == "open"


def test_a_session_opens_as_submitted():
    bench = Bench("submitted")
    with pytest.raises(ActionError, match="submitted"):
        bench.session.snap(Actor.HUMAN)
    assert bench.log.events == []


def test_where_the_operator_looks_from_is_logged_and_is_no_step() -> None:
    bench = Bench()
    camera: Camera = {
        "position": [0.0, 0.0, 1.0],
        "look_at": [0.0, 0.0, 0.0],
        "up": [0.0, 1.0, 0.0],
        "fov": 0.8,
    }
    bench.session.start_drag()
    bench.session.look_from(camera, 0.7)  # even with the object in the hand
    (event,) = bench.log.events
    assert (event.kind, event.actor, event.duration_seconds, event.detail) == (
        "view",
        Actor.HUMAN,
        0.7,
        camera,
    )
    assert bench.session.snapshot().dragging and not bench.session.snapshot().can_undo


def test_a_submitted_session_logs_no_views() -> None:
    bench = Bench(state="submitted")
    bench.session.look_from({"fov": 0.8}, 0.7)
    assert bench.log.events == []
