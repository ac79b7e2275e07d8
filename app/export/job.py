"""Export jobs: write, check, pack; an export that fails serves nothing and leaves nothing half-written."""

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

from sqlalchemy import select
from sqlalchemy.orm import joinedload

from app.export.archive import pack
from app.export.bop.dataset import ModelCache, write_dataset
from app.export.bop.interaction_log import write_interaction_log
from app.export.content.selection import EVERYTHING, Choice, ExportError, Selection, select_dataset
from app.export.formats.registry import formats
from app.export.gate.checks import Failure, ObjectsError, check_export, expected_images
from app.export.gate.failure_picture import failure_picture
from app.export.gate.instance import GateError
from app.storage.database import Database
from app.storage.faults import advice
from app.storage.files import DamagedFileError, FileStore
from app.storage.tables import NAMED, Export, Registration
from app.storage.unfinished import unfinished
from registration_core.geometry import pose

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
    database: Database,
    files: FileStore,
    dataset_id: int,
    target: Path,
    progress: Progress,
    format_name: str = "bop",
    choice: Choice = EVERYTHING,
) -> ExportSummary:
    """Write, check and pack a dataset; `target` is a zip file if it ends in .zip, else a new folder.

    The target appears whole or not at all; a zip that is there is replaced.

    Args:
        database: That holds the dataset.
        files: That hold its images and meshes.
        dataset_id: Of the dataset.
        target: What is written.
        progress: Told how far it is.
        format_name: What it is given as, one of `formats()`; all went through the same gate.
        choice: Which part of the dataset.

    Raises:
        ExportError: where nothing can be exported or the target folder exists.
        ObjectsError: where some objects are not where the depth images show them.
        GateError: where what was written is wrong.
    """
    if target.suffix != ".zip" and target.exists():
        raise ExportError(f"{target} exists; choose another folder")
    with database.read() as session:
        selection = select_dataset(session, dataset_id, choice)
    target.parent.mkdir(parents=True, exist_ok=True)
    with temporary_folder(target.parent / f".{target.name}.part") as work:
        checked, folder = (work / state / folder_name(selection) for state in ("checked", "given"))
        for path in (checked, folder):
            path.parent.mkdir()
        write_checked(database, files, selection, checked, progress)
        formats()[format_name].write(checked, folder)
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
    lost = out_of_reach(selection)
    if lost:
        raise ObjectsError(lost)
    write_dataset(selection, files, folder, scaled(progress, 0.0, WRITING))
    with database.read() as session:
        write_interaction_log(session, selection.dataset_id, folder / "interaction_log")
    check_export(folder, expected_images(selection), scaled(progress, WRITING, CHECKING))


def out_of_reach(selection: Selection) -> list[Failure]:
    """Objects so far away that nothing can be computed of them."""
    found: dict[int, Failure] = {}
    for scene in selection.scenes:
        for image in scene.images:
            for annotation in image.annotations:
                if not pose.is_within_reach(annotation.T_world_object):
                    failure = Failure(
                        annotation.registration_id,
                        scene.split,
                        scene.scene_id,
                        image.image_id,
                        f"{scene.folder}, image {image.image_id}, object {annotation.obj_id}",
                        "the pose is out of all reach; register the object again",
                    )
                    found.setdefault(annotation.registration_id, failure)
    return list(found.values())


def run_job(database: Database, files: FileStore, export_id: int) -> bool:
    """Do an export that the database asks for; its row tells how it goes and how it ended.

    Returns:
        Whether it succeeded.

    Raises:
        ExportError: where there is no such export, it is not waiting to be done, or it was ended meanwhile.
    """
    export = begin_job(database, export_id)
    files.root.mkdir(parents=True, exist_ok=True)
    try:
        report = ProgressReport(database, export_id)
        with unfinished(files.root) as work:
            packed = work / "export.zip"
            summary = export_dataset(
                database, files, export.dataset_id, packed, report, export.format, choice_of(export)
            )
            file_hash = files.adopt(packed)
        message = (
            f"Scenes: {summary.scenes}, images: {summary.images}, annotated objects: {summary.annotations}."
        )
        update_job(database, export_id, state="done", progress=1.0, message=message, file_hash=file_hash)
    except BaseException as error:
        message = sentence(error)[:LONGEST_MESSAGE]
        failures = told_failures(database, files, export, error) if isinstance(error, ObjectsError) else []
        update_job(database, export_id, state="failed", message=message, failures=failures)
        if not isinstance(error, Exception):
            raise
        return False
    return True


def choice_of(export: Export) -> Choice:
    """The part of its dataset that an export was asked for."""
    scene_ids = export.choice["scene_ids"]
    return Choice(None if scene_ids is None else frozenset(scene_ids), frozenset(export.choice["without"]))


def told_failures(
    database: Database, files: FileStore, export: Export, error: ObjectsError
) -> list[dict[str, Any]]:
    """What people are told of objects that did not pass: which they are, whose, why, and a picture each."""
    with database.read() as session:
        selection = select_dataset(session, export.dataset_id, choice_of(export))
        rows = {
            row.id: row
            for row in session.scalars(
                select(Registration)
                .where(Registration.id.in_([failure.registration_id for failure in error.failures]))
                .options(
                    joinedload(Registration.user),
                    joinedload(Registration.task).options(*NAMED),
                )
            )
        }
    models = ModelCache(files, selection.objects)
    images = {
        (scene.split, scene.scene_id, image.image_id): image
        for scene in selection.scenes
        for image in scene.images
    }
    told = []
    for failure in error.failures:
        row = rows[failure.registration_id]
        image = images[failure.split, failure.scene_id, failure.image_id]
        annotation = next(a for a in image.annotations if a.registration_id == row.id)
        picture = failure_picture(image, annotation, models[annotation.obj_id], files)
        told.append(
            {
                "registration_id": row.id,
                "task_id": row.task_id,
                "object": row.task.name,
                "operator": row.user.name,
                "scene": f"{failure.split}/{failure.scene_id:06d}",
                "image_id": failure.image_id,
                "reason": failure.reason,
                "picture_hash": files.put_bytes(picture),
            }
        )
    return told


def begin_job(database: Database, export_id: int) -> Export:
    """Mark an export as running and return it."""
    with database.write() as session:
        export = session.get(Export, export_id)
        if export is None:
            raise ExportError(f"export {export_id} does not exist")
        if export.state != "queued":
            raise ExportError(f"export {export_id} is {export.state}; only a queued export can be started")
        export.state = "running"
        return export


def update_job(database: Database, export_id: int, **values: Any) -> None:
    """Change fields of the row of a running export.

    Raises:
        ExportError: where it does not run any more: a server that took it for dead has said how it ended.
    """
    with database.write() as session:
        export = session.get_one(Export, export_id)
        if export.state != "running":
            raise ExportError(f"export {export_id} is {export.state} already; start another one")
        for field, value in values.items():
            setattr(export, field, value)


def sentence(error: BaseException) -> str:
    """What an export's row says about its failure; a failure nobody foresaw is logged with its trace."""
    match error:
        case ExportError() | GateError() | DamagedFileError():
            return str(error)
        case Exception() if known := advice(error):
            return known
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
