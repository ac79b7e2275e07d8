"""One more table is one more file: here one of the operators and their trials."""

import sys
from collections.abc import Iterator
from pathlib import Path

import pytest

from app.analysis.report import tables
from app.analysis.report.report import ReportConfig, report_of
from app.analysis.report.report_files import file_names, file_of
from app.analysis.report.tables import registry
from tests.app.analysis.report.test_report import collected_of, four

OPERATORS = """
from collections import Counter
from app.analysis.report.tables.columns import INTEGER, TEXT
from app.analysis.report.tables.registry import Table

def rows(report):
    for operator, count in Counter(trial.operator for trial in report.collected.trials).items():
        yield {"operator": operator, "trials": count}

TABLE = Table("operators", [("operator", TEXT), ("trials", INTEGER)], rows)
"""


@pytest.fixture
def one_more(tmp_path: Path, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """A file more in the folder of tables."""
    (tmp_path / "operators.py").write_text(OPERATORS)
    monkeypatch.setattr(tables, "__path__", [*tables.__path__, str(tmp_path)])
    registry.tables.cache_clear()
    yield
    registry.tables.cache_clear()
    del sys.modules[f"{tables.__name__}.operators"]


@pytest.mark.usefixtures("one_more")
def test_a_file_is_a_table() -> None:
    report = report_of(collected_of(four("P1"), four("P2"), four("P1", condition="find it")), ReportConfig())
    assert {"operators.csv", "operators.parquet", "curves.csv"} <= set(file_names())
    assert file_of(report, "operators.csv").decode().splitlines() == [
        '"operator","trials","is_simulated"',
        '"P1",2,false',
        '"P2",1,false',
    ]


def test_every_file_of_the_folder_is_a_table_of_its_name() -> None:
    files = {path.stem for path in Path(registry.__file__).parent.glob("*.py")}
    assert set(registry.tables()) == files - {"__init__", "registry", "columns"}
