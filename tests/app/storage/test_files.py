"""The content-addressed file store."""

import hashlib
import threading
from pathlib import Path

import pytest
from hypothesis import HealthCheck, given, settings
from hypothesis import strategies as st

from app.storage.files import DamagedFileError, FileStore, PreparedStore


def stored(files: FileStore) -> list[Path]:
    return sorted(path for path in files.root.rglob("*") if path.is_file())


@settings(suppress_health_check=[HealthCheck.function_scoped_fixture], max_examples=30)
@given(st.binary(max_size=300))
def test_what_was_put_in_comes_out_under_its_hash(files, content):
    digest = files.put_bytes(content)
    assert digest == hashlib.sha256(content).hexdigest()
    assert files.read(digest) == content == files.path(digest).read_bytes()


def test_equal_content_is_kept_once(files, tmp_path):
    (tmp_path / "a.bin").write_bytes(b"same")
    assert files.put_bytes(b"same") == files.put_file(tmp_path / "a.bin")
    assert len(stored(files)) == 1
    assert (tmp_path / "a.bin").exists()


def test_an_adopted_file_is_moved(files, tmp_path):
    source = tmp_path / "large.zip"
    source.write_bytes(b"large")
    digest = files.adopt(source)
    assert digest == hashlib.sha256(b"large").hexdigest()
    assert not source.exists() and files.read(digest) == b"large"
    source.write_bytes(b"large")
    assert files.adopt(source) == digest
    assert len(stored(files)) == 1 and not source.exists()


@pytest.mark.parametrize("name", ["", "../../etc/passwd", "a" * 63, "A" * 64, "g" * 64, "a" * 64 + "\n"])
def test_only_hashes_name_files(files, name):
    with pytest.raises(AssertionError):
        files.path(name)


def test_a_write_that_fails_leaves_nothing(files, monkeypatch):
    def no_space(handle: int) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr("app.storage.files.os.fsync", no_space)
    with pytest.raises(OSError, match="No space left"):
        files.put_bytes(b"content")
    assert stored(files) == []
    monkeypatch.undo()
    assert files.read(files.put_bytes(b"content")) == b"content"


def flip_a_bit(path: Path) -> None:
    content = bytearray(path.read_bytes())
    content[len(content) // 2] ^= 1
    path.write_bytes(content)


def cut_short(path: Path) -> None:
    path.write_bytes(path.read_bytes()[:-1])


@pytest.mark.parametrize(
    ("damage", "fault"),
    [
        (flip_a_bit, "is damaged on the disk"),
        (cut_short, "is damaged on the disk"),
        (Path.unlink, "is missing on the disk"),
    ],
)
def test_a_file_that_is_not_what_its_hash_says_is_not_handed_out_and_is_put_back(files, damage, fault):
    digest = files.put_bytes(b"content")
    damage(files.path(digest))
    for reader in (files.path, files.read):
        with pytest.raises(DamagedFileError) as raised:
            reader(digest)
        assert str(raised.value) == (f"a stored file {fault} (file {digest[:12]}); import its dataset again")
    assert files.put_bytes(b"content") == digest
    assert files.read(digest) == b"content"
    assert files.path(digest).read_bytes() == b"content" and len(stored(files)) == 1


def test_many_at_once_put_the_same_content(files):
    content = b"x" * 100_000
    threads = [threading.Thread(target=files.put_bytes, args=(content,)) for _ in range(8)]
    for thread in threads:
        thread.start()
    for thread in threads:
        thread.join()
    (path,) = stored(files)
    assert path.read_bytes() == content


OBJECT, OTHER = "ab" * 32, "cd" * 32


def test_what_was_built_is_kept_by_object_and_algorithm(tmp_path):
    old, new = (PreparedStore(tmp_path / "prepared", algorithm) for algorithm in ("old", "new"))
    assert old.read(OBJECT) is None
    old.put(OBJECT, b"built")
    old.put(OTHER, b"another")
    assert old.read(OBJECT) == b"built" and new.read(OBJECT) is None
    new.put(OBJECT, b"better")
    assert new.read(OBJECT) == b"better"
    assert old.read(OBJECT) is None and old.read(OTHER) == b"another"  # the old one goes when it is replaced
    new.put(OBJECT, b"again")
    assert new.read(OBJECT) == b"again" and len(list((tmp_path / "prepared").iterdir())) == 2


def test_what_was_built_is_named_by_hashes_alone(tmp_path):
    with pytest.raises(AssertionError):
        PreparedStore(tmp_path, "new").read("../secret")
