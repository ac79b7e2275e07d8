"""A content-addressed file store: a file's name is the hash of its content, so no request can name a path."""

import hashlib
import os
import re
import tempfile
from pathlib import Path

HASH_PATTERN = re.compile(r"[0-9a-f]{64}")


class FileStore:
    """Immutable files under one folder, each kept once."""

    def __init__(self, root: Path) -> None:
        self.root = root

    def put_bytes(self, content: bytes) -> str:
        """Keep the content and return its hash; it is whole on the disk when this returns."""
        digest = hashlib.sha256(content).hexdigest()
        target = self.path(digest)
        if not target.exists():
            target.parent.mkdir(parents=True, exist_ok=True)
            _write_whole(target, content)
        return digest

    def put_file(self, source: Path) -> str:
        """Keep a copy of a file and return its hash."""
        return self.put_bytes(source.read_bytes())

    def path(self, digest: str) -> Path:
        """Where the content with this hash is, or would be."""
        assert HASH_PATTERN.fullmatch(digest)
        return self.root / digest[:2] / digest

    def read(self, digest: str) -> bytes:
        """The content with this hash."""
        return self.path(digest).read_bytes()

    def adopt(self, source: Path) -> str:
        """Move a finished file of any size into the store and return its hash."""
        with source.open("rb") as stream:
            digest = hashlib.file_digest(stream, "sha256").hexdigest()
            os.fsync(stream.fileno())
        target = self.path(digest)
        target.parent.mkdir(parents=True, exist_ok=True)
        os.replace(source, target)
        return digest


def _write_whole(target: Path, content: bytes) -> None:
    handle, temporary = tempfile.mkstemp(dir=target.parent)
    try:
        with os.fdopen(handle, "wb") as stream:
            stream.write(content)
            stream.flush()
            os.fsync(stream.fileno())
        os.replace(temporary, target)
    except BaseException:
        Path(temporary).unlink(missing_ok=True)
        raise
