"""The numbers of a report as tables: CSV and Parquet, the same bytes for the same numbers."""

import io
import math
from typing import Any

import pyarrow as pa
import pyarrow.csv as pa_csv
import pyarrow.parquet as pq

from app.analysis.report.report import Report
from app.analysis.report.tables.registry import Table

DIGITS = 9
"""Significant ones: what lies beyond is rounding, which may differ between machines."""


def filled(table: Table, report: Report) -> pa.Table:
    """A table with the rows of a report."""
    simulated = {"is_simulated": report.collected.is_simulated}
    rows = [simulated | {key: _rounded(value) for key, value in row.items()} for row in table.rows(report)]
    return pa.Table.from_pylist(rows, pa.schema([*table.columns, ("is_simulated", pa.bool_())]))


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
