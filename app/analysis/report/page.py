"""A report as one HTML file that opens anywhere: no script, nothing from elsewhere."""

import math
from collections.abc import Iterator, Sequence
from dataclasses import dataclass
from pathlib import Path

from app.analysis.report.figure import figure_bytes, shown_conditions
from app.analysis.report.report import Report
from app.analysis.statistics.bootstrap import RESAMPLES, Interval
from app.analysis.statistics.cautions import fitts_caution, hand_off_caution
from app.analysis.statistics.cells import CURVE_NAMES, Cell
from app.analysis.statistics.fitts import Fitts
from app.analysis.statistics.hand_off import HandOff
from app.analysis.statistics.units import interval_told, number_told, share_told, told
from app.analysis.study_data.remarks import counted
from app.analysis.study_data.trial import ErrorKind
from app.analysis.trace.pose_errors import PoseErrors
from app.storage.tables import Method
from app.templating import templates_in

TEMPLATES = templates_in(Path(__file__).parent)

Row = Sequence[object]

GAINS = (
    "group",
    "mode",
    "condition",
    "method",
    "error",
    "from",
    "before",
    "after",
    "gain",
    "better",
    "operators",
    "verdict",
)
HAND_OFFS = (
    "group",
    "mode",
    "condition",
    "method",
    "error",
    "let the machine take over from",
    "saves most at",
    "seconds saved there",
)
FITTS = ("group", "mode", "condition", "error", "by", "D", "margins", "a", "b", "R²", "bits/s")
COMPARISONS = (
    "group",
    "mode",
    "difference",
    "pairs",
    "operators",
    "seconds",
    "final translation",
    "final rotation",
)
TRUTHS = ("object", "registrations", "spread", "off the reference")
"""What stands above the columns of the tables."""


@dataclass(frozen=True)
class Section:
    """A part of the page; where it has nothing to say it is left out."""

    title: str
    sentences: Sequence[str] = ()
    names: Sequence[str] = ()
    rows: Sequence[Row] = ()
    """Of the table under `names`; a row of one cell is about the row above."""


def page_of(report: Report) -> str:
    """The page, UTF-8."""
    return TEMPLATES.get_template("page.html").render(
        title=f"{report.collected.name}: report",
        is_simulated=report.collected.is_simulated,
        counts=_counts(report),
        figures=[_figure(report, condition) for condition in shown_conditions(report)],
        sections=_sections(report),
    )


def _sections(report: Report) -> list[Section]:
    remarks = [str(remark) for remark in report.remarks]
    return [
        Section("Does a snap improve rotation as well?", _answers(report), GAINS, _gains(report)),
        Section("Hand-off", names=HAND_OFFS, rows=_hand_offs(report)),
        Section("Fitts' law: time = a + b log2(D/W + 1)", names=FITTS, rows=_fitts(report)),
        Section("Conditions in pairs", names=COMPARISONS, rows=_comparisons(report)),
        Section("Ground truth", names=TRUTHS, rows=_truths(report)),
        Section("What was left out or handled", remarks or ["Nothing."]),
        Section("How the numbers are made", _method(report)),
    ]


def _figure(report: Report, condition: str) -> str:
    svg = figure_bytes(report, "svg", condition).decode()
    return svg[svg.index("<svg") :]


def _counts(report: Report) -> str:
    groups = ", ".join(
        f"{name}: {counted(count, 'operator')}" for name, count in report.collected.groups.items()
    )
    return f"{counted(len(report.collected.trials), 'trial')} count. {groups}."


def _answers(report: Report) -> list[str]:
    return [gain.sentence for gain in report.gains if gain.error == "rotation"]


def _gains(report: Report) -> list[Row]:
    return [
        (
            gain.group,
            gain.mode,
            gain.condition,
            gain.method,
            gain.error,
            gain.moment,
            interval_told(gain.before, gain.error),
            interval_told(gain.after, gain.error),
            interval_told(gain.gain, gain.error),
            share_told(gain.improved),
            gain.gain.operators,
            gain.verdict,
        )
        for gain in report.gains
    ]


def _hand_offs(report: Report) -> list[Row]:
    return [
        row
        for cell in report.cells
        for method, stg in cell.stg.items()
        for row in _with_caution(
            (
                cell.group,
                cell.mode,
                cell.condition,
                method,
                cell.error,
                *_hand_off(stg.hand_off, cell.error),
            ),
            hand_off_caution(stg.hand_off) if stg.hand_off else "",
        )
    ]


def _hand_off(point: HandOff | None, error: ErrorKind) -> tuple[str, str, str]:
    if point is None:
        return "no margin: nothing is saved for sure", "–", "–"
    saved = interval_told(Interval(point.saved, *point.saved_interval, point.operators), None)
    from_there = told(point.margin, error) + " or more" * point.is_largest
    return from_there, told(point.best_margin, error), saved


def _fitts(report: Report) -> list[Row]:
    return [
        row
        for cell in report.cells
        for method, drawn in cell.curves
        for row in _with_caution(_fitts_row(cell, method, drawn.fitts), fitts_caution(drawn.fitts))
    ]


def _fitts_row(cell: Cell, method: Method | None, line: Fitts | None) -> Row:
    which = (cell.group, cell.mode, cell.condition, cell.error, CURVE_NAMES[method])
    if line is None:
        return (*which, *["–"] * 6)
    return (
        *which,
        told(line.distance, cell.error),
        line.margins,
        interval_told(Interval(line.a, *line.a_interval, cell.operators), None),
        interval_told(Interval(line.b, *line.b_interval, cell.operators), None) + " a bit",
        number_told(line.r_squared),
        _throughput(line),
    )


def _with_caution(row: Row, caution: str) -> Iterator[Row]:
    """A row, and below it what there is to say against it."""
    yield row
    if caution:
        yield (caution,)


def _throughput(line: Fitts) -> str:
    low, high = (number_told(bound) for bound in line.throughput_interval)
    sure = f" ({low} to {high})" if math.isfinite(line.throughput_interval[0]) else ""
    return f"{number_told(line.throughput)}{sure}"


def _comparisons(report: Report) -> list[Row]:
    return [
        (
            pair.group,
            pair.mode,
            f"{pair.second} − {pair.first}",
            pair.pairs,
            pair.seconds.operators,
            interval_told(pair.seconds, None),
            interval_told(pair.translation, "translation"),
            interval_told(pair.rotation, "rotation"),
        )
        for pair in report.comparisons
    ]


def _truths(report: Report) -> list[Row]:
    return [
        (
            place.name,
            place.truth.count or "given",
            f"{told(place.truth.translation_spread, 'translation')},"
            f" {told(place.truth.rotation_spread, 'rotation')}",
            _off(place.from_reference),
        )
        for place in report.collected.truths
    ]


def _off(errors: PoseErrors | None) -> str:
    if errors is None:
        return "–"
    return (
        f"{told(float(errors.translation[0]), 'translation')}, {told(float(errors.rotation[0]), 'rotation')}"
    )


def _method(report: Report) -> list[str]:
    config, algorithm = report.config, report.collected.algorithm
    by = f"; they are of algorithm {algorithm}" if algorithm else ""
    filtered = any("paper" in cell.stg for cell in report.cells)
    paper = f", by the paper's filter with {config.paper_seconds:g} s" if filtered else ""
    return [
        f"Each offline snap is charged with {config.snap_seconds:g} s{paper}{by}.",
        "Idle time is left out." if config.without_idle else "Idle time counts.",
        "The ground truth of an object is the mean of the accurate registrations by hand."
        if config.truth == "operators"
        else "The ground truth of an object is its given reference pose.",
        f"Intervals hold 95 %, by {RESAMPLES} bootstrap resamples of operators with seed {config.seed}.",
        "Means are over operators who come within a margin; shares are of all their trials.",
    ]
