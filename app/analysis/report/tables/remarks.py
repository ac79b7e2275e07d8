"""What was left out or handled, and why."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import INTEGER, TEXT, Row
from app.analysis.report.tables.registry import Table


def _rows(report: Report) -> Iterator[Row]:
    for remark in report.remarks:
        yield {"about": remark.about, "text": remark.text, "registration_id": remark.registration_id}


TABLE = Table("remarks", [("about", TEXT), ("text", TEXT), ("registration_id", INTEGER)], _rows)
