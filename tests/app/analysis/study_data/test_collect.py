"""From the database to traces, and what is said of the rest."""

from pathlib import Path

import numpy as np
import pytest

from app.analysis.statistics.cells import cells_of
from app.analysis.statistics.curves import MARGINS, Timing
from app.analysis.study_data.collect import trials_of
from app.config import Settings
from app.storage.database import Database
from app.storage.tables import utc_now
from registration_core import ALGORITHM
from tests.app.analysis.hand_made import Entry, at, moved, view
from tests.app.analysis.hand_made_study import HandMadeStudy, every_half_second, two_moves


@pytest.fixture
def database(state_dir: Path):
    opened = Database(Settings(state_dir=state_dir).resolved_database_url)
    yield opened
    opened.close()


def said(collected) -> str:
    return "\n".join(str(remark) for remark in collected.remarks)


def test_errors_are_those_from_the_mean_of_the_accurate_registrations_by_hand(database):
    study = HandMadeStudy(database, groups={"novice": 2})
    one, other = study.participant("P1"), study.participant("P2")
    study.trial(one, two_moves(3.0, 6.0, at(0.0)))
    study.trial(other, two_moves(4.0, 8.0, at(0.002, 0.02)))
    study.trial(other, two_moves(2.0, 3.0, at(0.011, 0.01)), mode="quick")
    collected = trials_of(database, study.id)
    (place,) = collected.truths
    assert place.truth.count == 2 and place.from_reference is None
    assert np.allclose(place.truth.T_world_object, at(0.001, 0.01))
    assert (place.truth.translation_spread, place.truth.rotation_spread) == pytest.approx((0.001, 0.01))
    accurate, _, quick = collected.trials
    assert accurate.seconds == pytest.approx(np.arange(0, 5.5, 0.5))
    assert accurate.errors.translation == pytest.approx([0.099] * 4 + [0.049] * 6 + [0.001])
    assert accurate.errors.rotation == pytest.approx([0.99] * 4 + [0.49] * 6 + [0.01])
    assert quick.errors.translation[-1] == pytest.approx(0.01)
    assert (quick.operator, quick.group, quick.mode, quick.condition) == ("P2", "novice", "quick", "manual")
    assert collected.groups == {"novice": 2} and not collected.is_simulated
    assert "none were computed; there are no STG curves until `snap6d study snap` computes them" in said(
        collected
    )

    (cell, *_) = cells_of(collected.trials[:2], Timing(), seed=0)
    half = np.abs(MARGINS["translation"] - 0.0501).argmin()
    assert MARGINS["translation"][half] > 0.049
    assert cell.human.curve.mean[half] == pytest.approx((2.0 + 3.0) / 2)  # 3 s and 4 s less the first sight
    assert cell.human.curve.share[half] == 1.0 and cell.stg == {}


def test_snaps_are_put_beside_the_poses_that_they_began_from(database):
    study = HandMadeStudy(database)
    registration = study.trial(study.participant("P1"), two_moves(3.0, 6.0, at(0.0)))
    assert registration is not None
    study.snaps(registration, {1.0: at(0.2), 1.5: None})
    study.snaps(registration, {1.0 + 1e-9: at(0.003, 0.03)})  # computed again later: the newest counts
    collected = trials_of(database, study.id)
    (trial,) = collected.trials
    assert trial.stg["default"].errors.translation[0] == pytest.approx(0.003)
    assert trial.stg["default"].errors.rotation[0] == pytest.approx(0.03)
    assert np.isnan(trial.stg["default"].errors.translation[1:]).all()
    assert "offline snaps: 1 of 2 failed" in said(collected)
    # 5 s are sampled at 11 poses, two of which have their snap
    assert trial.missing_snaps() == 9 and "offline snaps: 9 of 11 sampled poses have none yet" in said(
        collected
    )
    assert collected.algorithm == ALGORITHM and "algorithm" not in said(collected)


def test_snaps_of_two_algorithms_are_never_mixed(database):
    study = HandMadeStudy(database)
    registration = study.trial(study.participant("P1"), two_moves(3.0, 6.0, at(0.0)))
    assert registration is not None
    study.snaps(registration, every_half_second(6.0, at(0.2)), algorithm=None)
    before = trials_of(database, study.id)
    assert before.algorithm is None and before.trials[0].stg_of_kind("translation") == pytest.approx(0.2)
    assert f"of a version that did not name its algorithm, while this version has algorithm {ALGORITHM};" in (
        said(before)
    )
    study.snaps(registration, dict(list(every_half_second(6.0, at(0.0)).items())[:3]))
    half_way = trials_of(database, study.id)
    assert half_way.algorithm is None and half_way.trials[0].stg_of_kind("translation") == pytest.approx(0.2)
    study.snaps(registration, dict(list(every_half_second(6.0, at(0.0)).items())[3:]))
    after = trials_of(database, study.id)
    assert after.algorithm == ALGORITHM and after.trials[0].stg_of_kind("translation") == pytest.approx(0.0)
    assert said(after) == ""


def test_whatever_is_left_out_is_said(database):
    study = HandMadeStudy(database, groups={"novice": 2, "expert": 1})
    good = two_moves(3.0, 6.0, at(0.0))
    one = study.participant("P1")
    gone = study.participant("P2", withdrawn_at=utc_now())
    study.trial(one, good)
    study.trial(one, good, is_practice=True, instance=91)
    study.trial(one, good, state="open", instance=92)
    study.trial(one, good, state="skipped", instance=93)
    study.trial(one, good, state=None, instance=94)
    study.trial(one, good, mode="quick", instance=95)  # nobody was accurate there
    study.trial(one, good, mode="quick", instance=96, reference=at(0.001))
    study.trial(one, good, mode="quick", skip_sequence=3)
    study.trial(one, [], condition="snap")
    study.trial(one, good[:-1], mode="quick", condition="auto")
    study.trial(gone, good)
    late = [Entry(0.0, "opened"), Entry(5.0, "drag", late=99.0), moved(9.0, "submit", at(0.0), late=99.0)]
    study.trial(one, late, condition="auto")
    collected = trials_of(database, study.id)
    text = said(collected)
    for words in (
        "P2: withdrew",
        "group expert: has no operators",
        "practice: 1 trial of practice tasks do not count",
        "#93, accurate, manual: was not submitted; left out",
        "#94, accurate, manual: was skipped (no depth); left out",
        "P1: did not begin 1 trial",
        "#96: has no ground truth, neither accurate registrations by hand nor a reference pose; 1 trial",
        "#97: has no accurate registration by hand; its reference pose is the ground truth",
        "quick, manual: the log has a gap: event 3 is missing; left out",
        "accurate, snap: has no log; left out",
        "quick, auto: the log has a gap: its end with the submission is missing; left out",
        "accurate, auto: the clock was put forward by 99 s; the server's steady clock was used",
    ):
        assert words in text
    assert [(trial.condition, trial.instance) for trial in collected.trials] == [
        ("manual", 90),
        ("manual", 96),
        ("auto", 90),
    ]
    assert collected.groups == {"novice": 1, "expert": 0}


def test_the_reference_pose_can_be_the_truth_and_the_mean_is_compared_with_it(database):
    study = HandMadeStudy(database)
    one = study.participant("P1", is_simulated=True)
    study.trial(one, two_moves(3.0, 6.0, at(0.0)), reference=at(0.004))
    study.trial(one, two_moves(3.0, 6.0, at(0.0)), instance=91)
    by_hand, given = trials_of(database, study.id), trials_of(database, study.id, "reference")
    assert by_hand.is_simulated and by_hand.trials[0].is_simulated
    assert by_hand.truths[0].from_reference is not None
    assert by_hand.truths[0].from_reference.translation == pytest.approx([0.004])
    assert given.trials[0].errors.translation[-1] == pytest.approx(0.004)
    assert given.trials[1].errors.translation[-1] == pytest.approx(0.0)
    assert "#92: has no reference pose; the mean by hand is its ground truth" in said(given)


def test_idle_time_is_marked_and_counted_apart(database):
    study = HandMadeStudy(database)
    entries = [
        Entry(0.0, "opened"),
        view(1.0, 0.0),
        moved(16.0, "set_pose", at(0.05)),
        moved(17.0, "submit", at(0.05)),
    ]
    study.trial(study.participant("P1"), entries)
    (trial,) = trials_of(database, study.id).trials
    assert trial.seconds[-1] == 16.0 and trial.active_seconds[-1] == pytest.approx(1.0)
    assert trial.idle.sum() == 29  # 1.5 s to 15.5 s of the trace, every half second


def test_a_study_that_is_not_there_is_said(database):
    with pytest.raises(LookupError, match="no study 99"):
        trials_of(database, 99)


def test_curves_of_snaps_begin_at_once_and_the_hand_off_is_found(database):
    study = HandMadeStudy(database)
    for code, end in (("P1", 6.0), ("P2", 8.0)):
        registration = study.trial(study.participant(code), two_moves(3.0, end, at(0.0)))
        assert registration is not None
        study.snaps(registration, every_half_second(end, at(0.0)))
    cell = cells_of(trials_of(database, study.id).trials, Timing(), seed=0)[0]
    stg = cell.stg["default"]
    assert stg.hand_off is not None
    assert (stg.curve.mean == 0.1).all() and (stg.curve.share == 1.0).all()
    # by hand below 99 mm at 2 s, below 50 mm at 5 s and 7 s: the curves part just below 100 mm
    assert stg.hand_off.margin == pytest.approx(MARGINS["translation"][1])
    assert stg.hand_off.saved == pytest.approx(6.0 - 0.1)


def test_snaps_by_the_papers_filter_stand_beside_those_by_the_default(database):
    study = HandMadeStudy(database)
    registration = study.trial(study.participant("P1"), two_moves(3.0, 6.0, at(0.0)))
    other = study.trial(study.participant("P2"), two_moves(3.0, 6.0, at(0.0)))
    assert registration is not None and other is not None
    for one in (registration, other):
        study.snaps(one, every_half_second(6.0, at(0.002)))
    study.snaps(registration, {1.0: at(0.02), 4.0: None, 6.0: at(0.01)}, method="paper")
    study.snaps(other, {1.0: at(0.02)}, method="paper", algorithm="an older one")
    collected = trials_of(database, study.id)
    first, second = collected.trials
    assert np.isfinite(first.stg_of_kind("translation")).all()
    paper = first.stg_of_kind("translation", "paper")
    assert paper[[0, -1]] == pytest.approx([0.02, 0.01]) and np.isnan(paper[1:-1]).all()
    assert list(second.stg) == ["default"]  # the other one is of another algorithm
    text = said(collected)
    about = "offline snaps by the paper's filter"
    assert f"{about}: 3 of 22 sampled poses have one" in text
    assert f"{about}: 1 of 2 trials have none at their end yet" in text and "--method paper" in text
    assert f"{about}: 1 of 3 failed" in text
    (cell, *_) = cells_of(collected.trials, Timing(paper_seconds=3.0), seed=0)
    assert list(cell.stg) == ["default", "paper"]
    assert cell.stg["default"].curve.mean[0] == 0.1 and cell.stg["paper"].curve.mean[0] == 3.0
