"""Finding the object without a start, and looking at a pose before taking it, with workers held in hand."""

import numpy as np
import pytest

from app.labeling.moves.pose_record import ActionError
from app.storage.roles import Actor
from app.workers.jobs import Proposals
from app.workers.pool import SnapError
from registration_core import Hypothesis, SnapConfig
from tests.app.labeling.bench import FRAMES, START, Bench, result, shifted

FOUND = Proposals(
    (Hypothesis(START, 0.75), Hypothesis(shifted(0.1), 0.25)), 0.2, "0123456789ab", "a test machine"
)


def test_a_search_is_recorded_with_all_that_repeats_it_and_moves_nothing(bench):
    search_id = bench.session.search(Actor.HUMAN, (1, 2, 30, 40), seed=5)
    (search,) = bench.searchers.searches
    assert (search.order.region, search.order.seed, search.order.frame_id) == ((1, 2, 30, 40), 5, FRAMES[0])
    assert bench.state.search.state == "queued"
    search.progress(0.0)
    assert bench.state.search.state == "running"
    search.end(FOUND)
    assert bench.state.search.state == "done"
    requested, done = bench.log.events
    assert requested.detail == {
        "seed": 5,
        "config": SnapConfig().to_dict(),
        "region": [1, 2, 30, 40],
        "frame_id": FRAMES[0],
        "known_objects": [],
    }
    assert {event.snap_id for event in bench.log.events} == {search_id}
    assert [one["weight"] for one in done.detail["candidates"]] == [0.75, 0.25]
    assert np.array_equal(done.detail["candidates"][1]["T_camera_object"], shifted(0.1))
    assert (done.kind, done.actor, done.duration_seconds) == ("search_done", Actor.MACHINE, 0.2)
    assert np.array_equal(bench.state.T_world_object, START)


def test_the_newest_search_wins(bench):
    bench.session.search(Actor.HUMAN)
    newest = bench.session.search(Actor.HUMAN)
    first, second = bench.searchers.searches
    assert first.cancelled and not second.cancelled
    first.end(FOUND)
    assert bench.state.search.id == newest and bench.state.search.state == "queued"
    assert bench.log.kinds == ["search_requested", "search_cancelled", "search_requested"]


def test_a_search_is_cancelled_and_its_candidates_are_put_away(bench):
    bench.session.search(Actor.HUMAN)
    bench.session.leave_search(Actor.HUMAN)
    assert bench.searchers.searches[0].cancelled and bench.state.search is None
    bench.session.search(Actor.HUMAN)
    bench.searchers.searches[1].end(FOUND)
    bench.session.preview(shifted(0.1))
    bench.session.leave_search(Actor.HUMAN)
    assert bench.state.search is None and bench.state.preview is None
    assert "set_pose" not in bench.log.kinds


def test_a_failed_search_says_why(bench):
    bench.session.search(Actor.HUMAN)
    bench.searchers.searches[0].end(SnapError("The worker died."))
    assert (bench.state.search.state, bench.state.search.message) == ("failed", "The worker died.")
    assert bench.log.events[-1].detail == {"message": "The worker died."}


def test_candidates_that_cannot_be_saved_are_not_shown(bench):
    bench.session.search(Actor.HUMAN)
    bench.log.broken = True
    with pytest.raises(OSError, match="no space"):
        bench.searchers.searches[0].end(FOUND)
    assert bench.state.search.state == "failed" and "no space" in bench.state.search.message


def test_taking_a_candidate_is_logged_with_where_it_stems_from_and_undone(bench):
    search_id = bench.session.search(Actor.HUMAN)
    bench.searchers.searches[0].end(FOUND)
    bench.session.preview(shifted(0.1))
    assert np.array_equal(bench.state.preview, shifted(0.1))
    bench.session.set_pose(shifted(0.1), Actor.HUMAN, "proposal", {"stems_from": search_id})
    assert bench.log.events[-1].detail == {"technique": "proposal", "stems_from": search_id}
    assert bench.state.search is None and bench.state.preview is None
    bench.session.undo(Actor.HUMAN)
    assert np.array_equal(bench.state.T_world_object, START)


def test_a_preview_goes_away_with_the_pose_that_it_was_looked_at_from(bench):
    bench.session.preview(shifted(0.1))
    bench.session.start_drag()
    held = bench.state
    assert held.preview is None
    bench.session.end_drag()
    assert np.array_equal(bench.state.preview, shifted(0.1))
    bench.session.snap(Actor.HUMAN)
    bench.workers.snaps[0].end(result(shifted(0.2)))
    assert bench.state.preview is None
    bench.session.preview(None)
    assert bench.state.preview is None


def test_submitting_ends_a_search(bench):
    bench.session.search(Actor.HUMAN)
    bench.session.submit(Actor.HUMAN)
    assert bench.searchers.searches[0].cancelled and bench.state.search is None
    for act in (lambda: bench.session.search(Actor.HUMAN), lambda: bench.session.preview(START)):
        with pytest.raises(ActionError, match="submitted"):
            act()


def test_in_manual_nothing_is_looked_for():
    bench = Bench(condition="manual")
    with pytest.raises(ActionError, match="done by hand alone"):
        bench.session.search(Actor.HUMAN)
    assert bench.log.kinds == [] and bench.searchers.searches == []


def test_the_state_tells_the_snap_that_the_pose_stems_from(bench):
    snap_id = bench.session.snap(Actor.HUMAN)
    bench.workers.snaps[0].end(result(shifted(0.2)))
    assert bench.state.estimate_snap_id == snap_id
    bench.session.start_drag()
    assert bench.state.estimate_snap_id is None
    bench.session.drag_to(shifted(0.3))
    bench.session.end_drag()
    assert bench.state.estimate_snap_id is None
    bench.session.undo(Actor.HUMAN)
    assert bench.state.estimate_snap_id == snap_id
