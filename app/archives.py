"""Takes datasets in that come as zip files, of which nothing is trusted."""

import errno
import lzma
import shutil
import tempfile
import zipfile
import zlib
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from app.database import Database
from app.importing import DatasetImportError, ImportSummary, import_dataset
from app.storage import FileStore

UNREADABLE = (
    zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError, zlib.error, lzma.LZMAError
)  # fmt: skip
"""What Python's zip reader raises where an archive is damaged, encrypted, or packed in an unknown way."""
IMPOSSIBLE_NAME = frozenset({errno.EEXIST, errno.EISDIR, errno.ENOTDIR, errno.ENAMETOOLONG})
"""Errors of the file system about an entry's name, not about the disk."""


def import_archive(
    database: Database, files: FileStore, archive: Path, name: str, max_bytes: int
) -> ImportSummary:
    """Import a zip file that holds one BOP dataset, at its top or in one folder.

    Raises:
        ValueError: in one sentence, as `import_dataset` does, and where the archive is no sound zip file, is
            too large when unpacked, or has an entry that would climb out of its folder.
    """
    with _unpacked(archive, max_bytes) as folder:
        inner = [entry for entry in folder.iterdir() if entry.name != "__MACOSX"]
        root = inner[0] if len(inner) == 1 and inner[0].is_dir() else folder
        return import_dataset(database, files, root, name if root == folder else root.name)


@contextmanager
def _unpacked(archive: Path, max_bytes: int) -> Iterator[Path]:
    with tempfile.TemporaryDirectory(dir=archive.parent) as folder:
        try:
            _unpack(archive, Path(folder), max_bytes)
        except UNREADABLE as error:
            raise DatasetImportError(
                f"the upload is no readable zip file ({error}); pack the dataset again"
            ) from error
        yield Path(folder)


def _unpack(archive: Path, folder: Path, max_bytes: int) -> None:
    with zipfile.ZipFile(archive) as source:
        entries = source.infolist()
        if sum(entry.file_size for entry in entries) > max_bytes:
            raise DatasetImportError(
                f"the archive holds more than {max_bytes // 2**20} MB; import it with `snap6d import`"
            )
        for entry in entries:
            _check_entry(entry)
        for entry in entries:
            try:
                _extract(source, entry, folder)
            except OSError as error:
                if error.errno not in IMPOSSIBLE_NAME:
                    raise
                raise DatasetImportError(
                    f"the archive's entry {entry.filename!r} cannot be unpacked ({error.strerror}); rename it"
                ) from error


def _check_entry(entry: zipfile.ZipInfo) -> None:
    path = PurePosixPath(entry.filename.replace("\\", "/"))
    is_link = (entry.external_attr >> 16) & 0o170000 == 0o120000
    if path.is_absolute() or ".." in path.parts or ":" in "".join(path.parts[:1]) or is_link:
        raise DatasetImportError(f"the archive's entry {entry.filename!r} leads out of its folder; remove it")


def _extract(source: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path) -> None:
    """Unpack one entry, but never more than it announced."""
    target = folder / entry.filename
    if entry.is_dir():
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    with source.open(entry) as packed, target.open("wb") as unpacked:
        shutil.copyfileobj(packed, unpacked)
