"""Files by hash, so that no request can name a path: of their own content, or of what they were made from."""

import hashlib
import os
import re
import tempfile
from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

from app.storage.unfinished import unfinished

HASH_PATTERN = re.compile(r"[0-9a-f]{64}")


class DamagedFileError(Exception):
    """A stored file is not what its hash says; the message names it and what to do."""


@dataclass(frozen=True)
class StoredFile:
    """A file of the store, as people know it."""

    digest: str
    what: str
    remedy: str
    """What brings it back, as a command to a person."""


def _nameless(digest: str) -> StoredFile:
    return StoredFile(digest, "a stored file", "import its dataset again")


class FileStore:
    """Immutable files under one folder, each kept once, and handed out only while they match their hash.

    Args:
        root: The folder; it need not be there yet.
        describe: What the file with a hash is to people; asked where one is damaged.
    """

    def __init__(self, root: Path, describe: Callable[[str], StoredFile] = _nameless) -> None:
        self.root = root
        self._describe = describe

    def put_bytes(self, content: bytes) -> str:
        """Keep the content and return its hash; it is whole on the disk when this returns, even where a
        damaged file was in its place.
        """
        digest = hashlib.sha256(content).hexdigest()
        if self.fault(digest) is not None:
            self.root.mkdir(parents=True, exist_ok=True)
            target = self.place(digest)
            target.parent.mkdir(exist_ok=True)
            _write_whole(target, content, self.root)
        return digest

    def put_file(self, source: Path) -> str:
        """Keep a copy of a file and return its hash."""
        return self.put_bytes(source.read_bytes())

    def path(self, digest: str) -> Path:
        """Where the content with this hash is.

        Raises:
            DamagedFileError: where it is not there, or is not what its hash says.
        """
        fault = self.fault(digest)
        if fault is not None:
            raise self._damaged(digest, fault)
        return self.place(digest)

    def read(self, digest: str) -> bytes:
        """The content with this hash; raises as `path` does."""
        try:
            content = self.place(digest).read_bytes()
        except OSError as error:
            raise self._damaged(digest, _unreadable(error)) from error
        if hashlib.sha256(content).hexdigest() != digest:
            raise self._damaged(digest, DAMAGED)
        return content

    def size(self, digest: str) -> int:
        """Bytes of the content with this hash, which is not read for that; raises where it is not there."""
        try:
            return self.place(digest).stat().st_size
        except OSError as error:
            raise self._damaged(digest, _unreadable(error)) from error

    def fault(self, digest: str) -> str | None:
        """What is wrong with the file of this hash, as the end of a sentence; None where it is whole."""
        try:
            with self.place(digest).open("rb") as stream:
                found = hashlib.file_digest(stream, "sha256").hexdigest()
        except OSError as error:
            return _unreadable(error)
        return None if found == digest else DAMAGED

    def adopt(self, source: Path) -> str:
        """Move a finished file of any size into the store and return its hash."""
        with source.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
            os.fsync(stream.fileno())
        target = self.place(digest)
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(source, target)
        return digest

    def place(self, digest: str) -> Path:
        """Where the content with this hash belongs, whole or not."""
        assert HASH_PATTERN.fullmatch(digest)
        return self.root / digest[:2] / digest

    def _damaged(self, digest: str, fault: str) -> DamagedFileError:
        return DamagedFileError(sentence_of(self._describe(digest), fault))


DAMAGED = "is damaged on the disk"


def sentence_of(file: StoredFile, fault: str) -> str:
    """What is wrong with a file, and what to do."""
    return f"{file.what} {fault} (file {file.digest[:12]}); {file.remedy}"


def _unreadable(error: OSError) -> str:
    missing = isinstance(error, FileNotFoundError)
    return "is missing on the disk" if missing else f"cannot be read from the disk ({error.strerror})"


class PreparedStore:
    """What workers built of objects, by the hash of the object and that of what built it.

    Args:
        root: A folder; it need not be there yet.
        algorithm: Of this version; what another one built counts as missing.
    """

    def __init__(self, root: Path, algorithm: str) -> None:
        self._root = root
        self._algorithm = algorithm

    def read(self, model_hash: str) -> bytes | None:
        """What was built of the object; None where nothing was, or it cannot be read."""
        try:
            return self._path(model_hash).read_bytes()
        except OSError:
            return None

    def put(self, model_hash: str, content: bytes) -> None:
        """Keep what was built of an object, whole on the disk when this returns, in the place of what another
        algorithm built.
        """
        target = self._path(model_hash)
        self._root.mkdir(parents=True, exist_ok=True)
        _write_whole(target, content, self._root)
        for path in self._root.glob(f"{model_hash}.*"):
            if path != target:
                path.unlink(missing_ok=True)

    def _path(self, model_hash: str) -> Path:
        assert HASH_PATTERN.fullmatch(model_hash)
        return self._root / f"{model_hash}.{self._algorithm}"


def _write_whole(target: Path, content: bytes, root: Path) -> None:
    with unfinished(root) as folder:
        handle, temporary = tempfile.mkstemp(dir=folder)
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, target)
