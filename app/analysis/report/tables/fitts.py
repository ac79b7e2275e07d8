"""Fitts' law of every curve that it can be fitted to."""

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
from app.analysis.statistics.cautions import fitts_caution
from app.analysis.statistics.units import in_people_units


def _rows(report: Report) -> Iterator[Row]:
    for cell, method, drawn in drawn_curves(report):
        if (line := drawn.fitts) is not None:
            yield cell_row(cell) | {
                **hand_row(method),
                "distance": in_people_units(line.distance, cell.error),
                "margins": line.margins,
                "bits_low": line.bits[0],
                "bits_high": line.bits[1],
                "operators": line.operators,
                "trials": line.trials,
                "a": line.a,
                "a_low": line.a_interval[0],
                "a_high": line.a_interval[1],
                "b": line.b,
                "b_low": line.b_interval[0],
                "b_high": line.b_interval[1],
                "r_squared": line.r_squared,
                "bits_per_second": line.throughput,
                "bits_per_second_low": line.throughput_interval[0],
                "bits_per_second_high": line.throughput_interval[1],
                "caution": fitts_caution(line),
            }


TABLE = Table(
    "fitts",
    [
        *CELL,
        ("hand", TEXT),
        ("method", TEXT),
        ("distance", NUMBER),
        ("margins", INTEGER),
        ("bits_low", NUMBER),
        ("bits_high", NUMBER),
        ("operators", INTEGER),
        ("trials", INTEGER),
        *((name, NUMBER) for name in ("a", "a_low", "a_high", "b", "b_low", "b_high", "r_squared")),
        *((f"bits_per_second{end}", NUMBER) for end in ("", "_low", "_high")),
        ("caution", TEXT),
    ],
    _rows,
)
