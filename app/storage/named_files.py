"""What the files of the store are to people: which rows name them, and what brings one back."""

from collections.abc import Iterator
from pathlib import Path
from typing import Any

from sqlalchemy import ColumnElement, select
from sqlalchemy.orm import InstrumentedAttribute, Session

from app.storage.database import Database
from app.storage.files import FileStore, StoredFile
from app.storage.tables import Dataset, Export, Frame, Object, Scene

Column = InstrumentedAttribute[Any]
"""One with hashes; rows that name no file are left out."""

SURFACES: tuple[tuple[Column, str], ...] = (
    (Object.mesh_hash, "mesh"),
    (Object.texture_hash, "texture"),
)
IMAGES: tuple[tuple[Column, str], ...] = (
    (Frame.depth_hash, "depth image"),
    (Frame.color_hash, "colour image"),
)
ARCHIVE: Column = Export.file_hash


def open_store(root: Path, database: Database) -> FileStore:
    """The file store of a database, which says of a damaged file what it is."""

    def describe(digest: str) -> StoredFile:
        with database.read() as session:
            unnamed = StoredFile(digest, "a file that no row names", "nothing needs it")
            return next(named_files(session, digest), unnamed)

    return FileStore(root, describe)


def named_files(session: Session, digest: str | None = None) -> Iterator[StoredFile]:
    """Every file that a row names, or what one file is; where several rows name one, it comes for each."""
    for column, kind in SURFACES:
        objects = select(column, Object.name, Dataset.name)
        objects = objects.join(Dataset, Object.dataset_id == Dataset.id)
        for found, name, dataset in session.execute(objects.where(_names(column, digest))):
            yield StoredFile(found, f"the {kind} of object {name!r} of dataset {dataset!r}", _again(dataset))
    for column, kind in IMAGES:
        images = select(column, Frame.image_id, Scene.label, Dataset.name)
        images = images.join(Frame.scene).join(Scene.dataset)
        for found, image_id, scene, dataset in session.execute(images.where(_names(column, digest))):
            what = f"the {kind} of image {image_id} in {scene} of dataset {dataset!r}"
            yield StoredFile(found, what, _again(dataset))
    archives = select(ARCHIVE, Export.id, Dataset.name).join(Export.dataset)
    for found, export_id, dataset in session.execute(archives.where(_names(ARCHIVE, digest))):
        yield StoredFile(found, f"the archive of export {export_id}", f"export dataset {dataset!r} again")
    failed = select(Export.id, Export.failures, Dataset.name).join(Export.dataset)
    for export_id, failures, dataset in session.execute(failed.where(Export.state == "failed")):
        for picture in {failure["picture_hash"] for failure in failures}:
            if digest in (None, picture):
                what = f"a picture of export {export_id}"
                yield StoredFile(picture, what, f"export dataset {dataset!r} again")


def _names(column: Column, digest: str | None) -> ColumnElement[bool]:
    return column.is_not(None) if digest is None else column == digest


def _again(dataset: str) -> str:
    return f"import dataset {dataset!r} again, which puts it back"
