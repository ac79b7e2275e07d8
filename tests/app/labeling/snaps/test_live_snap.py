"""Live snapping: the newest pose wins, one look at a time, and only what is accepted is written down."""

import threading
from collections.abc import Callable

import numpy as np
import pytest

from app.labeling.moves.pose_record import ActionError
from app.labeling.session_state import SessionState
from app.labeling.snaps.machine import LIVE_SEED
from app.labeling.snaps.snap_exchange import SnapOrder, SnapResult
from app.storage.roles import Actor
from app.workers.pool import SnapError
from registration_core import SnapConfig
from tests.app.labeling.bench import FRAMES, START, Bench, RequestedSnap, result, shifted
from tests.app.waiting import LONGEST


@pytest.fixture
def live() -> Bench:
    """A session whose operator has turned live snapping on and dragged the object to 0.1."""
    bench = Bench()
    bench.session.set_live(True, Actor.HUMAN)
    bench.workers.snaps[0].end(result(shifted(0.0)))
    bench.drag(shifted(0.1))
    bench.log.events.clear()
    return bench


def newest(bench: Bench) -> RequestedSnap:
    return bench.workers.snaps[-1]


def start_of(snap: RequestedSnap) -> np.ndarray:
    return snap.order.T_world_object


# -- the switch


def test_it_is_off_at_first_and_its_switch_is_logged():
    bench = Bench()
    bench.drag(shifted(0.1))
    assert not bench.state.is_live and bench.workers.snaps == []
    bench.session.set_live(True, Actor.HUMAN)
    bench.session.set_live(True, Actor.HUMAN)
    assert bench.state.is_live and len(bench.workers.snaps) == 1
    bench.session.set_live(False, Actor.SCRIPT)
    assert not bench.state.is_live
    switched = [(e.actor, e.detail) for e in bench.log.events if e.kind == "live"]
    assert switched == [(Actor.HUMAN, {"on": True}), (Actor.SCRIPT, {"on": False})]


def test_in_manual_it_cannot_be_turned_on():
    bench = Bench(condition="manual")
    with pytest.raises(ActionError, match="done by hand alone"):
        bench.session.set_live(True, Actor.HUMAN)
    bench.session.set_live(False, Actor.HUMAN)
    assert not bench.state.is_live and bench.log.events == []


def test_turned_off_it_shows_nothing_and_lets_go_of_the_look_under_way(live):
    newest(live).end(result(shifted(0.3)))
    live.session.start_drag()
    live.session.drag_to(shifted(0.2))
    live.session.set_live(False, Actor.HUMAN)
    assert newest(live).cancelled and live.state.live is None
    newest(live).end(result(shifted(0.3)))
    assert live.state.live is None
    assert live.log.kinds == ["live"]


# -- following


def test_a_look_starts_from_where_the_object_is_and_shows_where_a_snap_would_land(live):
    order = newest(live).order
    assert order.is_live and order.seed == LIVE_SEED and order.frame_id == FRAMES[0]
    assert np.array_equal(order.T_world_object, shifted(0.1))
    assert order.start_spread == pytest.approx((0.06, SnapConfig().spread.rotation))
    newest(live).end(result(shifted(0.3), 0.7))
    assert np.array_equal(live.state.live.T_world_object, shifted(0.3))
    assert live.state.live.assessment.confidence == 0.7
    assert np.array_equal(live.state.T_world_object, shifted(0.1))
    assert live.log.events == [] and live.log.estimates == []


def test_while_a_look_is_under_way_none_follows_and_then_the_newest_pose_does(live):
    live.session.start_drag()
    count = len(live.workers.snaps)
    for amount in (0.11, 0.12, 0.13):
        live.session.drag_to(shifted(amount))
    assert len(live.workers.snaps) == count
    newest(live).end(result(shifted(0.3)))
    assert len(live.workers.snaps) == count + 1
    assert np.array_equal(start_of(newest(live)), shifted(0.13))
    assert live.state.live is not None  # shown until there is a newer one
    newest(live).end(result(shifted(0.31)))
    assert len(live.workers.snaps) == count + 1  # the object rests: there is nothing new to see
    assert np.array_equal(live.state.live.T_world_object, shifted(0.31))


CHANGES: dict[str, Callable[[Bench], object]] = {
    "drag": lambda bench: bench.drag(shifted(0.2)),
    "set_pose": lambda bench: bench.session.set_pose(shifted(0.2), Actor.SCRIPT),
    "undo": lambda bench: bench.session.undo(Actor.HUMAN),
    "reset": lambda bench: bench.session.reset(Actor.HUMAN),
    "frame": lambda bench: bench.session.show_frame(FRAMES[1], Actor.HUMAN),
}


@pytest.mark.parametrize("change", CHANGES)
def test_every_change_is_followed(live, change):
    newest(live).end(result(shifted(0.3)))
    before = newest(live)
    CHANGES[change](live)
    assert newest(live) is not before
    assert np.array_equal(start_of(newest(live)), live.state.T_world_object)
    assert newest(live).order.frame_id == live.state.frame_id


def test_a_look_that_fails_shows_nothing_and_is_not_tried_again_from_there(live):
    newest(live).end(result(shifted(0.3)))
    live.drag(shifted(0.2))
    count = len(live.workers.snaps)
    newest(live).end(SnapError("outside the image"))
    assert live.state.live is None and live.state.snap is None
    assert len(live.workers.snaps) == count
    live.drag(shifted(0.25))
    assert len(live.workers.snaps) == count + 1


def test_a_look_that_fails_at_once_is_survived():
    orders = []

    def refuse(order, on_progress, on_end):
        orders.append(order)
        on_end(SnapError("out of view"))
        return lambda: None

    bench = Bench(request_snap=refuse)
    bench.session.set_live(True, Actor.HUMAN)
    bench.drag(shifted(0.1), shifted(0.2))
    assert len(orders) == 3
    assert bench.state.live is None


def test_a_pose_that_the_machine_found_needs_no_look(live):
    live.session.snap(Actor.HUMAN)
    newest(live).end(result(shifted(0.3)))
    assert live.state.live is None
    assert not newest(live).order.is_live
    live.session.undo(Actor.HUMAN)
    assert newest(live).order.is_live


# -- taking it


def test_what_is_shown_is_accepted_with_its_estimate_in_one_go(live):
    look = newest(live)
    look.end(result(shifted(0.3), 0.7))
    live.session.accept(Actor.HUMAN)
    assert np.array_equal(live.state.T_world_object, shifted(0.3))
    assert live.state.confidence == 0.7 and live.state.live is None
    (accept,) = live.log.events
    assert (accept.kind, accept.actor, accept.snap_id) == ("accept", Actor.HUMAN, look.order.snap_id)
    assert np.array_equal(accept.T_before, shifted(0.1)) and np.array_equal(accept.T_after, shifted(0.3))
    (row,) = live.log.estimates
    assert (row.snap_id, row.seed, row.frame_id) == (look.order.snap_id, LIVE_SEED, FRAMES[0])
    assert np.array_equal(row.T_world_object_start, shifted(0.1))
    assert look.order.start_spread is not None
    assert row.start_spread == list(look.order.start_spread)
    live.session.undo(Actor.HUMAN)
    assert np.array_equal(live.state.T_world_object, shifted(0.1))


def test_it_is_accepted_out_of_the_hand_which_then_moves_nothing_any_more(live):
    live.session.start_drag()
    live.session.drag_to(shifted(0.15))
    newest(live).end(result(shifted(0.3)))
    told: list[SessionState] = []
    live.session.accept(Actor.HUMAN)
    live.session.drag_to(shifted(0.16))
    live.session.subscribe(told.append)
    live.session.end_drag()
    assert live.log.kinds == ["drag", "accept"]
    assert np.array_equal(live.log.events[0].T_after, shifted(0.15))
    assert np.array_equal(told[-1].T_world_object, shifted(0.3))  # so that the view puts the gizmo there


def test_what_cannot_be_written_down_is_not_accepted(live):
    newest(live).end(result(shifted(0.3)))
    live.log.broken = True
    with pytest.raises(OSError, match="no space left"):
        live.session.accept(Actor.HUMAN)
    assert np.array_equal(live.state.T_world_object, shifted(0.1))
    assert live.state.live is not None


# -- with an ordinary snap


def test_an_ordinary_snap_goes_first(live):
    look = newest(live)
    live.session.snap(Actor.HUMAN)
    assert look.cancelled and live.state.live is None
    live.drag(shifted(0.2))
    assert not newest(live).order.is_live  # nobody looks before the snap has ended
    newest(live).end(result(shifted(0.3)))
    assert live.state.offer is not None and live.state.live is None
    live.session.dismiss(Actor.HUMAN)
    assert newest(live).order.is_live
    assert np.array_equal(start_of(newest(live)), shifted(0.2))


def test_in_a_drag_what_is_seen_live_takes_the_place_of_an_older_offer(live):
    live.session.snap(Actor.HUMAN)
    live.session.start_drag()
    live.session.drag_to(shifted(0.2))
    newest(live).end(result(shifted(0.3)))
    assert live.state.offer is not None
    newest(live).end(result(shifted(0.35)))
    assert live.state.offer is None
    assert np.array_equal(live.state.live.T_world_object, shifted(0.35))


def test_submitting_and_closing_end_it(live):
    look = newest(live)
    live.session.submit(Actor.HUMAN)
    assert look.cancelled and live.state.live is None
    with pytest.raises(ActionError, match="submitted"):
        live.session.set_live(False, Actor.HUMAN)
    other = Bench()
    other.session.set_live(True, Actor.HUMAN)
    other.session.close()
    other.session.set_pose(shifted(0.1), Actor.SCRIPT)
    assert len(other.workers.snaps) == 1 and other.workers.snaps[0].cancelled


# -- with threads


class BusyWorkers:
    """Answers each order from a thread of its own; counts how many are at work at once."""

    def __init__(self) -> None:
        self.orders: list[SnapOrder] = []
        self.at_work = 0
        self.most = 0
        self._count = threading.Lock()

    def __call__(
        self,
        order: SnapOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SnapResult | SnapError], None],
    ) -> Callable[[], None]:
        with self._count:
            self.orders.append(order)
            self.at_work += 1
            self.most = max(self.most, self.at_work)

        def work() -> None:
            with self._count:
                self.at_work -= 1
            on_end(result(order.T_world_object, 0.5))

        threading.Thread(target=work).start()
        return lambda: None


def test_the_last_pose_of_a_drag_is_looked_at_whatever_the_threads_do():
    workers = BusyWorkers()
    bench = Bench(request_snap=workers)
    arrived = threading.Event()
    last = shifted(0.2)

    def listen(state: SessionState) -> None:
        if state.live is not None and np.array_equal(state.live.T_world_object, last):
            arrived.set()

    bench.session.subscribe(listen)
    bench.session.set_live(True, Actor.HUMAN)
    bench.drag(*(shifted(0.001 * i) for i in range(1, 201)), last)
    assert arrived.wait(LONGEST)
    assert workers.most == 1
    ways = [order.T_world_object[:3, 3] @ START[:3, 0] for order in workers.orders]
    assert ways == sorted(ways)
    assert bench.log.kinds == ["live", "drag"]
