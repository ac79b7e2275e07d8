"""Seconds and shares at every margin of every curve."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import (
    CELL,
    INTEGER,
    NUMBER,
    TEXT,
    Row,
    cell_row,
    drawn_curves,
    hand_row,
)
from app.analysis.report.tables.registry import Table
from app.analysis.statistics.units import in_people_units


def _rows(report: Report) -> Iterator[Row]:
    for cell, method, drawn in drawn_curves(report):
        curve = drawn.curve
        for k, margin in enumerate(curve.margins.tolist()):
            yield cell_row(cell) | {
                **hand_row(method),
                "margin": in_people_units(margin, cell.error),
                "seconds": float(curve.mean[k]),
                "seconds_low": float(curve.low[k]),
                "seconds_high": float(curve.high[k]),
                "operators": int(curve.operators[k]),
                "trials": int(curve.trials[k]),
                "share": float(curve.share[k]),
                "registration_id": drawn.registration_ids[k],
            }


TABLE = Table(
    "curves",
    [
        *CELL,
        ("hand", TEXT),
        ("method", TEXT),
        ("margin", NUMBER),
        ("seconds", NUMBER),
        ("seconds_low", NUMBER),
        ("seconds_high", NUMBER),
        ("operators", INTEGER),
        ("trials", INTEGER),
        ("share", NUMBER),
        ("registration_id", INTEGER),
    ],
    _rows,
)
