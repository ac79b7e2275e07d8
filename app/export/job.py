"""Export jobs: write, check, pack; an export that fails serves nothing and leaves nothing half-written."""

import errno
import logging
import os
import re
import shutil
import time
from collections.abc import Callable, Iterator
from contextlib import contextmanager
from dataclasses import dataclass
from pathlib import Path
from typing import Any

from app.database import Database
from app.export.archive import pack
from app.export.bop_dataset import write_dataset
from app.export.gate import check_export, expected_images
from app.export.gate_instance import GateError
from app.export.interaction_log import write_interaction_log
from app.export.selection import ExportError, Selection, select_dataset
from app.storage import FileStore
from app.tables import Export

log = logging.getLogger(__name__)

Progress = Callable[[float, str], None]

WRITING, CHECKING = 0.55, 0.95
"""Shares of the whole at which writing and checking end."""

SECONDS_BETWEEN_REPORTS = 0.5
LONGEST_MESSAGE = 2000


@dataclass(frozen=True)
class ExportSummary:
    """What an export holds."""

    name: str
    """The folder inside the zip."""
    scenes: int
    images: int
    annotations: int
    """Object instances with a pose; one counts once, in however many images it is seen."""


def export_dataset(
    database: Database, files: FileStore, dataset_id: int, target: Path, progress: Progress
) -> ExportSummary:
    """Write, check and pack a dataset; `target` is a zip file if it ends in .zip, else a new folder.

    The target appears whole or not at all; a zip that is there is replaced.

    Raises:
        ExportError: where nothing can be exported or the target folder exists.
        GateError: where what was written is wrong.
    """
    if target.suffix != ".zip" and target.exists():
        raise ExportError(f"{target} exists; choose another folder")
    with database.read() as session:
        selection = select_dataset(session, dataset_id)
    target.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder(target.parent / f".{target.name}.part") as work:
        folder = work / folder_name(selection)
        write_checked(database, files, selection, folder, progress)
        if target.suffix == ".zip":
            packed = work / "packed.zip"
            pack(folder, packed, part(progress, CHECKING, 1.0, "packing"))
            os.replace(packed, target)
        else:
            os.replace(folder, target)
    progress(1.0, "done")
    images = sum(len(scene.images) for scene in selection.scenes)
    return ExportSummary(folder.name, len(selection.scenes), images, len(selection.annotations))


def write_checked(
    database: Database, files: FileStore, selection: Selection, folder: Path, progress: Progress
) -> None:
    """Write a dataset with its interaction log into a new folder, and send it through the gate."""
    write_dataset(selection, files, folder, scaled(progress, 0.0, WRITING))
    with database.read() as session:
        write_interaction_log(session, selection.dataset_id, folder / "interaction_log")
    check_export(folder, expected_images(selection), scaled(progress, WRITING, CHECKING))


def run_job(database: Database, files: FileStore, export_id: int) -> bool:
    """Do an export that the database asks for; its row tells how it goes and how it ended.

    Returns:
        Whether it succeeded.

    Raises:
        ExportError: where there is no such export, or it is not waiting to be done.
    """
    dataset_id = begin_job(database, export_id)
    packed = files.root / f"export-{export_id}.zip"
    packed.parent.mkdir(parents=True, exist_ok=True)
    try:
        report = ProgressReport(database, export_id)
        summary = export_dataset(database, files, dataset_id, packed, report)
        file_hash = files.adopt(packed)
        message = (
            f"Scenes: {summary.scenes}, images: {summary.images}, annotated objects: {summary.annotations}."
        )
        update_job(database, export_id, state="done", progress=1.0, message=message, file_hash=file_hash)
    except BaseException as error:
        packed.unlink(missing_ok=True)
        message = sentence(error)[:LONGEST_MESSAGE]
        update_job(database, export_id, state="failed", message=message)
        if not isinstance(error, Exception):
            raise
        return False
    return True


def begin_job(database: Database, export_id: int) -> int:
    """Mark an export as running and return the id of its dataset."""
    with database.write() as session:
        export = session.get(Export, export_id)
        if export is None:
            raise ExportError(f"export {export_id} does not exist")
        if export.state != "queued":
            raise ExportError(f"export {export_id} is {export.state}; only a queued export can be started")
        export.state = "running"
        return export.dataset_id


def update_job(database: Database, export_id: int, **values: Any) -> None:
    """Change fields of an export's row."""
    with database.write() as session:
        export = session.get_one(Export, export_id)
        for field, value in values.items():
            setattr(export, field, value)


def sentence(error: BaseException) -> str:
    """What an export's row says about its failure; a failure nobody foresaw is logged with its trace."""
    match error:
        case ExportError() | GateError():
            return str(error)
        case OSError(errno=errno.ENOSPC):
            return "the disk is full; free some space, then export again"
        case Exception():
            log.error("export failed", exc_info=error)
            return (
                f"the export failed unexpectedly ({type(error).__name__}: {error}); the server's log has more"
            )
        case _:
            return "the export was stopped; start it again"


class ProgressReport:
    """Writes progress into an export's row, a few times a second at most."""

    def __init__(self, database: Database, export_id: int) -> None:
        self._database = database
        self._export_id = export_id
        self._next = time.monotonic()

    def __call__(self, share: float, message: str) -> None:
        """Note the share done, 0 to 1, and what is being done."""
        if time.monotonic() < self._next:
            return
        update_job(self._database, self._export_id, progress=share, message=message)
        self._next = time.monotonic() + SECONDS_BETWEEN_REPORTS


def scaled(progress: Progress, start: float, end: float) -> Progress:
    """Progress of a part that runs from `start` to `end` of the whole."""
    return lambda share, message: progress(start + (end - start) * share, message)


def part(progress: Progress, start: float, end: float, message: str) -> Callable[[float], None]:
    """The same for a part that has one message."""
    return lambda share: progress(start + (end - start) * share, message)


@contextmanager
def temporary_folder(folder: Path) -> Iterator[Path]:
    """A new folder that is gone afterwards; what a killed run left in its place goes too."""
    shutil.rmtree(folder, ignore_errors=True)
    folder.mkdir()
    try:
        yield folder
    finally:
        shutil.rmtree(folder, ignore_errors=True)


def folder_name(selection: Selection) -> str:
    """The dataset's name as the name of a folder."""
    name = re.sub(r"[^A-Za-z0-9._-]+", "_", selection.name).strip("._")
    return name or f"dataset_{selection.dataset_id}"
