"""Errors before and after a snap."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import CELL, INTEGER, NUMBER, TEXT, UNIT_NAMES, Row, interval_row
from app.analysis.report.tables.registry import Table


def _rows(report: Report) -> Iterator[Row]:
    for gain in report.gains:
        yield {
            "group": gain.group,
            "mode": gain.mode,
            "condition": gain.condition,
            "error": gain.error,
            "unit": UNIT_NAMES[gain.error],
            "method": gain.method,
            "moment": gain.moment,
            **interval_row("before", gain.before, gain.error),
            **interval_row("after", gain.after, gain.error),
            **interval_row("gain", gain.gain, gain.error),
            "improved": gain.improved,
            "operators": gain.gain.operators,
            "trials": gain.trials,
            "verdict": gain.verdict,
        }


TABLE = Table(
    "gains",
    [
        *CELL,
        ("method", TEXT),
        ("moment", TEXT),
        *((f"{name}{end}", NUMBER) for name in ("before", "after", "gain") for end in ("", "_low", "_high")),
        ("improved", NUMBER),
        ("operators", INTEGER),
        ("trials", INTEGER),
        ("verdict", TEXT),
    ],
    _rows,
)
