"""What the machine may do under a task's condition, with workers that the test holds in its hands."""

import numpy as np
import pytest

from app.labeling.moves.pose_record import ActionError
from app.labeling.snaps.machine import MOVED_ON, TAKEN_BACK
from app.storage.roles import Actor
from app.workers.pool import SnapError
from registration_core import SnapConfig
from tests.app.labeling.bench import FRAMES, START, Bench, result, shifted, thought

SURE, UNSURE = 0.9, 0.7


@pytest.fixture
def auto() -> Bench:
    return Bench(condition="auto")


# -- manual


def test_in_manual_there_is_no_machine():
    bench = Bench(condition="manual")
    bench.drag(shifted(0.1))
    with pytest.raises(ActionError, match="done by hand alone"):
        bench.session.snap(Actor.SCRIPT)
    assert bench.workers.snaps == []
    assert bench.log.kinds == ["drag"]
    assert bench.state.snap is None and bench.state.offer is None


# -- snap


def test_in_snap_the_machine_waits_to_be_asked(bench):
    bench.drag(shifted(0.1))
    assert bench.workers.snaps == []
    bench.session.snap(Actor.HUMAN)
    assert bench.state.snap.asked_by == Actor.HUMAN
    bench.workers.snaps[0].end(result(shifted(0.2), 0.01))
    assert np.array_equal(bench.state.T_world_object, shifted(0.2))


# -- auto


def test_in_auto_the_machine_takes_over_at_the_end_of_a_drag_and_is_undone(auto):
    auto.drag(shifted(0.1))
    (snap,) = auto.workers.snaps
    assert np.array_equal(snap.order.T_world_object, shifted(0.1))
    assert auto.state.snap.asked_by == Actor.MACHINE
    snap.end(result(shifted(0.2), SURE))
    assert np.array_equal(auto.state.T_world_object, shifted(0.2))
    assert auto.state.confidence == SURE
    drag, requested, applied = auto.log.events
    assert (drag.kind, drag.actor) == ("drag", Actor.HUMAN)
    assert (requested.kind, requested.actor) == ("snap_requested", Actor.MACHINE)
    assert (applied.kind, applied.actor) == ("snap_applied", Actor.MACHINE)
    assert applied.detail == {
        "confidence": SURE,
        "assessment": thought("accept", SURE).stored(),
        "used_frames": list(FRAMES),
        "other_frames": [],
    }
    assert auto.state.assessment == thought("accept", SURE)
    assert len(auto.log.estimates) == 1
    auto.session.undo(Actor.HUMAN)
    assert np.array_equal(auto.state.T_world_object, shifted(0.1))
    assert len(auto.workers.snaps) == 1


@pytest.mark.parametrize("verdict", ["look", "doubt"])
def test_a_machine_that_is_not_to_be_accepted_offers_quietly_and_says_why(auto, verdict):
    auto.drag(shifted(0.1))
    auto.workers.snaps[0].end(result(shifted(0.2), UNSURE, verdict))
    assert auto.state.offer.withheld == auto.log.events[-1].detail["withheld"] == f"{verdict}: because"
    assert auto.state.offer.assessment.verdict == verdict
    assert np.array_equal(auto.state.T_world_object, shifted(0.1))
    assert auto.state.offer.quiet and auto.state.offer.assessment.confidence == UNSURE
    assert (auto.log.kinds[-1], auto.log.events[-1].actor) == ("snap_offered", Actor.MACHINE)
    auto.session.accept(Actor.HUMAN)
    assert np.array_equal(auto.state.T_world_object, shifted(0.2))
    assert auto.state.assessment == thought(verdict, UNSURE)
    assert auto.log.events[-1].detail["assessment"] == thought(verdict, UNSURE).stored()


def test_what_the_operator_asks_for_is_taken_however_unsure_and_offered_aloud(auto):
    auto.session.snap(Actor.HUMAN)
    auto.workers.snaps[0].end(result(shifted(0.2), UNSURE, "doubt"))
    assert np.array_equal(auto.state.T_world_object, shifted(0.2))
    auto.session.snap(Actor.HUMAN)
    auto.session.undo(Actor.HUMAN)
    auto.workers.snaps[1].end(result(shifted(0.3), UNSURE, "doubt"))
    assert not auto.state.offer.quiet
    assert auto.state.offer.withheld == MOVED_ON


@pytest.mark.parametrize("undone", [True, False])
def test_what_the_operator_took_back_is_not_forced_on_them_again(auto, undone):
    auto.drag(shifted(0.1))
    auto.workers.snaps[0].end(result(shifted(0.2), SURE))
    if undone:
        auto.session.undo(Actor.HUMAN)
    auto.drag(shifted(0.15))
    auto.workers.snaps[1].end(result(shifted(0.201), SURE))
    assert np.array_equal(auto.state.T_world_object, shifted(0.15))
    assert auto.state.offer.quiet
    assert auto.state.offer.withheld == TAKEN_BACK
    auto.drag(shifted(0.25))
    auto.workers.snaps[2].end(result(shifted(0.3), SURE))
    assert np.array_equal(auto.state.T_world_object, shifted(0.3))


def test_a_machine_whose_result_comes_when_the_operator_drags_again_keeps_quiet(auto):
    auto.drag(shifted(0.1))
    auto.session.start_drag()
    auto.session.drag_to(shifted(0.12))
    auto.workers.snaps[0].end(result(shifted(0.2), SURE))
    assert np.array_equal(auto.state.T_world_object, shifted(0.12))
    assert auto.state.offer.quiet
    auto.session.end_drag()
    assert len(auto.workers.snaps) == 2 and auto.state.offer is None


def test_only_a_drag_that_moved_something_gives_the_machine_its_turn(auto):
    auto.drag(shifted(0.1), START)
    auto.session.set_pose(shifted(0.1), Actor.SCRIPT)
    auto.session.end_drag()
    assert auto.workers.snaps == []


def test_a_drag_that_cannot_be_saved_gives_the_machine_no_turn(auto):
    auto.log.broken = True
    with pytest.raises(OSError, match="no space left"):
        auto.drag(shifted(0.1))
    assert auto.workers.snaps == []


def test_a_turn_that_comes_to_nothing_leaves_the_drag(auto):
    auto.drag(shifted(0.1))
    auto.workers.snaps[0].end(SnapError("outside the image"))
    assert auto.log.kinds == ["drag", "snap_requested", "snap_failed"]
    assert np.array_equal(auto.state.T_world_object, shifted(0.1))


# -- methods


def test_snap_computes_with_the_tasks_method_until_another_is_chosen():
    bench = Bench(method="paper")
    bench.session.snap(Actor.HUMAN)
    assert bench.workers.snaps[-1].order.config == SnapConfig.paper()
    assert bench.state.snap is not None
    assert bench.state.method == bench.state.snap.method == "paper"
    bench.session.choose_method("default")
    bench.session.snap(Actor.HUMAN)
    assert bench.workers.snaps[-1].order.config == SnapConfig()
    assert bench.log.kinds == ["snap_requested", "snap_cancelled", "snap_requested"]


def test_what_the_machine_looks_for_unasked_is_by_the_default():
    bench = Bench(condition="auto", method="paper")
    bench.drag(shifted(0.1))
    assert bench.workers.snaps[-1].order.config == SnapConfig()
    bench.session.set_live(True, Actor.HUMAN)
    bench.session.cancel_snap(Actor.HUMAN)
    bench.session.start_drag()
    bench.session.drag_to(shifted(0.2))
    assert bench.workers.snaps[-1].order.is_live
    assert bench.workers.snaps[-1].order.config == SnapConfig()
