"""Errors as people read them: millimetres and degrees."""

import math

from app.analysis.trial import ErrorKind

UNITS: dict[ErrorKind, str] = {"translation": "mm", "rotation": "°"}


def in_people_units(value: float, kind: ErrorKind) -> float:
    """Millimetres of metres, degrees of radians."""
    return 1000.0 * value if kind == "translation" else math.degrees(value)


def told(value: float, kind: ErrorKind) -> str:
    """With its unit: "4.2 mm", "12°"; "–" for NaN."""
    if not math.isfinite(value):
        return "–"
    number = f"{in_people_units(value, kind):.3g}"
    return f"{number} mm" if kind == "translation" else f"{number}°"
