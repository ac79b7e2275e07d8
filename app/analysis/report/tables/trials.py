"""Each trial as it ended."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import INTEGER, NUMBER, TEXT, Row, sample_row
from app.analysis.report.tables.registry import Table


def _rows(report: Report) -> Iterator[Row]:
    for trial in report.collected.trials:
        yield {
            "registration_id": trial.registration_id,
            "operator": trial.operator,
            "group": trial.group,
            "mode": trial.mode,
            "condition": trial.condition,
            "scene": trial.scene,
            "object": trial.object,
            "instance": trial.instance,
            "active_seconds": float(trial.active_seconds[-1]),
            **sample_row(trial, -1),
        }


TABLE = Table(
    "trials",
    [
        ("registration_id", INTEGER),
        ("operator", TEXT),
        ("group", TEXT),
        ("mode", TEXT),
        ("condition", TEXT),
        ("scene", TEXT),
        ("object", TEXT),
        ("instance", INTEGER),
        ("seconds", NUMBER),
        ("active_seconds", NUMBER),
        ("translation_mm", NUMBER),
        ("rotation_deg", NUMBER),
        ("stg_translation_mm", NUMBER),
        ("stg_rotation_deg", NUMBER),
        ("paper_translation_mm", NUMBER),
        ("paper_rotation_deg", NUMBER),
    ],
    _rows,
)
