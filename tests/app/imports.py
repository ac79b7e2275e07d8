"""What an import has left behind."""

import sqlite3

from app.database import Database
from app.importing import ImportSummary
from app.storage import FileStore


def everything(database: Database, files: FileStore) -> tuple[list[str], set[str]]:
    """All rows and all files."""
    connection = sqlite3.connect(str(database.engine.url.database))
    rows = list(connection.iterdump())
    connection.close()
    return rows, {path.name for path in files.root.rglob("*") if path.is_file()}


def added(summary: ImportSummary) -> tuple[int, int, int, int]:
    return summary.objects, summary.scenes, summary.frames, summary.tasks
