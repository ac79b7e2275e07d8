"""The errors of each trial at each of its moments."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import INTEGER, NUMBER, TRUTH, Row, sample_row
from app.analysis.report.tables.registry import Table


def _rows(report: Report) -> Iterator[Row]:
    for trial in report.collected.trials:
        for i in range(len(trial.seconds)):
            yield {
                "registration_id": trial.registration_id,
                "idle": bool(trial.idle[i]),
                **sample_row(trial, i),
            }


TABLE = Table(
    "samples",
    [
        ("registration_id", INTEGER),
        ("seconds", NUMBER),
        ("idle", TRUTH),
        ("translation_mm", NUMBER),
        ("rotation_deg", NUMBER),
        ("stg_translation_mm", NUMBER),
        ("stg_rotation_deg", NUMBER),
        ("paper_translation_mm", NUMBER),
        ("paper_rotation_deg", NUMBER),
    ],
    _rows,
)
