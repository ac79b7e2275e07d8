"""What stands in each row of a report's tables."""

from collections.abc import Callable, Iterator, Mapping
from typing import Any

from app.analysis.report.report import Report
from app.analysis.statistics.bootstrap import Interval
from app.analysis.statistics.cautions import fitts_caution, hand_off_caution
from app.analysis.statistics.cells import Cell, Drawn
from app.analysis.statistics.units import in_people_units
from app.analysis.study_data.trial import ERROR_KINDS, ErrorKind, TrialTrace
from app.storage.tables import Method

Row = dict[str, Any]
UNIT_NAMES: Mapping[ErrorKind, str] = {"translation": "mm", "rotation": "deg"}


def _curve_rows(report: Report) -> Iterator[Row]:
    for cell, method, drawn in _drawn(report):
        curve = drawn.curve
        for k, margin in enumerate(curve.margins.tolist()):
            yield _cell_row(cell) | {
                **_hand_row(method),
                "margin": in_people_units(margin, cell.error),
                "seconds": float(curve.mean[k]),
                "seconds_low": float(curve.low[k]),
                "seconds_high": float(curve.high[k]),
                "operators": int(curve.operators[k]),
                "trials": int(curve.trials[k]),
                "share": float(curve.share[k]),
                "registration_id": drawn.registration_ids[k],
            }


def _fitts_rows(report: Report) -> Iterator[Row]:
    for cell, method, drawn in _drawn(report):
        if (line := drawn.fitts) is not None:
            yield _cell_row(cell) | {
                **_hand_row(method),
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


def _hand_off_rows(report: Report) -> Iterator[Row]:
    curves = [(cell, method, stg) for cell in report.cells for method, stg in cell.stg.items()]
    for cell, method, stg in curves:
        if (point := stg.hand_off) is not None:
            yield _cell_row(cell) | {
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


def _gain_rows(report: Report) -> Iterator[Row]:
    for gain in report.gains:
        yield {
            "group": gain.group,
            "mode": gain.mode,
            "condition": gain.condition,
            "error": gain.error,
            "unit": UNIT_NAMES[gain.error],
            "method": gain.method,
            "moment": gain.moment,
            **_interval_row("before", gain.before, gain.error),
            **_interval_row("after", gain.after, gain.error),
            **_interval_row("gain", gain.gain, gain.error),
            "improved": gain.improved,
            "operators": gain.gain.operators,
            "trials": gain.trials,
            "verdict": gain.verdict,
        }


def _comparison_rows(report: Report) -> Iterator[Row]:
    for pair in report.comparisons:
        yield {
            "group": pair.group,
            "mode": pair.mode,
            "first": pair.first,
            "second": pair.second,
            "pairs": pair.pairs,
            "operators": pair.seconds.operators,
            **_interval_row("seconds", pair.seconds, None),
            **_interval_row("translation_mm", pair.translation, "translation"),
            **_interval_row("rotation_deg", pair.rotation, "rotation"),
        }


def _trial_rows(report: Report) -> Iterator[Row]:
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
            **_sample_row(trial, -1),
        }


def _sample_rows(report: Report) -> Iterator[Row]:
    for trial in report.collected.trials:
        for i in range(len(trial.seconds)):
            yield {
                "registration_id": trial.registration_id,
                "idle": bool(trial.idle[i]),
                **_sample_row(trial, i),
            }


def _truth_rows(report: Report) -> Iterator[Row]:
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


def _remark_rows(report: Report) -> Iterator[Row]:
    for remark in report.remarks:
        yield {"about": remark.about, "text": remark.text, "registration_id": remark.registration_id}


ROWS: Mapping[str, Callable[[Report], Iterator[Row]]] = {
    "curves": _curve_rows,
    "fitts": _fitts_rows,
    "hand_off": _hand_off_rows,
    "gains": _gain_rows,
    "comparisons": _comparison_rows,
    "trials": _trial_rows,
    "samples": _sample_rows,
    "truths": _truth_rows,
    "remarks": _remark_rows,
}


def _drawn(report: Report) -> Iterator[tuple[Cell, Method | None, Drawn]]:
    return ((cell, method, drawn) for cell in report.cells for method, drawn in cell.curves)


def _hand_row(method: Method | None) -> Row:
    return {"hand": "human" if method is None else "stg", "method": method}


def _cell_row(cell: Cell) -> Row:
    return {
        "group": cell.group,
        "mode": cell.mode,
        "condition": cell.condition,
        "error": cell.error,
        "unit": UNIT_NAMES[cell.error],
    }


def _interval_row(name: str, interval: Interval, error: ErrorKind | None) -> Row:
    def told(value: float) -> float:
        return value if error is None else in_people_units(value, error)

    return {name: told(interval.mean), f"{name}_low": told(interval.low), f"{name}_high": told(interval.high)}


def _sample_row(trial: TrialTrace, i: int) -> Row:
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
