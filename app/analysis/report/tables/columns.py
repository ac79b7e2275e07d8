"""Columns that several tables of a report have, and what stands in them."""

from collections.abc import Iterator, Mapping
from typing import Any

import pyarrow as pa

from app.analysis.report.report import Report
from app.analysis.statistics.bootstrap import Interval
from app.analysis.statistics.cells import Cell, Drawn
from app.analysis.statistics.units import in_people_units
from app.analysis.study_data.trial import ERROR_KINDS, ErrorKind, TrialTrace
from app.storage.tables import Method

Row = dict[str, Any]
TEXT, INTEGER, NUMBER, TRUTH = pa.string(), pa.int64(), pa.float64(), pa.bool_()
CELL = [("group", TEXT), ("mode", TEXT), ("condition", TEXT), ("error", TEXT), ("unit", TEXT)]
UNIT_NAMES: Mapping[ErrorKind, str] = {"translation": "mm", "rotation": "deg"}


def drawn_curves(report: Report) -> Iterator[tuple[Cell, Method | None, Drawn]]:
    """Every curve, with its cell and by which method; None is the human."""
    return ((cell, method, drawn) for cell in report.cells for method, drawn in cell.curves)


def hand_row(method: Method | None) -> Row:
    """Whose curve it is."""
    return {"hand": "human" if method is None else "stg", "method": method}


def cell_row(cell: Cell) -> Row:
    """What `CELL` says of a cell."""
    return {
        "group": cell.group,
        "mode": cell.mode,
        "condition": cell.condition,
        "error": cell.error,
        "unit": UNIT_NAMES[cell.error],
    }


def interval_row(name: str, interval: Interval, error: ErrorKind | None) -> Row:
    """A mean and its interval as three columns; without an error, in the unit that it has."""

    def told(value: float) -> float:
        return value if error is None else in_people_units(value, error)

    return {name: told(interval.mean), f"{name}_low": told(interval.low), f"{name}_high": told(interval.high)}


def sample_row(trial: TrialTrace, i: int) -> Row:
    """The errors of a trial at its i-th moment, and of the snaps from there."""
    return {
        "is_simulated": trial.is_simulated,
        "seconds": float(trial.seconds[i]),
        "translation_mm": in_people_units(float(trial.errors.translation[i]), "translation"),
        "rotation_deg": in_people_units(float(trial.errors.rotation[i]), "rotation"),
        **_stg_row("stg", trial, "default", i),
        **_stg_row("paper", trial, "paper", i),
    }


def _stg_row(name: str, trial: TrialTrace, method: Method, i: int) -> Row:
    translation, rotation = (float(trial.stg_of_kind(kind, method)[i]) for kind in ERROR_KINDS)
    return {
        f"{name}_translation_mm": in_people_units(translation, "translation"),
        f"{name}_rotation_deg": in_people_units(rotation, "rotation"),
    }
