"""A disk that is full, or read-only: told in one sentence, nothing lost or half-written."""

import errno
import subprocess
from collections.abc import Iterator
from pathlib import Path
from shutil import copytree, make_archive
from typing import Any

import httpx
import numpy as np
import pytest

from app.api.dependencies import SESSION_COOKIE
from app.api.problems import DISK_FULL
from app.storage.faults import FULL, NOT_OPENED, READ_ONLY
from app.storage.unfinished import PREFIX
from registration_core.geometry import pose
from tests.app.labeling.viser_client import ViserClient
from tests.app.rest import begin, finished_snap, kinds, put_pose, sentence
from tests.app.small_dataset import T_OBJECT_GIZMO, TOOL, true_pose
from tests.app.waiting import wait_until
from tests.processes import Server, failure, run_snap6d, serving, signed_in, workers_of

pytestmark = pytest.mark.slow  # servers in processes of their own

BYTES = 16 << 20
NOT_SAVED = "The last drag could not be saved and was taken back: "


class SmallDisk:
    """A file system of its own, with a state directory on it."""

    def __init__(self, folder: Path) -> None:
        self.folder = folder
        self.state_dir = folder / "state"
        self._filler = folder / "filler"

    def fill(self) -> None:
        """Leave no room for one more byte."""
        with self._filler.open("ab", buffering=0) as filler:
            for size in (1 << 16, 1 << 12, 1):
                with pytest.raises(OSError, match="No space") as full:
                    while True:
                        filler.write(bytes(size))
                assert full.value.errno == errno.ENOSPC

    def free(self) -> None:
        """Make room again."""
        self._filler.unlink()

    def make_read_only(self) -> None:
        """Let nobody write to it any more."""
        subprocess.run(["mount", "-o", "remount,ro", str(self.folder)], check=True)

    def half_written(self) -> list[Path]:
        """What was not finished."""
        return list(self.state_dir.rglob(f"{PREFIX}*"))


@pytest.fixture
def disk(imported_state: Path, tmp_path: Path) -> Iterator[SmallDisk]:
    folder = tmp_path / "disk"
    folder.mkdir()
    mount = ["mount", "-t", "tmpfs", "-o", f"size={BYTES}", "tmpfs", str(folder)]
    done = subprocess.run(mount, capture_output=True, text=True, check=False)
    if done.returncode:
        pytest.skip(f"this machine lets nobody here mount a file system: {done.stderr.strip()}")
    try:
        small = SmallDisk(folder)
        copytree(imported_state, small.state_dir)
        yield small
    finally:
        subprocess.run(["umount", "--lazy", str(folder)], check=True)


def dragged(server: Server, http: httpx.Client, registration_id: int, T: np.ndarray) -> None:
    """Drag an object in its 3-D view, until the state tells of it."""
    url = f"/api/registrations/{registration_id}"
    before = http.get(url).json()["revision"]
    header = {"cookie": f"{SESSION_COOKIE}={http.cookies[SESSION_COOKIE]}"}
    with ViserClient(f"ws://{server.host}/view/{registration_id}/", header, server.url) as view:
        view.drag([T @ T_OBJECT_GIZMO])

        def is_told() -> bool:
            state = http.get(url).json()
            return state["revision"] > before and not state["dragging"] and is_at(state, T)

        def is_at(state: dict[str, Any], T: np.ndarray) -> bool:
            return np.allclose(state["T_world_object"], T) or str(state["message"]).startswith(NOT_SAVED)

        wait_until(is_told, "the drag to end")


def test_a_server_whose_disk_fills_up_loses_nothing_and_goes_on(
    disk: SmallDisk, demo: Path, tmp_path: Path, cluster: str
) -> None:
    archive = make_archive(str(tmp_path / "more"), "zip", demo.parent, demo.name)
    with (
        signed_in(disk.state_dir, **workers_of(cluster)) as (server, http),
        httpx.Client(base_url=server.url) as stranger,
    ):
        link = {"token": server.new_link("zoe").rsplit("#")[1]}
        registration = begin(http)
        url = f"/api/registrations/{registration['id']}"
        start = np.array(registration["T_world_object"])
        kept, lost = (start @ pose.exp([x, 0, 0, 0, 0, 0]) for x in (0.01, 0.03))
        dragged(server, http, registration["id"], kept)
        disk.fill()

        dragged(server, http, registration["id"], lost)
        state = http.get(url).json()
        assert state["message"] == f"{NOT_SAVED}{FULL}."
        assert np.allclose(state["T_world_object"], kept)
        assert sentence(put_pose(http, registration, true_pose(TOOL)), 507) == DISK_FULL
        for address, body in (
            (f"{url}/undo", None),
            (f"{url}/submit", None),
            (f"{url}/snaps", {}),
            ("/api/exports", {"dataset_id": 1, "format": "bop"}),
            ("/api/tasks/2/registration", None),
        ):
            assert sentence(http.post(address, json=body), 507) == DISK_FULL
        password = {"name": "zoe", "password": "a wrong one"}
        assert sentence(stranger.post("/api/sign-in", json=password), 507) == DISK_FULL
        assert sentence(stranger.post("/api/sign-in/link", json=link), 507) == DISK_FULL
        with Path(archive).open("rb") as stream:
            assert sentence(http.post("/api/datasets", files={"file": stream}), 507) == DISK_FULL
        for command in (("import", str(demo), "--name", "more"), ("user", "add", "bob")):
            assert failure(run_snap6d(disk.state_dir, *command)) == FULL
        assert not disk.half_written()

        disk.free()
        assert stranger.post("/api/sign-in/link", json=link).status_code == 204
        assert kinds(http, registration["id"]) == ["opened", "drag"]
        assert put_pose(http, registration, true_pose(TOOL)).status_code == 200
        snap_id = http.post(f"{url}/snaps", json={}).json()["id"]
        assert finished_snap(http, snap_id)["state"] == "done"
        with Path(archive).open("rb") as stream:
            assert http.post("/api/datasets", files={"file": stream}).status_code == 201
    assert run_snap6d(disk.state_dir, "check").returncode == 0


def test_a_server_does_not_start_on_a_full_disk_and_says_so(disk: SmallDisk, cluster: str) -> None:
    disk.fill()
    said = failure(run_snap6d(disk.state_dir, "serve", "--port", "0", **workers_of(cluster)))
    assert FULL in said or f"state folder {disk.state_dir} (No space left on device)" in said
    disk.free()
    with serving(disk.state_dir, **workers_of(cluster)):
        pass


def test_a_read_only_state_folder_is_told(disk: SmallDisk, demo: Path) -> None:
    disk.make_read_only()
    said = failure(run_snap6d(disk.state_dir, "serve", "--port", "0", "--workers", "1"))
    assert said.startswith(
        f"nothing can be written to the state folder {disk.state_dir} (Read-only file system);"
    )
    for command in (("import", str(demo), "--name", "more"), ("user", "add", "bob")):
        said = failure(run_snap6d(disk.state_dir, *command))
        assert said in {READ_ONLY, f"the database cannot be opened: {NOT_OPENED}"}
