"""The labelling session with a log and workers that the test holds in its hands."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np
import pytest

from app.auth import Actor
from app.event_log import NewEvent
from app.labeling.history import History, Step
from app.labeling.layers import Layers
from app.labeling.search import SearchOrder, SearchResult
from app.labeling.session import BROKEN_DRAG, LabelingSession, SessionState
from app.labeling.snap_exchange import SnapFailure, SnapOrder, SnapResult
from app.labeling.track import ActionError
from app.tables import Condition, EstimateRow
from registration_core import Ambiguity, Estimate, Hypothesis, SnapConfig, pose
from tests.app.labeling.test_degrees_of_freedom import about, turn

START = pose.exp([0.1, 0.2, 0.8, 0.3, -0.2, 0.1])
FRAMES = (11, 12)
PIVOT = np.array([0.02, -0.01, 0.03])


def shifted(amount: float, axis: int = 0) -> np.ndarray:
    twist = np.zeros(6)
    twist[axis] = amount
    return START @ pose.exp(twist)


class Log:
    """Keeps what is recorded; or breaks."""

    def __init__(self) -> None:
        self.events: list[NewEvent] = []
        self.estimates: list[EstimateRow] = []
        self.broken = False
        self.watch: Callable[[], object] = lambda: None

    def __call__(self, event: NewEvent, estimate: EstimateRow | None = None) -> None:
        self.watch()
        if self.broken:
            raise OSError("no space left")
        self.events.append(event)
        if estimate is not None:
            self.estimates.append(estimate)

    @property
    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]


@dataclass
class RequestedSnap:
    """A snap that a session asked for, moved on by hand."""

    order: SnapOrder
    progress: Callable[[float], None]
    end: Callable[[SnapResult | SnapFailure], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True


@dataclass
class Workers:
    """Takes orders and does nothing by itself."""

    snaps: list[RequestedSnap] = field(default_factory=list)

    def __call__(
        self,
        order: SnapOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SnapResult | SnapFailure], None],
    ) -> Callable[[], None]:
        self.snaps.append(RequestedSnap(order, on_progress, on_end))
        return self.snaps[-1].cancel


@dataclass
class RequestedSearch:
    """A search that a session asked for, moved on by hand."""

    order: SearchOrder
    progress: Callable[[float], None]
    end: Callable[[SearchResult | SnapFailure], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True


@dataclass
class Searchers:
    """Takes searches and does nothing by itself."""

    searches: list[RequestedSearch] = field(default_factory=list)

    def __call__(
        self,
        order: SearchOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SearchResult | SnapFailure], None],
    ) -> Callable[[], None]:
        self.searches.append(RequestedSearch(order, on_progress, on_end))
        return self.searches[-1].cancel


def result(T: np.ndarray, confidence: float = 0.9) -> SnapResult:
    estimate = Estimate(
        T_camera_object=T,
        confidence=confidence,
        covariance=np.eye(6) * 1e-6,
        hypotheses=(Hypothesis(T, 0.7), Hypothesis(START, 0.3)),
        seconds=0.25,
        evaluations=1234,
        converged=True,
        ambiguities=(Ambiguity("free motion", "turn", (0.0, 0.0, 1.0), 0.4),),
        seed=5,
    )
    return SnapResult(estimate, T, "1.2.3", "a test machine")


class Bench:
    """A session between a log and workers."""

    def __init__(self, state: str = "open", condition: Condition = "snap", in_study: bool = False) -> None:
        self.log = Log()
        self.workers = Workers()
        self.searchers = Searchers()
        self.session = LabelingSession(
            registration_id=7,
            history=History((Step(START),)),
            state=state,
            frame_id=FRAMES[0],
            frame_ids=FRAMES,
            pivot=PIVOT,
            condition=condition,
            same_pose=lambda a, b: bool(np.allclose(a, b, atol=0.005)),
            record_event=self.log,
            request_snap=self.workers,
            request_search=self.searchers,
            in_study=in_study,
        )

    @property
    def state(self) -> SessionState:
        return self.session.snapshot()

    def drag(self, *way: np.ndarray) -> None:
        self.session.start_drag()
        for T in way:
            self.session.drag_to(T)
        self.session.end_drag()


@pytest.fixture
def bench() -> Bench:
    return Bench()


def same(a: SessionState, b: SessionState) -> bool:
    """Whether nothing changed but the revision and the message."""
    names = set(a.__dataclass_fields__) - {"revision", "message", "T_world_object"}
    return np.array_equal(a.T_world_object, b.T_world_object) and all(
        getattr(a, name) == getattr(b, name) for name in names
    )


# -- dragging


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


@pytest.mark.parametrize("action", ["undo", "redo", "reset", "submit", "accept"])
def test_while_the_object_is_held_nothing_else_may_move_it(bench, action):
    bench.session.start_drag()
    with pytest.raises(ActionError, match="let go"):
        getattr(bench.session, action)(Actor.SCRIPT)
    with pytest.raises(ActionError, match="let go"):
        bench.session.set_pose(shifted(1.0), Actor.SCRIPT)
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


def test_what_the_view_shows_is_chosen_at_any_time_and_is_no_event(bench):
    chosen = Layers(cloud=False, agreement=True)
    bench.session.start_drag()
    bench.session.show_layers(chosen)
    assert bench.state.layers == chosen
    assert bench.state.dragging
    assert bench.log.events == []


def test_a_move_starts_from_the_present_pose_and_says_how(bench):
    for _ in range(3):
        bench.session.move(lambda T: T @ pose.exp([0.01, 0, 0, 0, 0, 0]), Actor.HUMAN, "nudge")
    assert np.allclose(bench.state.T_world_object, shifted(0.03))
    assert [event.detail for event in bench.log.events] == [{"technique": "nudge"}] * 3
    bench.session.start_drag()
    with pytest.raises(ActionError, match="being dragged"):
        bench.session.move(lambda T: pytest.fail("it is held"), Actor.HUMAN, "nudge")


# -- record first


ACTIONS: dict[str, Callable[[LabelingSession], object]] = {
    "drag": lambda session: (session.start_drag(), session.drag_to(shifted(0.1)), session.end_drag()),
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


# -- undo, redo, reset


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


# -- snaps


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
    }
    assert (applied.kind, applied.actor, applied.snap_id) == ("snap_applied", Actor.MACHINE, snap_id)
    assert np.array_equal(applied.T_before, START) and np.array_equal(applied.T_after, shifted(0.05))
    assert applied.detail == {"confidence": 0.8}
    (row,) = bench.log.estimates
    assert (row.snap_id, row.registration_id, row.frame_id, row.seed) == (snap_id, 7, FRAMES[0], 42)
    assert (row.version, row.hardware, row.seconds) == ("1.2.3", "a test machine", 0.25)
    assert row.config == SnapConfig.paper().to_dict() and row.start_spread is None
    assert row.hypotheses[1] == {"T_camera_object": START.tolist(), "weight": 0.3}
    (ambiguity,) = row.ambiguities
    assert ambiguity == {"kind": "free motion", "motion": "turn", "axis": (0.0, 0.0, 1.0), "extent": 0.4}


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


MOVES: dict[str, Callable[[Bench], object]] = {
    "drag": lambda bench: bench.drag(shifted(0.3)),
    "set_pose": lambda bench: bench.session.set_pose(shifted(0.3), Actor.SCRIPT),
    "undo": lambda bench: bench.session.undo(Actor.HUMAN),
    "reset": lambda bench: bench.session.reset(Actor.HUMAN),
    "undo, then drag": lambda bench: (bench.session.undo(Actor.HUMAN), bench.drag(shifted(0.3))),
    "two undone, one redone": lambda bench: (
        bench.session.undo(Actor.HUMAN),
        bench.session.undo(Actor.HUMAN),
        bench.session.redo(Actor.HUMAN),
    ),
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
    assert bench.state.offer.snap_id == snap_id and bench.state.offer.confidence == 0.6
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
    assert (accept.kind, accept.snap_id, accept.detail) == ("accept", snap_id, {"confidence": 0.6})
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
    bench.workers.snaps[0].end(SnapFailure("The worker died."))
    assert (bench.state.snap.state, bench.state.snap.message) == ("failed", "The worker died.")
    failed = bench.log.events[-1]
    assert (failed.kind, failed.actor) == ("snap_failed", Actor.MACHINE)
    assert failed.detail == {"message": "The worker died."}
    bench.session.snap(Actor.HUMAN)
    assert (bench.state.snap.state, bench.state.snap.message) == ("queued", None)


def test_a_failure_that_comes_at_once_is_told_too():
    bench = Bench()

    def refuse(order, on_progress, on_end):
        on_end(SnapFailure("out of view"))
        return lambda: None

    bench.session._request_snap = refuse
    bench.session.snap(Actor.HUMAN)
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


def test_where_the_operator_looks_from_is_logged_and_is_no_step() -> None:
    bench = Bench()
    camera = {"position": [0.0, 0.0, 1.0], "look_at": [0.0, 0.0, 0.0], "up": [0.0, 1.0, 0.0], "fov": 0.8}
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
