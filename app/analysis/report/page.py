"""A report as one HTML file that opens anywhere: no script, nothing from elsewhere."""

import math
from collections.abc import Iterable, Iterator, Sequence
from html import escape

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

STYLE = """
:root { color-scheme: light dark; --line: #d9dad6; --soft: #f4f4f1; }
@media (prefers-color-scheme: dark) { :root { --line: #3a4047; --soft: #24282d; } }
body { font: 15px/1.5 system-ui, sans-serif; max-width: 70rem; margin: 2rem auto; padding: 0 1.5rem; }
h1 { font-size: 1.5rem; } h2 { font-size: 1.15rem; margin: 2rem 0 .5rem; }
table { border-collapse: collapse; } .table { overflow-x: auto; }
th, td { text-align: left; padding: .3rem .9rem .3rem 0; border-bottom: 1px solid var(--line);
  font-variant-numeric: tabular-nums; }
figure { margin: 1rem 0; padding: 1rem; background: #fff; } figure svg { width: 100%; height: auto; }
.caution { border-left: 4px solid #c99a2c; padding-left: .8rem; }
.simulated { padding: .6rem 1rem; border-left: 4px solid #c99a2c; background: var(--soft); font-weight: 600; }
"""


def page_of(report: Report) -> str:
    """The page, UTF-8."""
    title = escape(f"{report.collected.name}: report")
    parts = [
        f"<h1>{title}</h1>",
        _simulated(report),
        f"<p>{_counts(report)}</p>",
        *(_figure(report, condition) for condition in shown_conditions(report)),
        _section("Does a snap improve rotation as well?", _answers(report), _gains(report)),
        _section("Hand-off", [], _hand_offs(report)),
        _section("Fitts' law: time = a + b log2(D/W + 1)", [], _fitts(report)),
        _section("Conditions in pairs", [], _comparisons(report)),
        _section("Ground truth", [], _truths(report)),
        _section(
            "What was left out or handled", [str(remark) for remark in report.remarks] or ["Nothing."], ""
        ),
        _section("How the numbers are made", _method(report), ""),
    ]
    return (
        f'<!doctype html>\n<html lang="en">\n<head>\n<meta charset="utf-8">\n<title>{title}</title>\n'
        '<meta name="viewport" content="width=device-width, initial-scale=1">\n'
        f"<style>{STYLE}</style>\n</head>\n<body>\n<main>\n"
        + "\n".join(filter(None, parts))
        + "\n</main>\n</body>\n</html>\n"
    )


def _figure(report: Report, condition: str) -> str:
    svg = figure_bytes(report, "svg", condition).decode()
    return f"<figure>{svg[svg.index('<svg') :]}</figure>"


def _simulated(report: Report) -> str:
    if not report.collected.is_simulated:
        return ""
    return '<p class="simulated">Simulated: in this study scripts stand in for people.</p>'


def _counts(report: Report) -> str:
    groups = ", ".join(
        f"{escape(name)}: {counted(count, 'operator')}" for name, count in report.collected.groups.items()
    )
    return f"{counted(len(report.collected.trials), 'trial')} count. {groups}."


def _answers(report: Report) -> list[str]:
    return [gain.sentence for gain in report.gains if gain.error == "rotation"]


def _gains(report: Report) -> str:
    return _table(
        (
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
        ),
        (
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
        ),
    )


def _hand_offs(report: Report) -> str:
    return _table(
        (
            "group",
            "mode",
            "condition",
            "method",
            "error",
            "let the machine take over from",
            "saves most at",
            "seconds saved there",
        ),
        (
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
        ),
    )


def _hand_off(point: HandOff | None, error: ErrorKind) -> tuple[str, str, str]:
    if point is None:
        return "no margin: nothing is saved for sure", "–", "–"
    saved = interval_told(Interval(point.saved, *point.saved_interval, point.operators), None)
    from_there = told(point.margin, error) + " or more" * point.is_largest
    return from_there, told(point.best_margin, error), saved


def _fitts(report: Report) -> str:
    return _table(
        ("group", "mode", "condition", "error", "by", "D", "margins", "a", "b", "R²", "bits/s"),
        (
            row
            for cell in report.cells
            for method, drawn in cell.curves
            for row in _with_caution(_fitts_row(cell, method, drawn.fitts), fitts_caution(drawn.fitts))
        ),
    )


def _fitts_row(cell: Cell, method: Method | None, line: Fitts | None) -> Sequence[object]:
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


def _with_caution(row: Sequence[object], caution: str) -> Iterator[Sequence[object]]:
    """A row, and below it what there is to say against it."""
    yield row
    if caution:
        yield (caution,)


def _throughput(line: Fitts) -> str:
    low, high = (number_told(bound) for bound in line.throughput_interval)
    sure = f" ({low} to {high})" if math.isfinite(line.throughput_interval[0]) else ""
    return f"{number_told(line.throughput)}{sure}"


def _comparisons(report: Report) -> str:
    return _table(
        (
            "group",
            "mode",
            "difference",
            "pairs",
            "operators",
            "seconds",
            "final translation",
            "final rotation",
        ),
        (
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
        ),
    )


def _truths(report: Report) -> str:
    return _table(
        ("object", "registrations", "spread", "off the reference"),
        (
            (
                place.name,
                place.truth.count or "given",
                f"{told(place.truth.translation_spread, 'translation')},"
                f" {told(place.truth.rotation_spread, 'rotation')}",
                _off(place.from_reference),
            )
            for place in report.collected.truths
        ),
    )


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


def _section(title: str, sentences: Sequence[str], table: str) -> str:
    if not sentences and not table:
        return ""
    items = "".join(f"<li>{escape(sentence)}</li>" for sentence in sentences)
    # a table that is wider than the page has to be reached by keys to be scrolled
    held = f'<div class="table" role="group" aria-label="{escape(title)}" tabindex="0">{table}</div>'
    return f"<h2>{escape(title)}</h2>" + (f"<ul>{items}</ul>" if items else "") + (held if table else "")


def _table(names: Sequence[str], rows: Iterable[Sequence[object]]) -> str:
    """Empty where there are no rows; a row of one cell is about the row above, and as wide as the table."""
    head = "".join(f'<th scope="col">{escape(name)}</th>' for name in names)
    body = "".join(f"<tr>{_cells(row, len(names))}</tr>" for row in rows)
    return f"<table><thead><tr>{head}</tr></thead><tbody>{body}</tbody></table>" if body else ""


def _cells(row: Sequence[object], columns: int) -> str:
    if len(row) == 1:
        return f'<td class="caution" colspan="{columns}">{escape(str(row[0]))}</td>'
    return "".join(f"<td>{escape(str(value))}</td>" for value in row)
