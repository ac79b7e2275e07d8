"""Trials become the figures that they should."""

import math
from dataclasses import replace

import numpy as np
import pytest

from benchmarks.figures import Figure
from benchmarks.registration.instances import HALF, MORO
from benchmarks.registration.judging import Error
from benchmarks.registration.methods import DEFAULT, GICP, PROTOTYPE, TOLD
from benchmarks.registration.starts import GOOD, MIDDLE, SHELLS, Shell
from benchmarks.registration.targets import figures
from benchmarks.registration.trials import InstanceTrials, Trial

RIGHT = Error(add=0.01, mssd=0.02, translation=0.001, rotation=0.01)
WRONG = Error(add=0.5, mssd=0.6, translation=0.05, rotation=1.0)
START = Error(add=0.2, mssd=0.3, translation=0.02, rotation=0.3)


def trial(shell: Shell, start: int, method: str, error: Error, seconds: float, confidence: float) -> Trial:
    return Trial(
        HALF, "scene", 0, shell, start, method, START, error, np.eye(4), np.eye(4), False, seconds, confidence
    )


@pytest.fixture
def found() -> dict[str, Figure]:
    trials = [
        *(trial(SHELLS[0], n, DEFAULT, RIGHT if n else WRONG, 0.02, 0.9 if n else 0.2) for n in range(10)),
        *(trial(SHELLS[0], n, GICP, RIGHT if n > 1 else WRONG, 0.04, 0.0) for n in range(10)),
        *(trial(GOOD, n, DEFAULT, RIGHT if n else WRONG, 0.02, 0.9) for n in range(4)),
        *(trial(GOOD, n, TOLD, RIGHT, 0.02, 0.9) for n in range(4)),
    ]
    return {figure.name: figure for figure in figures([InstanceTrials(trials, RIGHT)])}


def test_successes(found: dict[str, Figure]) -> None:
    figure = found["at least half visible, ADD(-S) < 10 %, from 2 cm/15°"]
    assert figure.value == 90.0 and figure.is_missed
    assert found["the same from 2 cm/15°, share of that"].value == 90.0


def test_truths_that_the_depth_does_not_show() -> None:
    of_moro = [replace(trial(SHELLS[0], 0, DEFAULT, RIGHT, 0.02, 0.9), set_name=MORO)]
    results = [InstanceTrials(of_moro, error) for error in (RIGHT, RIGHT, RIGHT, WRONG)]
    found = {figure.name: figure.value for figure in figures(results)}
    assert found["moro, the truth, polished on the depth, has an MSSD >= 5 %, of all"] == 25.0


def test_good_poses_made_worse(found: dict[str, Figure]) -> None:
    assert found["at least half visible, default, good poses made worse"].value == 25.0
    told = found["at least half visible, default, spread told, good poses made worse"]
    assert told.value == 0.0 and not told.is_missed


def test_peers(found: dict[str, Figure]) -> None:
    lead = found["at least half visible, successes minus those of small_gicp GICP, in the worst shell"]
    share = found["at least half visible, median time of that of small_gicp GICP, in the worst shell"]
    assert (lead.value, share.value) == pytest.approx((10.0, 50.0))
    assert not lead.is_missed and not share.is_missed


def test_confidence_is_judged_without_the_good_starts(found: dict[str, Figure]) -> None:
    assert found["confidence, at least half visible, AUROC"].value == 100.0
    assert found["confidence, at least half visible, wrong accepted with 90 % of the good"].value == 0.0


def test_what_was_not_tried_has_no_figure(found: dict[str, Figure]) -> None:
    assert not any("bunny" in name or "5 cm" in name for name in found)
    assert all(math.isfinite(figure.value) for figure in found.values())


def test_confidence_needs_right_and_wrong_results() -> None:
    trials = [trial(SHELLS[0], n, DEFAULT, replace(RIGHT), 0.02, 0.9) for n in range(3)]
    names = [figure.name for figure in figures([InstanceTrials(trials, RIGHT)])]
    assert [name for name in names if name.startswith("confidence")] == [
        "confidence, at least half visible, calibration error"
    ]


def test_times_are_compared_from_the_same_starts() -> None:
    trials = [
        *(trial(SHELLS[0], n, DEFAULT, RIGHT, 0.02, 0.9) for n in range(3)),
        *(trial(SHELLS[0], 3 + n, DEFAULT, RIGHT, seconds, 0.3) for n, seconds in enumerate((0.1, 0.1, 0.4))),
        *(trial(SHELLS[0], n, PROTOTYPE, RIGHT, 0.05, 0.0) for n in range(3)),
    ]
    found = {figure.name: figure for figure in figures([InstanceTrials(trials, RIGHT)])}
    assert found[
        "synthetic, median time of a default snap, of that of the research prototype"
    ].value == pytest.approx(0.4)
    assert found["synthetic, p95 of snaps in doubt, of their median"].value == pytest.approx(3.7)


def test_acceptance_is_judged_on_real_scenes() -> None:
    real = [replace(trial(MIDDLE, n, DEFAULT, RIGHT, 0.02, 0.0), set_name=MORO) for n in range(4)]
    found = {figure.name: figure for figure in figures([InstanceTrials(real, RIGHT)])}
    accepted = found["acceptance(0.02), real, from 5 cm/30°, accepted"]
    assert accepted.value == 0.0 and accepted.is_missed
