"""Traces of logs made by hand."""

import numpy as np
import pytest

from app.analysis.trace.trace import Span, trace_of, until_submission
from tests.app.analysis.hand_made import START, Entry, at, drag, moved, view


def test_between_events_the_pose_holds_and_inside_a_drag_its_path_counts():
    trace = trace_of(
        START,
        [
            Entry(0.0, "opened"),
            drag(4.0, 2.0, START, at(0.3), at(0.2)),
            moved(6.0, "undo", START),
            moved(7.0, "redo", at(0.2)),
            moved(8.0, "submit", at(0.2)),
        ],
    )
    x = trace.motion.at([1.9, 2.5, 3.0, 3.5, 4.0, 5.9, 6.0, 6.9, 7.0, 8.0])[:, 0, 3]
    assert x == pytest.approx([0, 0.15, 0.3, 0.25, 0.2, 0.2, 0, 0, 0.2, 0.2], abs=1e-6)
    assert trace.duration == 8.0
    assert np.allclose(trace.T_world_object, at(0.2))


def test_what_is_only_offered_moves_nothing_until_it_is_accepted():
    events = [
        Entry(0.0, "opened"),
        Entry(1.0, "snap_requested", snap_id="a"),
        moved(3.0, "snap_offered", at(0.5), actor="machine", snap_id="a", duration_seconds=0.1),
        moved(5.0, "accept", at(0.5), snap_id="a"),
    ]
    trace = trace_of(START, events)
    assert trace.motion.at([4.9, 5.0])[:, 0, 3] == pytest.approx([0, 0.5])
    assert trace.spans[2] == Span(1.0, 3.0)  # from the request to the result


def test_runs_of_the_server_are_joined_by_utc():
    trace = trace_of(
        START,
        [
            Entry(10.0, "opened"),
            moved(12.0, "set_pose", at(0.1), late=5.0),  # UTC was put forward: the clock of the run counts
            Entry(20.0, "opened", boot_id="second", clock=3.0),
            moved(21.5, "set_pose", at(0.2), boot_id="second", clock=3.0, late=5.0),
        ],
    )
    assert [span.end for span in trace.spans] == pytest.approx([0.0, 2.0, 10.0, 11.5])
    assert trace.motion.at([1.9, 2.0, 11.4, 11.5])[:, 0, 3] == pytest.approx([0, 0.1, 0.1, 0.2])


def test_utc_that_was_put_back_between_runs_does_not_turn_time_back():
    events = [
        Entry(0.0, "opened"),
        moved(60.0, "set_pose", at(0.1)),
        Entry(70.0, "opened", boot_id="b", late=-40.0),
    ]
    assert [span.end for span in trace_of(START, events).spans] == [0.0, 60.0, 60.0]


def test_idle_is_ten_seconds_without_input_and_without_the_camera():
    trace = trace_of(
        START,
        [
            Entry(0.0, "opened"),
            view(9.0, 1.0),
            Entry(12.0, "snap_requested", snap_id="a"),
            moved(20.0, "snap_applied", at(0.1), actor="machine", snap_id="a"),  # the machine is no input
            drag(40.0, 15.0, at(0.1), at(0.2)),  # a long drag is no rest
            moved(60.0, "submit", at(0.2)),
        ],
    )
    assert trace.idle == (Span(12.0, 25.0), Span(40.0, 60.0))
    assert trace.is_idle([11.0, 12.0, 13.0, 25.0, 30.0, 59.0]).tolist() == [
        False,
        False,
        True,
        False,
        False,
        True,
    ]


def test_samples_go_from_the_first_sight_to_the_end():
    trace = trace_of(START, [Entry(0.0, "opened"), view(2.0, 1.0), moved(3.2, "submit", START)])
    assert trace.first_sight == 1.0
    assert trace.sample_times() == pytest.approx([1.0, 1.5, 2.0, 2.5, 3.0, 3.2])


def test_nothing_after_the_submission_counts():
    events = [Entry(0.0, "opened"), moved(3.0, "submit", START), Entry(100.0, "opened")]
    assert [event.kind for event in until_submission(events)] == ["opened", "submit"]
    assert until_submission(events[:1]) == events[:1]
    events += [Entry(101.0, "reopen"), moved(105.0, "set_pose", at(0.1))]
    assert until_submission(events) == events
    skipped = [*events, Entry(110.0, "skip"), Entry(200.0, "opened")]
    assert until_submission(skipped) == skipped[:-1]


def test_an_empty_log_is_a_moment():
    trace = trace_of(at(0.4), [])
    assert trace.duration == 0.0
    assert np.allclose(trace.T_world_object, at(0.4))
    assert trace.sample_times().tolist() == [0.0]
    assert trace.idle == ()


def test_a_long_log_is_followed_to_its_end():
    x = 0.001 * np.arange(301)
    ways = zip(map(at, x), map(at, x[1:]), strict=False)
    events = [Entry(0.0, "opened"), *(drag(2.0 * i, 1.0, *way) for i, way in enumerate(ways, start=1))]
    ends = 2.0 * np.arange(1, 301)
    motion = trace_of(START, events).motion
    assert motion.at(ends)[:, 0, 3] == pytest.approx(x[1:])
    assert motion.at(ends - 0.5)[:, 0, 3] == pytest.approx((x[1:] + x[:-1]) / 2)
