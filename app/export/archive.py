"""A folder as a zip file: the same files give the same bytes."""

import shutil
import zipfile
from collections.abc import Callable
from pathlib import Path

FIRST_MOMENT = (1980, 1, 1, 0, 0, 0)
"""The earliest time a zip can hold, given to every file."""

COMPRESSED_ALREADY = {".png", ".jpg", ".parquet"}

UNIX = 3
FILE_PERMISSIONS = 0o100644 << 16


def pack(folder: Path, archive: Path, progress: Callable[[float], None]) -> None:
    """Write all files of a folder, under the folder's name, into a new zip; progress goes from 0 to 1."""
    paths = sorted(path for path in folder.rglob("*") if path.is_file())
    sizes = [path.stat().st_size for path in paths]
    done, total = 0, max(1, sum(sizes))
    with zipfile.ZipFile(archive, "w") as zipped:
        for path, size in zip(paths, sizes, strict=True):
            with path.open("rb") as source, zipped.open(entry_of(path, folder, size), "w") as target:
                shutil.copyfileobj(source, target, 1 << 20)
            done += size
            progress(done / total)


def entry_of(path: Path, folder: Path, size: int) -> zipfile.ZipInfo:
    """How a file is named and kept in the zip."""
    entry = zipfile.ZipInfo(path.relative_to(folder.parent).as_posix(), FIRST_MOMENT)
    entry.compress_type = zipfile.ZIP_STORED if path.suffix in COMPRESSED_ALREADY else zipfile.ZIP_DEFLATED
    entry.create_system = UNIX
    entry.external_attr = FILE_PERMISSIONS
    entry.file_size = size  # decides whether the entry needs 64-bit sizes
    return entry
