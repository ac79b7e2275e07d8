"""`python -m app.export EXPORT_ID` does a queued export in a process of its own."""

import argparse
import logging
import signal
import sys

from app.config import Settings
from app.database import Database
from app.export.job import run_job
from app.export.selection import ExportError
from app.storage import FileStore


def main(arguments: list[str] | None = None) -> int:
    """Do the export and return 0, or 1 where it failed; where it cannot even start, say why."""
    parser = argparse.ArgumentParser(prog="python -m app.export", description="Do a queued dataset export.")
    parser.add_argument("export_id", type=int)
    export_id = parser.parse_args(arguments).export_id
    logging.basicConfig(level=logging.INFO)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the row says that it was stopped
    settings = Settings()
    database = Database(settings.resolved_database_url)
    try:
        return 0 if run_job(database, FileStore(settings.files_dir), export_id) else 1
    except ExportError as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        database.close()


if __name__ == "__main__":
    sys.exit(main())
