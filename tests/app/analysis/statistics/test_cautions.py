"""What tells much is left alone; each weakness of a fit or a hand-off point is said, and it alone."""

import csv
import io
from dataclasses import replace

import numpy as np
import pytest

from app.analysis.report.report import ReportConfig, report_of
from app.analysis.report.report_files import file_of
from app.analysis.statistics.cautions import fitts_caution, hand_off_caution
from app.analysis.statistics.curves import curve_of
from app.analysis.statistics.fitts import Fitts, fitts
from app.analysis.statistics.hand_off import HandOff, hand_off
from tests.app.analysis.report.test_report import collected_of, four
from tests.app.analysis.trials import NAN, trial

DISTANCE = 0.25
MARGINS = np.geomspace(0.1, 0.004, 12)
OPERATORS = [f"P{number}" for number in range(8)]
OFF = np.linspace(-0.05, 0.05, 8)
"""By which operators differ."""
POINT = HandOff(0.02, False, False, 0.01, 5.0, (4.0, 6.0), 8)


def bits(margins: np.ndarray) -> np.ndarray:
    return np.log2(DISTANCE / margins + 1.0)


def line_of(
    slopes: np.ndarray, margins: np.ndarray = MARGINS, bend: float = 0.0, operators: list[str] = OPERATORS
) -> Fitts:
    """The fit to times that follow the law but for a bend up and down, with a slope of each operator."""
    wave = bend * np.cos(np.pi * np.arange(len(margins)))
    times = 3.0 + slopes[:, None] * bits(margins) + wave
    line = fitts(curve_of(times, operators, margins, seed=0), DISTANCE, seed=0)
    assert line is not None
    return line


def test_a_clear_line_and_a_clear_point_have_nothing_against_them():
    line = line_of(0.5 + OFF)
    assert line.bits == pytest.approx((bits(MARGINS)[0], bits(MARGINS)[-1]))
    assert (line.operators, line.trials) == (8, 8)
    assert fitts_caution(line) == "" and hand_off_caution(POINT) == ""


@pytest.mark.parametrize(
    ("line", "reason"),
    [
        (line_of((0.5 + OFF)[:4], operators=OPERATORS[:4]), "4 trials of 4 operators"),
        (
            line_of(0.5 + OFF, margins=np.geomspace(0.1, 0.04, 6)),
            "its difficulties cover 1.05 bits, less than 3",
        ),
        (line_of(0.5 + OFF, bend=0.6), "R² is 0.485, below 0.9"),
        (line_of(0.1 + 8.0 * OFF), "the slope may be zero (-0.0857 to 0.271 s a bit)"),
        (line_of(-0.5 + OFF), "the slope is negative (-0.5 s a bit)"),
        (line_of(0.5 + 12.0 * OFF), "the slope may be anything from 0.221 to 0.757 s a bit"),
    ],
)
def test_each_weakness_of_a_fit_is_said_alone(line, reason):
    assert fitts_caution(line) == f"This fit tells little: {reason}."


def test_all_weaknesses_of_a_fit_are_said_in_one_sentence():
    poor = line_of(np.array([-0.4, 0.6]), margins=np.geomspace(0.1, 0.05, 4), operators=OPERATORS[:2])
    assert fitts_caution(poor) == (
        "This fit tells little: 2 trials of 2 operators; its difficulties cover 0.778 bits, less than 3;"
        " the slope may be zero (-0.4 to 0.6 s a bit)."
    )


def test_one_operator_has_no_interval_and_a_slope_that_is_zero_or_below_is_said_all_the_same():
    for slope, said in ((0.0, "the slope is zero."), (-0.5, "the slope is negative (-0.5 s a bit).")):
        line = line_of(np.array([slope]), operators=OPERATORS[:1])
        assert fitts_caution(line) == f"This fit tells little: 1 trial of 1 operator; {said}"


def test_means_of_equal_times_are_a_flat_line_without_a_throughput():
    times = np.full((3, 41), 0.1)  # their mean is off by rounding
    line = fitts(curve_of(times, OPERATORS[:3], np.geomspace(0.1, 0.001, 41), seed=0), DISTANCE, seed=0)
    assert line is not None and line.b == 0.0 and line.b_interval == (0.0, 0.0)
    assert np.isnan(line.throughput) and np.isnan(line.r_squared)
    assert "the slope may be zero (0 to 0 s a bit)" in fitts_caution(line)


@pytest.mark.parametrize(
    ("changes", "reason"),
    [
        ({"operators": 5}, "5 operators"),
        ({"is_largest": True}, "it is the largest margin of all, the curves may part farther out"),
        (
            {"is_smallest": True},
            "it is the smallest margin that enough operators come within, and the only one",
        ),
        ({"saved_interval": (1.0, 9.0)}, "what a snap saves may be anything from 1 to 9 s"),
    ],
)
def test_each_weakness_of_a_hand_off_point_is_said_alone(changes, reason):
    assert hand_off_caution(replace(POINT, **changes)) == f"This point tells little: {reason}."


def test_a_point_at_either_end_of_what_was_measured_is_known():
    stg, margins = np.zeros((8, 4)), np.array([0.1, 0.05, 0.02, 0.01])
    for saved, ends in (
        ([5.0, 5.0, 5.0, NAN], (True, False)),
        ([0.0, 5.0, 5.0, NAN], (False, False)),
        ([0.0, 0.0, 5.0, NAN], (False, True)),  # nobody comes within the one that is smaller
        ([0.0, 0.0, 5.0, 0.0], (False, False)),
    ):
        human = np.array(saved) * (1.0 + OFF[:, None])
        point = hand_off(human, stg, OPERATORS, margins, seed=0)
        assert point is not None and (point.is_largest, point.is_smallest) == ends


def test_a_line_that_is_not_there_is_said_too():
    far = report_of(collected_of(trial([0.5, 0.4])), ReportConfig())
    html = file_of(far, "report.html").decode()
    assert "There is no line: it takes 3 margins within D that half of the operators reach." in html


def test_cautions_stand_in_tables_and_in_the_page():
    report = report_of(collected_of(four("P1"), four("P2", registration_id=2)), ReportConfig())
    html = file_of(report, "report.html").decode()
    for name, start in (
        ("fitts", "This fit tells little: 2 trials of 2 operators"),
        ("hand_off", "This point"),
    ):
        rows = list(csv.DictReader(io.StringIO(file_of(report, f"{name}.csv").decode())))
        assert rows and all(row["caution"].startswith(start) for row in rows)
        assert f'colspan="{11 if name == "fitts" else 8}">{start}' in html
