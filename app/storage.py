"""Files by hash, so that no request can name a path: of their own content, or of what they were made from."""

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
        _write_whole(target, content)
        for path in self._root.glob(f"{model_hash}.*"):
            if path != target:
                path.unlink(missing_ok=True)

    def _path(self, model_hash: str) -> Path:
        assert HASH_PATTERN.fullmatch(model_hash)
        return self._root / f"{model_hash}.{self._algorithm}"


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
