"""The files of a report."""

from pathlib import Path

from app.analysis.report.figure import figure_bytes
from app.analysis.report.page import page_of
from app.analysis.report.report import Report
from app.analysis.report.table_files import csv_bytes, filled, parquet_bytes
from app.analysis.report.tables import registry


def file_names() -> list[str]:
    """Figure, page, and each table as CSV and Parquet."""
    tables = [f"{name}.{suffix}" for name in registry.tables() for suffix in ("csv", "parquet")]
    return ["figure.svg", "figure.pdf", "report.html", *tables]


def file_of(report: Report, name: str) -> bytes:
    """The content of one of the files, the same bytes for the same numbers."""
    stem, suffix = name.split(".")
    if suffix == "html":
        return page_of(report).encode()
    if suffix in ("svg", "pdf"):
        return figure_bytes(report, "svg" if suffix == "svg" else "pdf")
    table = filled(registry.tables()[stem], report)
    return csv_bytes(table) if suffix == "csv" else parquet_bytes(table)


def write_report(report: Report, folder: Path) -> list[Path]:
    """Write figure, tables and the one-file page into a folder, the same bytes for the same log.

    Returns:
        The files.
    """
    folder.mkdir(parents=True, exist_ok=True)
    paths = [folder / name for name in file_names()]
    for path in paths:
        path.write_bytes(file_of(report, path.name))
    return paths
