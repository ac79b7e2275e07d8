"""Folders for unfinished things: gone in the end, cleared after a kill, never while their process lives."""

import errno
import signal
import subprocess
import sys
from pathlib import Path

import pytest

from app.storage.unfinished import clear_unfinished, unfinished
from tests.conftest import REPOSITORY

AT_WORK = """
import sys
from pathlib import Path
from app.storage.unfinished import unfinished
with unfinished(Path(sys.argv[1])) as folder:
    (folder / "half").write_bytes(b"half")
    print("at work", flush=True)
    sys.stdin.read()
"""


def test_it_is_there_within_its_block_alone(tmp_path: Path) -> None:
    with unfinished(tmp_path) as folder:
        (folder / "half").write_bytes(b"half")
        assert folder.parent == tmp_path
    assert list(tmp_path.iterdir()) == []
    with pytest.raises(RuntimeError), unfinished(tmp_path) as folder:
        raise RuntimeError
    assert list(tmp_path.iterdir()) == []


def test_what_a_killed_process_left_is_cleared_and_what_a_living_one_needs_is_not(tmp_path: Path) -> None:
    (tmp_path / "kept").write_bytes(b"kept")
    command = [sys.executable, "-c", AT_WORK, str(tmp_path)]
    with subprocess.Popen(
        command, cwd=REPOSITORY, stdin=subprocess.PIPE, stdout=subprocess.PIPE, text=True
    ) as process:
        assert process.stdout is not None and process.stdout.readline() == "at work\n"
        clear_unfinished(tmp_path, tmp_path / "not there")
        (folder,) = (path for path in tmp_path.iterdir() if path.is_dir())
        assert (folder / "half").read_bytes() == b"half"
        process.send_signal(signal.SIGKILL)
    clear_unfinished(tmp_path)
    assert [path.name for path in tmp_path.iterdir()] == ["kept"]


def test_where_folders_cannot_be_locked_things_are_finished_and_nothing_is_cleared(
    tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    def refuse(_handle: int, _how: int) -> None:
        raise OSError(errno.EBADF, "no lock for a folder, as on NFS")

    monkeypatch.setattr("app.storage.unfinished.fcntl.flock", refuse)
    with unfinished(tmp_path) as folder:
        (folder / "half").write_bytes(b"half")
        clear_unfinished(tmp_path)
        assert (folder / "half").read_bytes() == b"half"
    assert list(tmp_path.iterdir()) == []
