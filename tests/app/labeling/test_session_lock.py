"""Who listens to a session hears what came of every change."""

from app.labeling.session_state import SessionState
from app.storage.roles import Actor
from registration_core.geometry import pose
from tests.app.labeling.bench import shifted


def test_closing_cancels_the_snap_and_tells_nobody_any_more(bench):
    told: list[SessionState] = []
    unsubscribe = bench.session.subscribe(told.append)
    bench.session.snap(Actor.HUMAN)
    bench.session.close()
    count = len(told)
    assert bench.workers.snaps[0].cancelled
    assert bench.log.events[-1].detail == {"reason": "session closed"}
    bench.session.set_pose(shifted(0.1), Actor.SCRIPT)
    assert len(told) == count
    unsubscribe()


def test_listeners_hear_every_change_in_order_until_they_leave(bench):
    first: list[float] = []
    second: list[float] = []
    leave = bench.session.subscribe(lambda state: first.append(round(state.T_world_object[0, 3], 6)))
    bench.session.subscribe(lambda state: second.append(round(state.T_world_object[0, 3], 6)))
    bench.session.set_pose(pose.exp([1.0, 0, 0, 0, 0, 0]), Actor.SCRIPT)
    bench.session.set_pose(pose.exp([2.0, 0, 0, 0, 0, 0]), Actor.SCRIPT)
    leave()
    bench.session.undo(Actor.SCRIPT)
    assert first == [1.0, 2.0]
    assert second == [1.0, 2.0, 1.0]


def test_a_listener_may_look_at_the_session(bench):
    seen: list[bool] = []
    bench.session.subscribe(lambda state: seen.append(bench.state == state or bench.state is not None))
    bench.drag(shifted(0.1))
    assert seen and all(seen)
