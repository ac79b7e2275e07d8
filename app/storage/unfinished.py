"""Folders for what is not finished yet: gone when their block ends; those of killed processes, at a start."""

import fcntl
import logging
import os
import shutil
import tempfile
from collections.abc import Iterator
from contextlib import ExitStack, contextmanager
from pathlib import Path

logger = logging.getLogger(__name__)

PREFIX = ".unfinished-"


@contextmanager
def unfinished(parent: Path) -> Iterator[Path]:
    """A new folder in `parent`, which has to be there; what is finished is moved out of it before it goes.

    It is locked for as long as its process lives, so that `clear_unfinished` knows it from one that a killed
    process left: the system drops a lock with its process, whatever ended that, also in another container.
    """
    with ExitStack() as lock:
        with _locked(parent, fcntl.LOCK_SH):  # nobody clears between the making and the locking
            folder = Path(tempfile.mkdtemp(prefix=PREFIX, dir=parent))
            lock.enter_context(_locked(folder, fcntl.LOCK_EX))
        try:
            yield folder
        finally:
            shutil.rmtree(folder, ignore_errors=True)


def clear_unfinished(*parents: Path) -> None:
    """Remove what killed processes left in folders, some of which may not be there."""
    for parent in filter(Path.is_dir, parents):
        with _locked(parent, fcntl.LOCK_EX):
            for folder in parent.glob(f"{PREFIX}*"):
                try:
                    with _locked(folder, fcntl.LOCK_EX | fcntl.LOCK_NB) as is_locked:
                        if not is_locked:  # nobody can tell whether its process lives
                            continue
                        shutil.rmtree(folder, ignore_errors=True)
                except BlockingIOError:  # its process lives
                    continue
                logger.info("removed %s, which a killed program left unfinished", folder)


@contextmanager
def _locked(folder: Path, how: int) -> Iterator[bool]:
    """Tells whether the folder is locked: some file systems, NFS among them, lock no folders."""
    handle = os.open(folder, os.O_RDONLY | os.O_DIRECTORY)
    try:
        try:
            fcntl.flock(handle, how)
        except BlockingIOError:
            raise
        except OSError:
            yield False
        else:
            yield True
    finally:
        os.close(handle)
