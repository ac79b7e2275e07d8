"""Ordinary work: times without idle, what became of the machine's poses, and the advice."""

from pathlib import Path

import numpy as np
import pytest

from app.analysis.team.advice import advice_for
from app.analysis.team.team import Work, team_rows, work_of
from app.analysis.trace.pose_errors import PoseErrors
from app.config import Settings
from app.storage.database import Database
from tests.app.analysis.hand_made import Entry, at, drag, moved, view
from tests.app.analysis.hand_made_study import START, HandMadeStudy, ordinary_work, snapped, two_moves
from tests.app.analysis.trials import NAN, trial


@pytest.fixture
def database(state_dir: Path):
    opened = Database(Settings(state_dir=state_dir).resolved_database_url)
    yield opened
    opened.close()


LOG = [
    Entry(0.0, "opened"),
    view(1.0, 0.0),
    drag(3.0, 1.0, START, at(0.06)),
    Entry(4.0, "snap_requested", snap_id="a"),
    snapped(5.0, "a", at(0.3)),
    moved(6.0, "undo", at(0.06)),
    Entry(7.0, "snap_requested", snap_id="b"),
    snapped(7.5, "b", at(0.1)),
    drag(9.0, 1.0, at(0.1), at(0.101)),
    snapped(9.5, "c", at(0.2), kind="snap_offered"),
    moved(25.5, "submit", at(0.101)),
]


def test_what_became_of_the_machine_s_poses_is_told(database):
    ordinary_work(database, "olga", LOG, instance=80)
    ordinary_work(database, "olga", LOG[:3], instance=81, state="open")
    study = HandMadeStudy(database)
    study.trial(study.participant("P1"), two_moves(3.0, 6.0, at(0.0)))
    (one,), remarks = work_of(database)
    assert remarks == []
    assert one.trial.operator == one.trial.group == "olga" and one.week == "2026-W01"
    assert one.starts.translation == pytest.approx([0.041, 0.041, 0.0])  # from where each was asked
    assert one.results.translation == pytest.approx([0.199, 0.001, 0.099])
    assert (one.accepted, one.snaps, one.drags_after) == (1, 3, 1)  # a was undone, c was only offered
    came = np.flatnonzero(np.isfinite(one.trial.stg_of_kind("translation")))
    assert one.trial.seconds[came] == pytest.approx([4.0, 6.5, 8.5])
    (row,) = team_rows([one])
    assert row.active_seconds == pytest.approx(8.0)  # from 1 s to 9 s; then 16.5 s of nothing
    assert (row.registrations, row.snaps, row.drags_after) == (1, 3.0, 1.0)
    assert row.accepted == pytest.approx(1 / 3)


def test_a_log_whose_times_cannot_be_trusted_is_left_out_and_said(database):
    entries = [LOG[0], moved(5.0, "submit", at(0.0), clock=10.0)]
    registration_id = ordinary_work(database, "olga", entries, instance=80)
    found, (remark,) = work_of(database)
    assert found == [] and remark.registration_id == registration_id
    assert "went back" in remark.text and "olga" in remark.about


def a_work(starts: list[float], results: list[float], came_at: int = 3) -> Work:
    turns = [0.1] * len(starts)
    stg = [NAN] * 4
    stg[came_at] = results[0]
    return Work(
        trial=trial([0.1, 0.05, 0.03, 0.0], [0.1] * 4, stg, operator="olga"),
        week="2026-W01",
        starts=PoseErrors(np.array(starts), np.array(turns)),
        results=PoseErrors(np.array(results), np.array([0.01] * len(results))),
        accepted=len(results),
        drags_after=0,
    )


def test_the_advice_is_the_largest_error_from_within_which_nine_of_ten_landed():
    near = a_work([0.01] * 9 + [0.05], [0.001] * 10)
    far = a_work([0.08, 0.09], [0.05, 0.05])
    advice = advice_for("olga", [near, far])
    assert advice.translation == 0.08 and advice.snaps == 12  # 10 of 11; with the next one 10 of 12
    # within 80 mm after 0.5 s, the first result after 1.5 s
    assert advice.dragged_on == pytest.approx(1.0)
    assert "from 80 mm and 5.73° on: 10 of 11 snaps" in advice.text


def test_too_few_snaps_and_snaps_that_never_land_give_no_error():
    assert (
        "Too few snaps for an advice: 2 of at least 10"
        in advice_for("olga", [a_work([0.1] * 2, [0.0] * 2)]).text
    )
    lost = advice_for("olga", [a_work([0.1] * 10, [0.5] * 10)])
    assert np.isnan(lost.translation) and "only 0 of 10 snaps landed" in lost.text
