"""A server that is killed loses at most the drag that was not finished, and what it started ends with it."""

import contextlib
import os
import signal
from collections.abc import Iterator
from contextlib import contextmanager
from pathlib import Path
from typing import Any

import httpx
import numpy as np
import pytest

from app.api.dependencies import SESSION_COOKIE
from app.config import Settings
from app.export.processes import INTERRUPTED
from app.storage.unfinished import PREFIX
from registration_core.geometry import pose
from tests.app.labeling.viser_client import ViserClient
from tests.app.rest import begin, log_of, put_pose
from tests.app.small_dataset import T_OBJECT_GIZMO, TOOL, true_pose
from tests.app.waiting import LONGEST, wait_until
from tests.processes import Server, command_line, descendants, serving, signed_in, workers_of

pytestmark = pytest.mark.slow  # servers in processes of their own


class Operator:
    """Somebody at a server in a process of its own, with the view open."""

    def __init__(self, server: Server, view: ViserClient, http: httpx.Client) -> None:
        self.server = server
        self.view = view
        self.http = http
        self.registration = begin(http)
        self.url = f"/api/registrations/{self.registration['id']}"

    @property
    def state(self) -> dict[str, Any]:
        return self.http.get(self.url).json()

    @property
    def drags(self) -> list[dict[str, Any]]:
        return [event for event in log_of(self.http, self.registration["id"]) if event["kind"] == "drag"]

    def drag(self, *way: np.ndarray) -> None:
        """Drag over poses of the object."""
        self.view.drag(T @ T_OBJECT_GIZMO for T in way)

    def kill(self) -> None:
        """Kill the server, as a crash or a power cut would end it; its workers go too."""
        workers = descendants(self.server.process.pid)
        kill_alone(self.server)
        wait_until(lambda: not any(map(command_line, workers)), "the workers to go")


def kill_alone(server: Server) -> None:
    """Kill a server's process, and none of those that it started."""
    server.process.send_signal(signal.SIGKILL)
    assert server.process.wait(LONGEST) == -signal.SIGKILL


def submit_one(http: httpx.Client) -> None:
    """A registration that can be exported."""
    registration = begin(http)
    assert put_pose(http, registration, true_pose(TOOL)).status_code == 200
    assert http.post(f"/api/registrations/{registration['id']}/submit").status_code == 200


def half_done_export(server: Server, http: httpx.Client) -> int:
    """The process of an export that is under way, at a standstill."""
    answer = http.post("/api/exports", json={"dataset_id": 1, "format": "bop"})
    assert answer.status_code == 202
    url = f"/api/exports/{answer.json()['id']}"
    wait_until(lambda: http.get(url).json()["state"] == "running", "the export to run")
    (process,) = (pid for pid in descendants(server.process.pid) if "app.export" in command_line(pid))
    os.kill(process, signal.SIGSTOP)
    return process


def half_written(state_dir: Path) -> list[Path]:
    """What exports did not finish."""
    return list(Settings(state_dir=state_dir).files_dir.glob(f"{PREFIX}*"))


@contextmanager
def working(state_dir: Path, cookie: dict[str, str]) -> Iterator[Operator]:
    """An operator before the first task; `cookie` is kept from one server to the next."""
    with (
        serving(state_dir, "--workers", "1") as server,
        httpx.Client(base_url=server.url, timeout=LONGEST) as http,
    ):
        http.cookies.update(cookie)
        if not cookie:
            assert http.post("/api/sign-in/link", json={"token": server.secret}).status_code == 204
            cookie.update(http.cookies)
        registration_id = begin(http)["id"]
        header = {"cookie": f"{SESSION_COOKIE}={cookie[SESSION_COOKIE]}"}
        url = f"ws://{server.host}/view/{registration_id}/"
        with ViserClient(url, header, server.url) as view:
            yield Operator(server, view, http)


def test_killed_between_drags_in_mid_drag_and_amid_a_flood_of_them(state_dir: Path) -> None:
    cookie: dict[str, str] = {}
    with working(state_dir, cookie) as operator:
        start = np.array(operator.registration["T_world_object"])
        ends = [start @ pose.exp([0.01 * i, 0, 0, 0, 0, 0]) for i in range(1, 4)]
        for i, T in enumerate(ends):
            operator.drag((start + T) / 2 if i == 0 else T, T)
        wait_until(lambda: len(operator.drags) == 3, "three drags")
        operator.kill()
    with working(state_dir, cookie) as operator:
        drags = operator.drags
        assert [drag["dof"] for drag in drags] == [["tx"]] * 3
        assert all(np.allclose(drag["T_after"], T) for drag, T in zip(drags, ends, strict=True))
        assert np.allclose(operator.state["T_world_object"], ends[2])
        unfinished = ends[2] @ pose.exp([0, 0, 0.05, 0, 0, 0])
        operator.view.take()
        operator.view.move(unfinished @ T_OBJECT_GIZMO)
        wait_until(
            lambda: operator.state["dragging"] and np.allclose(operator.state["T_world_object"], unfinished),
            "a drag under way",
        )
        assert not operator.state["saved"]
        operator.kill()
    with working(state_dir, cookie) as operator:
        state = operator.state
        assert len(operator.drags) == 3 and not state["dragging"] and state["saved"]
        assert np.allclose(state["T_world_object"], ends[2])
        for expected in (ends[1], ends[0], start):
            undone = operator.http.post(f"{operator.url}/undo").json()
            assert np.allclose(undone["T_world_object"], expected)
        assert not undone["can_undo"]
        redone = operator.http.post(f"{operator.url}/redo").json()
        assert np.allclose(redone["T_world_object"], ends[0])

        flood = [ends[0] @ pose.exp([0, 0.001 * i, 0, 0, 0, 0]) for i in range(1, 401)]
        for T in flood:
            operator.drag(T)
        seen = wait_until(lambda: found if len(found := operator.drags) >= 23 else None, "some drags")
        operator.kill()
    with working(state_dir, cookie) as operator:
        events = operator.http.get(f"{operator.url}/events?limit=500").json()["items"]
        assert [event["sequence"] for event in events] == list(range(1, len(events) + 1))
        drags = operator.drags
        assert drags[: len(seen)] == seen
        assert all(np.allclose(drag["T_after"], T) for drag, T in zip(drags[3:], flood, strict=False))
        assert np.allclose(operator.state["T_world_object"], drags[-1]["T_after"])
        undone = operator.http.post(f"{operator.url}/undo").json()
        assert np.allclose(undone["T_world_object"], drags[-1]["T_before"])


def test_an_export_ends_with_its_server_and_stays_failed_where_it_outlives_it(
    state_dir: Path, cluster: str
) -> None:
    workers = workers_of(cluster)
    with signed_in(state_dir, **workers) as (server, http):
        submit_one(http)
        process = half_done_export(server, http)
        kill_alone(server)
    os.kill(process, signal.SIGCONT)
    wait_until(lambda: not command_line(process), "the export to end")
    with signed_in(state_dir, **workers) as (server, http):
        ended = http.get("/api/exports/1").json()
        assert ended["state"] == "failed" and "start it again" in ended["message"].lower()
        assert not half_written(state_dir)
        process = half_done_export(server, http)
        kill_alone(server)
    try:
        with signed_in(state_dir, **workers) as (_, http):
            given_up = http.get("/api/exports/2").json()
            assert (given_up["state"], given_up["message"]) == ("failed", INTERRUPTED)
            os.kill(process, signal.SIGCONT)
            wait_until(lambda: not command_line(process), "the export to end")
            assert http.get("/api/exports/2").json() == given_up
    finally:
        with contextlib.suppress(ProcessLookupError):
            os.kill(process, signal.SIGKILL)
    assert not half_written(state_dir)
