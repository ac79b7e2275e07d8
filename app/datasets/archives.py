"""Takes datasets in that come as zip files, of which nothing is trusted."""

import errno
import lzma
import shutil
import tempfile
import zipfile
import zlib
from collections import Counter
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path, PurePosixPath

from app.datasets.importing import DatasetImportError, ImportSummary, import_bop, in_bop_form
from app.storage.database import Database
from app.storage.files import FileStore

UNREADABLE = (
    zipfile.BadZipFile, NotImplementedError, EOFError, RuntimeError, zlib.error, lzma.LZMAError
)  # fmt: skip
"""What Python's zip reader raises where an archive is damaged, encrypted, or packed in an unknown way."""
IMPOSSIBLE_NAME = frozenset({errno.EEXIST, errno.EISDIR, errno.ENOTDIR, errno.ENAMETOOLONG})
"""Errors of the file system about an entry's name, not about the disk."""


def import_archive(
    database: Database,
    files: FileStore,
    archive: Path,
    name: str,
    max_bytes: int,
    depth_scale: float | None = None,
) -> ImportSummary:
    """Import a zip file that holds one dataset, at its top or in a folder, as `import_dataset` does.

    Raises:
        ValueError: in one sentence, as `import_dataset` does, and where the archive is no sound zip file, is
            too large when unpacked, or has an entry that would climb out of its folder.
    """
    with _unpacked(archive, max_bytes) as folder, in_bop_form(folder, files) as root:
        name = name if root == folder else root.name
        return import_bop(database, files, root, name, depth_scale=depth_scale)


@contextmanager
def _unpacked(archive: Path, max_bytes: int) -> Iterator[Path]:
    with tempfile.TemporaryDirectory(dir=archive.parent) as temporary:
        folder = Path(temporary) / "archive"  # a name for messages
        try:
            _unpack(archive, folder, max_bytes)
        except UNREADABLE as error:
            raise DatasetImportError(
                f"the upload is no readable zip file ({error}); pack the dataset again"
            ) from error
        yield folder


def _unpack(archive: Path, folder: Path, max_bytes: int) -> None:
    folder.mkdir()
    with zipfile.ZipFile(archive) as source:
        entries = source.infolist()
        if sum(entry.file_size for entry in entries) > max_bytes:
            raise DatasetImportError(
                f"the archive holds more than {max_bytes // 2**20} MB; import it with `snap6d import`"
            )
        for entry in entries:
            _check_entry(entry)
        _check_names([_path_of(entry) for entry in entries if not _is_folder(entry)])
        for entry in entries:
            try:
                _extract(source, entry, folder)
            except OSError as error:
                if error.errno not in IMPOSSIBLE_NAME:
                    raise
                raise DatasetImportError(
                    f"the archive's entry {entry.filename!r} cannot be unpacked ({error.strerror}); rename it"
                ) from error


def _path_of(entry: zipfile.ZipInfo) -> PurePosixPath:
    """Where an entry goes; archives of some Windows programs part folders by backslashes."""
    return PurePosixPath(entry.filename.replace("\\", "/"))


def _is_folder(entry: zipfile.ZipInfo) -> bool:
    return entry.filename.endswith(("/", "\\"))


def _check_entry(entry: zipfile.ZipInfo) -> None:
    path = _path_of(entry)
    is_link = (entry.external_attr >> 16) & 0o170000 == 0o120000
    if path.is_absolute() or ".." in path.parts or ":" in "".join(path.parts[:1]) or is_link:
        raise DatasetImportError(f"the archive's entry {entry.filename!r} leads out of its folder; remove it")


def _check_names(paths: list[PurePosixPath]) -> None:
    """Raise where an entry would take the place of another."""
    twice = next((path for path, count in Counter(paths).items() if count > 1), None)
    if twice is not None:
        raise DatasetImportError(f"the archive has the entry {str(twice)!r} twice; keep one of the two")


def _extract(source: zipfile.ZipFile, entry: zipfile.ZipInfo, folder: Path) -> None:
    """Unpack one entry, but never more than it announced."""
    target = folder / _path_of(entry)
    if _is_folder(entry):
        target.mkdir(parents=True, exist_ok=True)
        return
    target.parent.mkdir(parents=True, exist_ok=True)
    with source.open(entry) as packed, target.open("wb") as unpacked:
        shutil.copyfileobj(packed, unpacked)
