"""The numbers of a report as tables: CSV and Parquet, the same bytes for the same numbers."""

import io
import math
from collections.abc import Mapping
from typing import Any

import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from app.analysis.report.report import Report
from app.analysis.report.table_rows import ROWS

DIGITS = 9
"""Significant ones: what lies beyond is rounding, which may differ between machines."""
TEXT, INTEGER, NUMBER, TRUTH = pa.string(), pa.int64(), pa.float64(), pa.bool_()
CELL = [("group", TEXT), ("mode", TEXT), ("condition", TEXT), ("error", TEXT), ("unit", TEXT)]
SIMULATED = ("is_simulated", TRUTH)
SCHEMAS: Mapping[str, pa.Schema] = {
    "curves": pa.schema(
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
            SIMULATED,
        ]
    ),
    "fitts": pa.schema(
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
            SIMULATED,
        ]
    ),
    "hand_off": pa.schema(
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
            SIMULATED,
        ]
    ),
    "gains": pa.schema(
        [
            *CELL,
            ("method", TEXT),
            ("moment", TEXT),
            *(
                (f"{name}{end}", NUMBER)
                for name in ("before", "after", "gain")
                for end in ("", "_low", "_high")
            ),
            ("improved", NUMBER),
            ("operators", INTEGER),
            ("trials", INTEGER),
            ("verdict", TEXT),
            SIMULATED,
        ]
    ),
    "comparisons": pa.schema(
        [
            ("group", TEXT),
            ("mode", TEXT),
            ("first", TEXT),
            ("second", TEXT),
            ("pairs", INTEGER),
            ("operators", INTEGER),
            *(
                (f"{name}{end}", NUMBER)
                for name in ("seconds", "translation_mm", "rotation_deg")
                for end in ("", "_low", "_high")
            ),
            SIMULATED,
        ]
    ),
    "trials": pa.schema(
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
            SIMULATED,
        ]
    ),
    "samples": pa.schema(
        [
            ("registration_id", INTEGER),
            ("seconds", NUMBER),
            ("idle", TRUTH),
            ("translation_mm", NUMBER),
            ("rotation_deg", NUMBER),
            ("stg_translation_mm", NUMBER),
            ("stg_rotation_deg", NUMBER),
            ("paper_translation_mm", NUMBER),
            ("paper_rotation_deg", NUMBER),
            SIMULATED,
        ]
    ),
    "truths": pa.schema(
        [
            ("place", TEXT),
            ("registrations", INTEGER),
            ("spread_mm", NUMBER),
            ("spread_deg", NUMBER),
            ("from_reference_mm", NUMBER),
            ("from_reference_deg", NUMBER),
            SIMULATED,
        ]
    ),
    "remarks": pa.schema([("about", TEXT), ("text", TEXT), ("registration_id", INTEGER), SIMULATED]),
}


def table_of(report: Report, name: str) -> pa.Table:
    """One table of a report, of those in `SCHEMAS`."""
    simulated = {"is_simulated": report.collected.is_simulated}
    rows = [simulated | {key: _rounded(value) for key, value in row.items()} for row in ROWS[name](report)]
    return pa.Table.from_pylist(rows, SCHEMAS[name])


def csv_bytes(table: pa.Table) -> bytes:
    """A table as CSV, UTF-8, with a header."""
    sink = io.BytesIO()
    pa_csv.write_csv(table, sink)
    return sink.getvalue()


def parquet_bytes(table: pa.Table) -> bytes:
    """A table as Parquet."""
    sink = io.BytesIO()
    pq.write_table(table, sink, compression="zstd")
    return sink.getvalue()


def _rounded(value: Any) -> Any:
    if not isinstance(value, float):
        return value
    return float(f"{value:.{DIGITS}g}") if math.isfinite(value) else None
