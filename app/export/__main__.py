"""`python -m app.export EXPORT_ID` does a queued export in a process of its own."""

import argparse
import logging
import os
import signal
import sys
import threading

from app.config import Settings
from app.export.content.selection import ExportError
from app.export.job import run_job
from app.storage.database import Database
from app.storage.named_files import open_store


def main(arguments: list[str] | None = None) -> int:
    """Do the export and return 0, or 1 where it failed; where it cannot even start, say why."""
    parser = argparse.ArgumentParser(prog="python -m app.export", description="Do a queued dataset export.")
    parser.add_argument("export_id", type=int)
    parser.add_argument(
        "--while-stdin-is-open",
        action="store_true",
        help="Stop when standard input ends, as it does when whoever holds its other end is killed.",
    )
    given = parser.parse_args(arguments)
    logging.basicConfig(level=logging.INFO)
    signal.signal(signal.SIGTERM, lambda *_: sys.exit(1))  # so that the row says that it was stopped
    if given.while_stdin_is_open:
        threading.Thread(target=_stop_with_stdin, daemon=True).start()
    settings = Settings()
    database = Database(settings.resolved_database_url)
    try:
        return 0 if run_job(database, open_store(settings.files_dir, database), given.export_id) else 1
    except ExportError as error:
        print(error, file=sys.stderr)
        return 1
    finally:
        database.close()


def _stop_with_stdin() -> None:
    # read as a bare file: a thread that waits in `sys.stdin` would abort the interpreter as it ends
    while os.read(0, 1):
        pass
    os.kill(os.getpid(), signal.SIGTERM)


if __name__ == "__main__":
    sys.exit(main())
