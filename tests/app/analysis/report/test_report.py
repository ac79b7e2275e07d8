"""The whole report: what it says, and that its files are the same bytes each time."""

import csv
import io
import xml.etree.ElementTree as ET
from typing import Any

import numpy as np
import pyarrow.parquet as pq
import pytest

from app.analysis.report.report import ReportConfig, report_of
from app.analysis.report.report_files import file_names, file_of, write_report
from app.analysis.statistics.bootstrap import Interval
from app.analysis.statistics.units import interval_told, told
from app.analysis.study_data.collect import Collected, PlaceTruth
from app.analysis.study_data.ground_truth import mean_truth
from app.analysis.study_data.remarks import Remark
from app.analysis.study_data.selection import Selection, choices_of
from tests.app.analysis.hand_made import at
from tests.app.analysis.trials import NAN, trial

SNAPPED: dict[str, Any] = {"stg_translation": [0.002] * 4, "stg_rotation": [0.02] * 4}
FAR = trial([0.5, 0.4], [1.0, 0.9], operator="P9", group="novice", registration_id=9)


def collected_of(*trials, is_simulated=False) -> Collected:
    return Collected(
        study_id=7,
        name="mugs & <bowls>",
        is_simulated=is_simulated,
        groups={"novice": 2, "expert": 0},
        trials=trials,
        truths=[PlaceTruth("table, mug", mean_truth(at(0.0)[None], np.eye(4)[None]), None)],
        algorithm="0123456789ab",
        remarks=[Remark("group expert", "has no operators; there are no curves of it")],
    )


def four(operator: str, **more):
    return trial([0.09, 0.05, 0.02, 0.01], [0.9, 0.5, 0.2, 0.1], operator=operator, **SNAPPED, **more)


@pytest.fixture(scope="module")
def report():
    trials = (four("P1"), four("P2", registration_id=2), four("P1", mode="quick", registration_id=3), FAR)
    return report_of(collected_of(*trials), ReportConfig())


def test_whoever_never_came_near_is_said_and_counts_in_the_share_alone(report):
    text = "\n".join(map(str, report.remarks))
    assert (
        "P9, table, mug, accurate, manual: never came within the largest margin of translation, 100 mm"
        in text
    )
    assert text.count("never came") == 1  # its rotation came within 90°
    cell = next(cell for cell in report.cells if cell.mode == "accurate" and cell.error == "translation")
    assert (cell.operators, cell.trials) == (3, 3)
    assert cell.human.curve.operators[0] == 2 and cell.human.curve.share[0] == pytest.approx(2 / 3)


def test_a_part_of_a_study_is_named_in_its_own_words(report):
    whole = report.collected
    assert choices_of(whole)["mode"] == ["accurate", "quick"]
    quick = Selection(mode="quick", group="novice").of(whole)
    assert [one.registration_id for one in quick.trials] == [3] and quick.groups == {"novice": 2}
    with pytest.raises(ValueError, match="group 'masters' is none of this study; there are: novice, expert"):
        Selection(group="masters").of(whole)


def test_tables_hold_the_numbers_in_people_s_units(report):
    rows = list(csv.DictReader(io.StringIO(file_of(report, "curves.csv").decode())))
    first = rows[0]
    assert (first["group"], first["hand"], first["unit"]) == ("novice", "human", "mm")
    assert (float(first["margin"]), float(first["seconds"])) == (100.0, 0.0)
    assert (first["operators"], first["trials"], first["is_simulated"]) == ("2", "2", "false")
    within_50 = [
        row for row in rows if row["hand"] == "human" and row["unit"] == "mm" and row["mode"] == "quick"
    ]
    reached = {round(float(row["margin"]), 3): row["seconds"] for row in within_50}
    assert reached[100.0] == "0" and reached[10.0] == "1.5" and reached[1.0] == ""
    trials = pq.read_table(io.BytesIO(file_of(report, "trials.parquet"))).to_pylist()
    assert trials[0]["translation_mm"] == 10.0 and trials[0]["stg_rotation_deg"] == pytest.approx(1.145916)
    samples = pq.read_table(io.BytesIO(file_of(report, "samples.parquet")))
    assert samples.num_rows == 14


def test_the_figure_is_an_svg_whose_words_can_be_read_and_a_pdf(report):
    svg = file_of(report, "figure.svg").decode()
    words = " ".join(ET.fromstring(svg).itertext())
    for word in (
        "novice, translation",
        "expert, rotation",
        "no operators",
        "STG, quick",
        "error margin [mm]",
    ):
        assert word in words
    assert "simulated" not in words and "dc:date" not in svg
    pdf = file_of(report, "figure.pdf")
    assert pdf.startswith(b"%PDF") and b"CreationDate" not in pdf


@pytest.mark.slow
def test_simulated_is_said_everywhere():
    simulated = report_of(collected_of(four("P1", is_simulated=True), is_simulated=True), ReportConfig())
    assert "simulated operators" in file_of(simulated, "figure.svg").decode()
    assert "Simulated:" in file_of(simulated, "report.html").decode()
    for name in (name for name in file_names() if name.endswith(".csv")):
        rows = list(csv.DictReader(io.StringIO(file_of(simulated, name).decode())))
        assert all(row["is_simulated"] == "true" for row in rows)


def test_the_page_needs_nothing_from_elsewhere_and_says_what_was_handled(report):
    html = file_of(report, "report.html").decode()
    assert "mugs &amp; &lt;bowls&gt;" in html and "<bowls>" not in html
    for words in (
        "has no operators",
        "never came within",
        "Does a snap improve rotation",
        "charged with 0.1 s",
    ):
        assert words in html
    assert "<script" not in html and 'src="' not in html and "<link" not in html


@pytest.mark.slow
def test_techniques_have_a_figure_each_and_are_compared_in_pairs_in_the_page():
    trials = (four("P1"), four("P1", condition="find it"), four("P2"), four("P2", condition="find it"))
    techniques = report_of(collected_of(*trials), ReportConfig())
    html = file_of(techniques, "report.html").decode()
    assert html.count("<figure>") == 2 and "mugs &amp; &lt;bowls&gt;: find it</text>" in html
    assert "<td>find it − manual</td><td>2</td>" in html
    svg = file_of(techniques, "figure.svg").decode()
    assert ": manual</text>" in svg and ": find it</text>" not in svg


@pytest.mark.slow
def test_both_methods_stand_side_by_side_in_figure_page_and_tables():
    by_paper = {"paper_translation": [0.02, 0.02, NAN, 0.005], "paper_rotation": [0.5, 0.4, NAN, 0.2]}
    both = report_of(collected_of(four("P1", **by_paper), four("P2", **by_paper)), ReportConfig())
    words = " ".join(ET.fromstring(file_of(both, "figure.svg").decode()).itertext())
    assert "STG, accurate" in words and "STG, paper's filter, accurate" in words
    html = file_of(both, "report.html").decode()
    assert "charged with 0.1 s, by the paper&#39;s filter with 7 s" in html
    assert "from the same poses, by the paper&#39;s filter" in html
    for name in ("curves", "hand_off", "gains"):
        rows = list(csv.DictReader(io.StringIO(file_of(both, f"{name}.csv").decode())))
        assert {row["method"] for row in rows} >= {"default"}
    curves = list(csv.DictReader(io.StringIO(file_of(both, "curves.csv").decode())))
    assert {(row["hand"], row["method"]) for row in curves} == {
        ("human", ""),
        ("stg", "default"),
        ("stg", "paper"),
    }
    first = next(row for row in curves if row["method"] == "paper" and row["unit"] == "mm")
    assert float(first["seconds"]) == 7.0
    samples = pq.read_table(io.BytesIO(file_of(both, "samples.parquet"))).to_pylist()
    assert (samples[0]["stg_translation_mm"], samples[0]["paper_translation_mm"]) == (2.0, 20.0)
    assert samples[2]["paper_rotation_deg"] is None


def test_idle_time_is_said_whether_or_not_it_counts():
    trials = (four("P1"), four("P2", idle_seconds=1.0), four("P3", idle_seconds=0.5))
    counts, left_out = (
        report_of(collected_of(*trials), ReportConfig(without_idle=way)) for way in (False, True)
    )
    said = "idle time: 2 of 3 trials have some, 2 s in all and at most 1 s, of P2; it"
    assert any(str(remark) == f"{said} counts." for remark in counts.remarks)
    assert any(str(remark) == f"{said} is left out." for remark in left_out.remarks)
    assert "idle time" not in "".join(map(str, report_of(collected_of(four("P1")), ReportConfig()).remarks))


@pytest.mark.slow
def test_the_same_trials_give_the_same_bytes_in_any_order(report, tmp_path):
    again = report_of(collected_of(*reversed(report.collected.trials)), ReportConfig())
    paths = write_report(again, tmp_path / "out")
    assert {path.name for path in paths} == set(file_names())
    for path in paths:
        assert path.read_bytes() == file_of(report, path.name)


def test_a_study_of_nothing_still_has_a_report(tmp_path):
    empty = report_of(collected_of(), ReportConfig(without_idle=True, truth="reference"))
    assert empty.cells == [] and empty.gains == [] and empty.comparisons == []
    assert all(path.stat().st_size for path in write_report(empty, tmp_path))


def test_numbers_are_told_with_their_units():
    assert told(0.00421, "translation") == "4.21 mm" and told(float("nan"), "rotation") == "–"
    assert told(1.2345, "translation") == "1230 mm"
    assert interval_told(Interval(1.0, 0.5, 2.0, 5), None) == "1 s (0.5 s to 2 s)"
    assert interval_told(Interval(0.01, float("nan"), float("nan"), 1), "translation") == "10 mm"
