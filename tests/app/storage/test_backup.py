"""Backups, also amid writes, unpack to a state that is whole and holds all that was saved before."""

import itertools
import os
import subprocess
import tarfile
import threading
from collections.abc import Iterator
from contextlib import closing, contextmanager
from pathlib import Path

import httpx
import pytest
from sqlalchemy import func, select

from app.config import Settings
from app.storage.checkup import examine
from app.storage.database import Database
from app.storage.named_files import open_store
from app.storage.tables import Export, Frame, User
from tests.app.waiting import LONGEST, wait_until
from tests.processes import Command, failure, run_snap6d, serving, workers_of


class Writer:
    """Saves rows with a file each, one after the other, in a thread of its own."""

    def __init__(self, database: Database, state_dir: Path) -> None:
        self.saved = 0
        self._database = database
        self._files = open_store(state_dir / "files", database)
        self._ended = threading.Event()
        self._thread = threading.Thread(target=self._run)

    @contextmanager
    def at_work(self) -> Iterator["Writer"]:
        with self._database.write() as session:
            session.add(User(name="ann", role="admin"))
        self._thread.start()
        try:
            yield self
        finally:
            self._ended.set()
            self._thread.join()

    def _run(self) -> None:
        for number in itertools.count(1):
            if self._ended.is_set():
                return
            digest = self._files.put_bytes(os.urandom(50_000))
            with self._database.write() as session:
                session.add(Export(dataset_id=1, format="bop", user_id=1, state="done", file_hash=digest))
            self.saved = number


def restored(archive: Path, folder: Path) -> Path:
    """What an archive unpacks to, in the way that docs/deployment.md tells."""
    folder.mkdir()
    subprocess.run(["tar", "-xf", archive, "-C", folder], check=True)
    return folder


@pytest.mark.slow
def test_a_backup_amid_writes_holds_what_was_saved_and_all_its_files(state_dir: Path, tmp_path: Path) -> None:
    archive = tmp_path / "backup.tar"
    with closing(Database(Settings(state_dir=state_dir).resolved_database_url)) as database:
        writer = Writer(database, state_dir)
        with writer.at_work():
            wait_until(lambda: writer.saved > 5, "some writes")
            before = writer.saved
            done = run_snap6d(state_dir, "backup", str(archive))
            after = writer.saved
    assert done.returncode == 0, done.stderr
    assert after > before
    assert archive.stat().st_mode & 0o777 == 0o600
    again = restored(archive, tmp_path / "again")
    with closing(Database(Settings(state_dir=again).resolved_database_url)) as copy:
        found = examine(copy, open_store(again / "files", copy), lambda share, what: None)
        with copy.read() as session:
            saved = session.scalar(select(func.count(Export.id)))
    assert found.faults == ()
    assert saved is not None and before <= saved <= after + 1


@pytest.mark.slow
def test_a_server_starts_on_what_a_running_one_was_backed_up_to(
    state_dir: Path, tmp_path: Path, cluster: str
) -> None:
    archive = tmp_path / "backup.tar"

    def tasks_of(url: str, http: httpx.Client) -> list[dict]:
        return http.get(f"{url}/api/tasks").json()["items"]

    workers = workers_of(cluster)
    with serving(state_dir, **workers) as server, httpx.Client(timeout=LONGEST) as http:
        token = server.command("token", "create", "robot").strip()
        http.headers["authorization"] = f"Bearer {token}"
        before = tasks_of(server.url, http)
        printed = server.command("backup", str(archive))
        assert printed == f"{archive}: the database and 6 files.\n"
    with (
        serving(restored(archive, tmp_path / "again"), **workers) as server,
        httpx.Client(timeout=LONGEST) as http,
    ):
        http.headers["authorization"] = f"Bearer {token}"
        assert tasks_of(server.url, http) == before != []


def test_damaged_files_are_told_and_the_rest_is_kept(
    snap6d: Command, state_dir: Path, tmp_path: Path
) -> None:
    with closing(Database(Settings(state_dir=state_dir).resolved_database_url)) as database:
        files = open_store(state_dir / "files", database)
        with database.read() as session:
            depth = session.get_one(Frame, 2).depth_hash
        files.path(depth).write_bytes(b"wrong")
    archive = tmp_path / "backup.tar"
    done = snap6d(state_dir, "backup", str(archive))
    assert done.stdout.startswith("the depth image of image 5 in scene 1 of dataset 'tools' is damaged")
    assert failure(done).endswith("without 1 files that are damaged; they are listed above")
    with tarfile.open(archive) as tar:
        assert len(tar.getnames()) == 1 + 5


def test_only_a_tar_is_written(snap6d: Command, state_dir: Path, tmp_path: Path) -> None:
    message = failure(snap6d(state_dir, "backup", str(tmp_path / "backup.zip")))
    assert message.endswith("backup.zip does not end in .tar; a backup is a tar archive")


def test_a_backup_that_fails_leaves_the_one_before(
    snap6d: Command, state_dir: Path, tmp_path: Path, monkeypatch
) -> None:
    folder = tmp_path / "backups"
    folder.mkdir()
    archive = folder / "backup.tar"
    archive.write_bytes(b"the one before")

    def full(*_args: object, **_more: object) -> None:
        raise OSError(28, "No space left on device")

    monkeypatch.setattr(tarfile.TarFile, "add", full)
    assert "the disk is full" in failure(snap6d(state_dir, "backup", str(archive)))
    assert archive.read_bytes() == b"the one before" and list(folder.iterdir()) == [archive]
