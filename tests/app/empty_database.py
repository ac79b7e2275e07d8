"""Empty SQLite databases with their tables, quickly: migrating is done once, and its result is copied."""

from functools import cache
from pathlib import Path
from tempfile import TemporaryDirectory

from app.storage.database import Database

NAME = "snap6d.sqlite"


def new_empty_database(folder: Path) -> Database:
    """A database of its own in a folder, under the name that it has in a state folder."""
    folder.mkdir(parents=True, exist_ok=True)
    (folder / NAME).write_bytes(_migrated())
    return Database(f"sqlite:///{folder / NAME}")


@cache
def _migrated() -> bytes:
    """The file of a database that was just made."""
    with TemporaryDirectory() as folder:
        database = Database(f"sqlite:///{folder}/{NAME}")
        database.migrate()
        database.close()  # which writes the log of SQLite back into the file
        return Path(folder, NAME).read_bytes()
