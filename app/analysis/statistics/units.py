"""Numbers as people read them: millimetres, degrees and seconds."""

import math

from app.analysis.statistics.bootstrap import Interval
from app.analysis.study_data.trial import ErrorKind

UNITS: dict[ErrorKind, str] = {"translation": "mm", "rotation": "°"}


def in_people_units(value: float, kind: ErrorKind) -> float:
    """Millimetres of metres, degrees of radians."""
    return 1000.0 * value if kind == "translation" else math.degrees(value)


def number_told(value: float) -> str:
    """Three significant digits; "–" for NaN."""
    return f"{float(f'{value:.3g}'):g}" if math.isfinite(value) else "–"


def share_told(value: float) -> str:
    """ "94 %"; "–" for NaN."""
    return f"{100.0 * value:.0f} %" if math.isfinite(value) else "–"


def told(value: float, kind: ErrorKind) -> str:
    """With its unit: "4.2 mm", "12°"; "–" for NaN."""
    if not math.isfinite(value):
        return "–"
    number = number_told(in_people_units(value, kind))
    return f"{number} mm" if kind == "translation" else f"{number}°"


def interval_told(interval: Interval, error: ErrorKind | None) -> str:
    """ "4.2 mm (3.9 mm to 4.6 mm)"; seconds where it is of no error."""

    def one(value: float) -> str:
        return told(value, error) if error else f"{number_told(value)} s"

    if interval.operators < 2:
        return one(interval.mean)
    return f"{one(interval.mean)} ({one(interval.low)} to {one(interval.high)})"
