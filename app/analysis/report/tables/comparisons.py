"""Differences of two conditions in pairs of the same operator and task."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import INTEGER, NUMBER, TEXT, Row, interval_row
from app.analysis.report.tables.registry import Table


def _rows(report: Report) -> Iterator[Row]:
    for pair in report.comparisons:
        yield {
            "group": pair.group,
            "mode": pair.mode,
            "first": pair.first,
            "second": pair.second,
            "pairs": pair.pairs,
            "operators": pair.seconds.operators,
            **interval_row("seconds", pair.seconds, None),
            **interval_row("translation_mm", pair.translation, "translation"),
            **interval_row("rotation_deg", pair.rotation, "rotation"),
        }


TABLE = Table(
    "comparisons",
    [
        ("group", TEXT),
        ("mode", TEXT),
        ("first", TEXT),
        ("second", TEXT),
        ("pairs", INTEGER),
        ("operators", INTEGER),
        *(
            (f"{name}{end}", NUMBER)
            for name in ("seconds", "translation_mm", "rotation_deg")
            for end in ("", "_low", "_high")
        ),
    ],
    _rows,
)
