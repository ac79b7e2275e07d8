"""Gaps in a log and clocks that jump are found."""

from app.analysis.trace.log_faults import faults_of
from app.analysis.trace.logs import LoggedRow
from tests.app.analysis.hand_made import Entry


def rows_of(*entries: Entry, skip: int = 0) -> list[LoggedRow]:
    """Numbered as the log does; `skip` events are missing before the last one."""
    return [
        LoggedRow(
            i + 1 + (skip if i == len(entries) - 1 else 0),
            entry.kind,
            entry.actor,
            entry.utc,
            entry.monotonic_seconds,
            entry.boot_id,
            None,
            None,
            None,
            None,
            "{}",
        )
        for i, entry in enumerate(entries)
    ]


def test_a_whole_log_has_none_even_over_runs_of_the_server():
    rows = rows_of(Entry(0, "opened"), Entry(5, "drag"), Entry(90, "submit", boot_id="b", clock=2.0))
    assert faults_of(rows) == []


def test_a_gap_is_named():
    (fault,) = faults_of(rows_of(Entry(0, "opened"), Entry(5, "submit"), skip=2))
    assert fault == ("the log has a gap: events 2 to 3 are missing", True)
    (fault,) = faults_of(rows_of(Entry(0, "opened"), Entry(5, "submit"), skip=1))
    assert fault.text.endswith("event 2 is missing")


def test_an_end_that_is_missing_is_named_though_no_number_is_left_out():
    lost = ("the log has a gap: its end with the submission is missing", True)
    assert faults_of(rows_of(Entry(0, "opened"), Entry(5, "drag"))) == [lost]
    assert faults_of(rows_of(Entry(0, "opened"), Entry(5, "submit"), Entry(6, "reopen"))) == [lost]
    assert faults_of(rows_of(Entry(0, "opened"), Entry(5, "submit"), Entry(6, "view"))) == []


def test_utc_that_jumps_within_one_run_does_no_harm():
    (fault,) = faults_of(
        rows_of(Entry(0, "opened"), Entry(5, "drag", late=-3600), Entry(9, "submit", late=-3600))
    )
    assert fault == ("the clock was put back by 3600 s; the server's steady clock was used", False)


def test_utc_that_jumps_where_runs_are_joined_by_it_spoils_the_times():
    faults = faults_of(
        rows_of(
            Entry(0, "opened"),
            Entry(5, "drag", late=60),
            Entry(9, "submit", boot_id="b", late=60),
        )
    )
    assert [fault.spoils_times for fault in faults] == [True]
    assert "forward by 60 s" in faults[0].text
    (fault,) = faults_of(rows_of(Entry(60, "opened"), Entry(70, "submit", boot_id="b", late=-40.0)))
    assert fault == ("the clock was put back by 30 s between two runs of the server", True)


def test_a_steady_clock_that_goes_back_spoils_the_times():
    faults = faults_of(rows_of(Entry(0, "opened"), Entry(5, "drag"), Entry(6, "submit", clock=900.0)))
    assert any(fault.spoils_times and "went back by 99.0 s" in fault.text for fault in faults)
