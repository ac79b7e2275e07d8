"""What an import has left behind."""

from sqlalchemy import select

from app.datasets.importing import ImportSummary
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.tables import Base


def everything(database: Database, files: FileStore) -> tuple[list[str], set[str]]:
    """All rows and all files."""
    with database.engine.connect() as connection:
        rows = [
            f"{table.name} {row!r}"
            for table in Base.metadata.sorted_tables
            for row in connection.execute(select(table).order_by(*table.primary_key.columns))
        ]
    return rows, {path.name for path in files.root.rglob("*") if path.is_file()}


def added(summary: ImportSummary) -> tuple[int, int, int, int]:
    return summary.objects, summary.scenes, summary.frames, summary.tasks
