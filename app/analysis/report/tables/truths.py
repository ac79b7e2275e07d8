"""The ground truth of each object in each scene."""

from collections.abc import Iterator

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import INTEGER, NUMBER, TEXT, Row
from app.analysis.report.tables.registry import Table
from app.analysis.statistics.units import in_people_units


def _rows(report: Report) -> Iterator[Row]:
    for place in report.collected.truths:
        off = place.from_reference
        yield {
            "place": place.name,
            "registrations": place.truth.count,
            "spread_mm": in_people_units(place.truth.translation_spread, "translation"),
            "spread_deg": in_people_units(place.truth.rotation_spread, "rotation"),
            "from_reference_mm": None
            if off is None
            else in_people_units(float(off.translation[0]), "translation"),
            "from_reference_deg": None
            if off is None
            else in_people_units(float(off.rotation[0]), "rotation"),
        }


TABLE = Table(
    "truths",
    [
        ("place", TEXT),
        ("registrations", INTEGER),
        ("spread_mm", NUMBER),
        ("spread_deg", NUMBER),
        ("from_reference_mm", NUMBER),
        ("from_reference_deg", NUMBER),
    ],
    _rows,
)
