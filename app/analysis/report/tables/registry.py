"""Knows the tables of a report: every module of this folder that has a `TABLE` is one."""

from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cache
from types import MappingProxyType

import pyarrow as pa

from app.analysis.report.report import Report
from app.analysis.report.tables.columns import Row
from app.members import members_of


@dataclass(frozen=True)
class Table:
    """One table; whether its operators are simulated is added to every row as `is_simulated`."""

    name: str
    """Of its files, without the suffix."""
    columns: Sequence[tuple[str, pa.DataType]]
    rows: Callable[[Report], Iterator[Row]]
    """Values by column, in millimetres, degrees and seconds; NaN for what is unknown."""


@cache
def tables() -> Mapping[str, Table]:
    """All tables by name."""
    found: list[Table] = members_of(__package__, "TABLE")
    return MappingProxyType({one.name: one for one in found})
