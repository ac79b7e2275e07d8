"""Runs exports one after the other, each in a process of its own: the server stays quick and small."""

import logging
import os
import subprocess
import sys
import threading
from concurrent.futures import ThreadPoolExecutor

from sqlalchemy import select
from sqlalchemy.exc import DBAPIError

from app.config import Settings
from app.export.content.selection import EVERYTHING, Choice
from app.storage.database import Database
from app.storage.faults import told
from app.storage.tables import Export
from app.storage.unfinished import clear_unfinished

logger = logging.getLogger(__name__)

SECONDS_BETWEEN_TRIES = 2.0
UNFINISHED = ("queued", "running")
INTERRUPTED = "The server stopped while this export ran. Start it again."
DIED = "The export's process died; the server's log says why. Start it again."


class ExportJobs:
    """The exports under way. What becomes of them is in the `exports` table."""

    def __init__(self, database: Database, settings: Settings) -> None:
        self._database = database
        self._files_dir = settings.files_dir
        self._environment = {
            **os.environ,
            "SNAP6D_STATE_DIR": str(settings.state_dir.resolve()),
            "SNAP6D_DATABASE_URL": settings.resolved_database_url,
        }
        self._queue = ThreadPoolExecutor(max_workers=1, thread_name_prefix="exports")
        self._lock = threading.Lock()
        self._closing = threading.Event()
        self._process: subprocess.Popen[bytes] | None = None

    def fail_interrupted(self) -> None:
        """Say of exports that an earlier run of the server left unfinished that they failed."""
        self._fail(UNFINISHED, INTERRUPTED)

    def start(self, dataset_id: int, format_name: str, user_id: int, choice: Choice = EVERYTHING) -> Export:
        """Queue an export of a dataset, or of a part of it."""
        kept = {
            "scene_ids": None if choice.scene_ids is None else sorted(choice.scene_ids),
            "without": sorted(choice.without),
        }
        with self._database.write() as session:
            row = Export(dataset_id=dataset_id, format=format_name, choice=kept, user_id=user_id)
            session.add(row)
            session.flush()
        self._queue.submit(self._run, row.id)
        return row

    def close(self) -> None:
        """Stop the export under way and forget those that wait."""
        self._closing.set()
        self._queue.shutdown(wait=False, cancel_futures=True)
        with self._lock:
            if self._process is not None:
                self._process.terminate()
        self._queue.shutdown(wait=True)

    def _run(self, export_id: int) -> None:
        command = [sys.executable, "-m", "app.export", str(export_id), "--while-stdin-is-open"]
        with self._lock:  # the pipe ends with this server, however it ends, and the export with the pipe
            self._process = subprocess.Popen(command, env=self._environment, stdin=subprocess.PIPE)
        with self._process as process:
            code = process.wait()
        with self._lock:
            self._process = None
        if code != 0:
            logger.error("export %s ended with code %s", export_id, code)
            clear_unfinished(self._files_dir)
            self._say_died(export_id)

    def _say_died(self, export_id: int) -> None:
        """Say it in the export's row; where there is no room for it, as soon as there is."""
        while True:
            try:
                return self._fail(UNFINISHED, DIED, export_id)
            except DBAPIError as error:
                logger.error("export %s cannot be said to have failed: %s", export_id, told(error))
            if self._closing.wait(SECONDS_BETWEEN_TRIES):
                return None

    def _fail(self, states: tuple[str, ...], message: str, export_id: int | None = None) -> None:
        query = select(Export).where(Export.state.in_(states))
        if export_id is not None:
            query = query.where(Export.id == export_id)
        with self._database.write() as session:
            for row in session.scalars(query):
                row.state = "failed"
                row.message = message
