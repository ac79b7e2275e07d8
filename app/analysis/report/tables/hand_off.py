"""Where a snap begins to save time, and where it saves most."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import CELL, INTEGER, NUMBER, TEXT, TRUTH, Row, cell_row
from app.analysis.report.tables.registry import Table
from app.analysis.statistics.cautions import hand_off_caution
from app.analysis.statistics.units import in_people_units


def _rows(report: Report) -> Iterator[Row]:
    curves = [(cell, method, stg) for cell in report.cells for method, stg in cell.stg.items()]
    for cell, method, stg in curves:
        if (point := stg.hand_off) is not None:
            yield cell_row(cell) | {
                "method": method,
                "margin": in_people_units(point.margin, cell.error),
                "is_largest": point.is_largest,
                "is_smallest": point.is_smallest,
                "best_margin": in_people_units(point.best_margin, cell.error),
                "saved_seconds": point.saved,
                "saved_low": point.saved_interval[0],
                "saved_high": point.saved_interval[1],
                "operators": point.operators,
                "caution": hand_off_caution(point),
            }


TABLE = Table(
    "hand_off",
    [
        *CELL,
        ("method", TEXT),
        ("margin", NUMBER),
        ("is_largest", TRUTH),
        ("is_smallest", TRUTH),
        ("best_margin", NUMBER),
        ("saved_seconds", NUMBER),
        ("saved_low", NUMBER),
        ("saved_high", NUMBER),
        ("operators", INTEGER),
        ("caution", TEXT),
    ],
    _rows,
)
