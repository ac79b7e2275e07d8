"""Snaps as a session asks for them and takes what they bring, with workers held in hand."""

from collections.abc import Callable
from dataclasses import asdict, replace

import numpy as np
import pytest

from app import __version__
from app.labeling.moves.pose_record import ActionError
from app.labeling.snaps.snap_exchange import FramesReport, SnapFrames
from app.storage.roles import Actor
from app.workers.pool import SnapError
from registration_core import ALGORITHM, SnapConfig
from registration_core.judge.certificates import NOTHING
from tests.app.labeling.bench import CHECK, FRAMES, PIVOT, START, SURE, Bench, result, shifted, thought
from tests.app.labeling.moves.test_degrees_of_freedom import about, turn


def test_a_snap_is_applied_with_its_estimate(bench):
    snap_id = bench.session.snap(Actor.HUMAN, SnapConfig.paper(), seed=42)
    (snap,) = bench.workers.snaps
    assert (snap.order.snap_id, snap.order.seed, snap.order.frame_id) == (snap_id, 42, FRAMES[0])
    assert snap.order.config == SnapConfig.paper()
    assert np.array_equal(snap.order.T_world_object, START)
    assert bench.state.snap.state == "queued"
    snap.progress(0.5)
    assert (bench.state.snap.state, bench.state.snap.progress) == ("running", 0.5)
    snap.end(result(shifted(0.05), 0.8))
    assert (bench.state.snap.state, bench.state.snap.progress) == ("done", 1.0)
    assert np.array_equal(bench.state.T_world_object, shifted(0.05))
    assert bench.state.confidence == 0.8 and bench.state.offer is None
    requested, applied = bench.log.events
    assert (requested.kind, requested.actor, requested.snap_id) == ("snap_requested", Actor.HUMAN, snap_id)
    assert requested.detail == {
        "seed": 42,
        "config": SnapConfig.paper().to_dict(),
        "start_spread": None,
        "known_objects": [],
        "frame_id": FRAMES[0],
        "used_frames": [FRAMES[0]],
        "other_frames": [],
    }
    assert (applied.kind, applied.actor, applied.snap_id) == ("snap_applied", Actor.MACHINE, snap_id)
    assert np.array_equal(applied.T_before, START) and np.array_equal(applied.T_after, shifted(0.05))
    assert applied.detail == {
        "confidence": 0.8,
        "assessment": thought("accept", 0.8).stored(),
        "used_frames": [FRAMES[0]],
        "other_frames": [],
    }
    (row,) = bench.log.estimates
    assert (row.snap_id, row.registration_id, row.frame_id, row.seed) == (snap_id, 7, FRAMES[0], 42)
    assert (row.version, row.hardware, row.seconds) == (__version__, "a test machine", 0.25)
    assert row.algorithm == ALGORITHM
    assert row.config == SnapConfig.paper().to_dict() and row.start_spread is None
    assert row.hypotheses[1] == {"T_camera_object": START.tolist(), "weight": 0.3}
    assert row.confidence == 0.8 and row.assessment == thought("accept", 0.8).stored()
    assert row.certificates == asdict(SURE) and row.certificates["check"]["match"] == 0.96
    (ambiguity,) = row.ambiguities
    assert ambiguity == {"kind": "free motion", "motion": "turn", "axis": (0.0, 0.0, 1.0), "extent": 0.4}


def test_a_snap_uses_the_frames_that_see_the_object_unless_it_is_asked_otherwise(bench):
    assert bench.state.frame_use == "auto"
    used = []
    for wanted in (None, "current", FRAMES[1:], None):
        bench.session.snap(Actor.HUMAN, frames=wanted)
        used.append(bench.workers.snaps[-1].order.frames.used)
        assert bench.log.events[-1].detail["used_frames"] == list(used[-1])
    assert used == [FRAMES, FRAMES[:1], FRAMES[1:], FRAMES]
    bench.session.choose_frames("current")
    bench.session.snap(Actor.HUMAN)
    assert bench.state.frame_use == "current"
    assert bench.workers.snaps[-1].order.frames.used == FRAMES[:1]
    with pytest.raises(ActionError, match="no frame 99"):
        bench.session.snap(Actor.HUMAN, frames=(FRAMES[0], 99))


def test_frames_that_were_not_used_say_whether_they_agree(bench):
    bench.others = FRAMES[1:]
    bench.session.snap(Actor.HUMAN, frames="current")
    (snap,) = bench.workers.snaps
    assert bench.state.snap.frames is None
    snap.end(result(shifted(0.05), certificates=replace(SURE, unused=(CHECK,))))
    assert bench.state.snap.frames == FramesReport(used=1, agreeing=1, asked=1)
    (row,) = bench.log.estimates
    said = [{"frame_id": FRAMES[1], "share": CHECK.match, "agrees": True}]
    assert (row.used_frames, row.other_frames) == ([FRAMES[0]], said)
    assert bench.log.events[-1].detail["other_frames"] == said
    bench.session.snap(Actor.HUMAN, frames="current")
    bench.workers.snaps[-1].end(result(shifted(0.06), certificates=replace(SURE, unused=(NOTHING,))))
    assert bench.state.snap.frames == FramesReport(used=1, agreeing=0, asked=0)
    assert bench.log.estimates[-1].other_frames == [{"frame_id": FRAMES[1], "share": None, "agrees": None}]


def test_a_trial_and_a_compared_technique_use_the_frame_that_is_shown():
    for bench in (Bench(in_study=True), Bench(condition="live snap")):
        bench.session.snap(Actor.HUMAN)
        assert bench.workers.snaps[-1].order.frames.used == FRAMES[:1]
        for act in (
            lambda bench=bench: bench.session.snap(Actor.HUMAN, frames=FRAMES),
            lambda bench=bench: bench.session.choose_frames("auto"),
        ):
            with pytest.raises(ActionError, match="the frame that is shown alone"):
                act()


def test_live_snaps_use_the_frame_that_is_shown(bench):
    bench.session.set_live(True, Actor.HUMAN)
    assert bench.workers.snaps[-1].order.frames == SnapFrames(FRAMES[:1])


def test_a_snap_is_told_how_far_the_last_drags_went_and_keeps_it(bench):
    bench.drag(shifted(0.05))
    bench.drag(shifted(0.05) @ about(PIVOT, turn(1, 0.7)))
    bench.session.snap(Actor.HUMAN)
    (snap,) = bench.workers.snaps
    assert snap.order.start_spread == pytest.approx((0.05, 0.7))
    assert bench.log.events[-1].detail["start_spread"] == list(snap.order.start_spread)
    snap.end(result(shifted(0.05)))
    (row,) = bench.log.estimates
    assert row.start_spread == list(snap.order.start_spread)
    bench.session.snap(Actor.HUMAN)
    assert bench.workers.snaps[-1].order.start_spread is None


def test_a_drag_under_way_is_told_as_if_it_ended(bench):
    bench.drag(shifted(0.05))
    bench.session.start_drag()
    bench.session.snap(Actor.HUMAN)
    bench.session.drag_to(shifted(0.07))
    bench.session.snap(Actor.HUMAN)
    held, moved = (snap.order.start_spread for snap in bench.workers.snaps)
    assert held == pytest.approx((0.05, SnapConfig().spread.rotation))
    assert moved == pytest.approx((SnapConfig().spread.translation, SnapConfig().spread.rotation))


def test_the_part_that_no_drag_tells_is_the_configurations(bench):
    bench.drag(shifted(0.05))
    bench.session.snap(Actor.SCRIPT, SnapConfig.from_dict({"spread": {"rotation": 0.25}}))
    assert bench.workers.snaps[0].order.start_spread == pytest.approx((0.05, 0.25))


@pytest.mark.parametrize("given", [None, (0.002, 0.01)])
def test_a_spread_that_is_given_goes_over_the_drags(bench, given):
    bench.drag(shifted(0.03))
    bench.session.snap(Actor.SCRIPT, start_spread=given)
    assert bench.workers.snaps[0].order.start_spread == given


def test_seeds_differ_where_none_is_given(bench):
    for _ in range(4):
        bench.session.snap(Actor.HUMAN)
    assert len({snap.order.seed for snap in bench.workers.snaps}) == 4


def test_progress_never_goes_back_nor_beyond_1(bench):
    bench.session.snap(Actor.HUMAN)
    (snap,) = bench.workers.snaps
    shares = []
    for told in (0.3, 0.2, 0.7, 1.4):
        snap.progress(told)
        shares.append(bench.state.snap.progress)
    assert shares == [0.3, 0.3, 0.7, 1.0]


def undo_then_drag(bench: Bench) -> None:
    bench.session.undo(Actor.HUMAN)
    bench.drag(shifted(0.3))


def undo_two_redo_one(bench: Bench) -> None:
    bench.session.undo(Actor.HUMAN)
    bench.session.undo(Actor.HUMAN)
    bench.session.redo(Actor.HUMAN)


MOVES: dict[str, Callable[[Bench], object]] = {
    "drag": lambda bench: bench.drag(shifted(0.3)),
    "set_pose": lambda bench: bench.session.set_pose(shifted(0.3), Actor.SCRIPT),
    "undo": lambda bench: bench.session.undo(Actor.HUMAN),
    "reset": lambda bench: bench.session.reset(Actor.HUMAN),
    "undo, then drag": undo_then_drag,
    "two undone, one redone": undo_two_redo_one,
}


@pytest.mark.parametrize("move", MOVES)
def test_a_result_is_offered_where_the_object_was_moved_meanwhile(bench, move):
    bench.session.set_pose(shifted(0.1), Actor.SCRIPT)
    bench.session.set_pose(shifted(0.2), Actor.SCRIPT)
    snap_id = bench.session.snap(Actor.HUMAN)
    MOVES[move](bench)
    where = bench.state.T_world_object
    bench.workers.snaps[0].end(result(shifted(0.5), 0.6))
    assert np.array_equal(bench.state.T_world_object, where)
    assert bench.state.offer.snap_id == snap_id and bench.state.offer.assessment.confidence == 0.6
    assert np.array_equal(bench.state.offer.T_world_object, shifted(0.5))
    assert bench.state.snap.state == "done"
    assert bench.log.kinds[-1] == "snap_offered"
    assert len(bench.log.estimates) == 1


def test_a_result_is_offered_while_the_object_is_held(bench):
    bench.session.snap(Actor.HUMAN)
    bench.session.start_drag()
    bench.session.drag_to(shifted(0.3))
    bench.workers.snaps[0].end(result(shifted(0.5)))
    assert bench.state.dragging and bench.state.offer is not None
    assert np.array_equal(bench.state.T_world_object, shifted(0.3))
    bench.session.end_drag()
    assert np.array_equal(bench.state.T_world_object, shifted(0.3))


def test_a_result_is_applied_where_what_was_undone_was_redone(bench):
    bench.drag(shifted(0.1))
    bench.session.snap(Actor.HUMAN)
    bench.session.undo(Actor.HUMAN)
    bench.session.redo(Actor.HUMAN)
    bench.workers.snaps[0].end(result(shifted(0.5)))
    assert bench.log.kinds[-1] == "snap_applied"


def test_a_snap_asked_for_in_mid_drag_starts_from_the_hand(bench):
    bench.session.start_drag()
    bench.session.drag_to(shifted(0.3))
    bench.session.snap(Actor.HUMAN)
    assert np.array_equal(bench.workers.snaps[0].order.T_world_object, shifted(0.3))


def test_an_offer_can_be_accepted_and_undone(bench):
    snap_id = bench.session.snap(Actor.HUMAN)
    bench.drag(shifted(0.3))
    bench.workers.snaps[0].end(result(shifted(0.5), 0.6))
    bench.session.accept(Actor.HUMAN)
    assert np.array_equal(bench.state.T_world_object, shifted(0.5))
    assert bench.state.confidence == 0.6 and bench.state.offer is None
    accept = bench.log.events[-1]
    assert (accept.kind, accept.snap_id) == ("accept", snap_id)
    assert accept.detail == {"confidence": 0.6, "assessment": thought("accept", 0.6).stored()}
    bench.session.undo(Actor.HUMAN)
    assert np.array_equal(bench.state.T_world_object, shifted(0.3))


def test_an_offer_can_be_dismissed(bench):
    snap_id = bench.session.snap(Actor.HUMAN)
    bench.drag(shifted(0.3))
    bench.workers.snaps[0].end(result(shifted(0.5)))
    bench.session.dismiss(Actor.HUMAN)
    assert bench.state.offer is None
    assert np.array_equal(bench.state.T_world_object, shifted(0.3))
    assert (bench.log.kinds[-1], bench.log.events[-1].snap_id) == ("dismiss", snap_id)
    with pytest.raises(ActionError, match="offers no pose"):
        bench.session.accept(Actor.HUMAN)
    with pytest.raises(ActionError, match="offers no pose"):
        bench.session.dismiss(Actor.HUMAN)


def test_the_newest_request_wins(bench):
    first = bench.session.snap(Actor.HUMAN)
    second = bench.session.snap(Actor.HUMAN)
    older, newer = bench.workers.snaps
    assert older.cancelled and not newer.cancelled
    cancelled = bench.log.events[1]
    assert (cancelled.kind, cancelled.snap_id) == ("snap_cancelled", first)
    assert cancelled.detail == {"reason": "superseded"}
    older.progress(0.9)
    older.end(result(shifted(0.9)))
    assert bench.state.snap.progress == 0.0
    assert np.array_equal(bench.state.T_world_object, START)
    newer.end(result(shifted(0.5)))
    assert bench.state.snap.id == second
    assert np.array_equal(bench.state.T_world_object, shifted(0.5))
    assert bench.log.kinds == ["snap_requested", "snap_cancelled", "snap_requested", "snap_applied"]


def test_a_cancelled_snap_brings_nothing_any_more(bench):
    bench.session.snap(Actor.HUMAN)
    bench.session.cancel_snap(Actor.SCRIPT)
    (snap,) = bench.workers.snaps
    assert snap.cancelled and bench.state.snap.state == "cancelled"
    snap.progress(0.9)
    snap.end(result(shifted(0.9)))
    assert bench.state.snap.state == "cancelled"
    assert np.array_equal(bench.state.T_world_object, START)
    assert bench.log.kinds == ["snap_requested", "snap_cancelled"]
    assert bench.log.events[-1].actor == Actor.SCRIPT
    bench.session.cancel_snap(Actor.HUMAN)
    assert len(bench.log.events) == 2


def test_a_cancel_that_cannot_be_recorded_leaves_the_snap_alone(bench):
    bench.session.snap(Actor.HUMAN)
    (snap,) = bench.workers.snaps
    bench.log.broken = True
    with pytest.raises(OSError, match="no space left"):
        bench.session.cancel_snap(Actor.HUMAN)
    assert not snap.cancelled and bench.state.snap.is_live
    bench.log.broken = False
    snap.end(result(shifted(0.5)))
    assert bench.state.snap.state == "done"


def test_a_failed_snap_says_why_and_another_may_follow(bench):
    bench.session.snap(Actor.HUMAN)
    bench.workers.snaps[0].end(SnapError("The worker died."))
    assert (bench.state.snap.state, bench.state.snap.message) == ("failed", "The worker died.")
    failed = bench.log.events[-1]
    assert (failed.kind, failed.actor) == ("snap_failed", Actor.MACHINE)
    assert failed.detail == {"message": "The worker died."}
    bench.session.snap(Actor.HUMAN)
    assert (bench.state.snap.state, bench.state.snap.message) == ("queued", None)


def test_a_failure_that_comes_at_once_is_told_too():
    def refuse(order, on_progress, on_end):
        on_end(SnapError("out of view"))
        return lambda: None

    bench = Bench(request_snap=refuse)
    bench.session.snap(Actor.HUMAN)
    assert bench.state.snap is not None
    assert (bench.state.snap.state, bench.state.snap.message) == ("failed", "out of view")


def test_a_result_that_cannot_be_recorded_is_not_applied(bench):
    bench.session.snap(Actor.HUMAN)
    bench.log.broken = True
    with pytest.raises(OSError, match="no space left"):
        bench.workers.snaps[0].end(result(shifted(0.5)))
    assert np.array_equal(bench.state.T_world_object, START)
    assert bench.state.snap.state == "failed"
    assert "no space left" in bench.state.snap.message
    assert not bench.state.can_undo
