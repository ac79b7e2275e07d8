"""What goes wrong is said in one sentence of `application/problem+json`, and has changed nothing."""

from collections.abc import Callable, Iterator, Sequence
from contextlib import contextmanager
from typing import Any

import httpx
import numpy as np
import pytest
from sqlalchemy import event, text

from app.api.problems import DISK_FULL
from app.storage.roles import Role
from registration_core.geometry import pose
from tests.app.live import LiveServer
from tests.app.rest import begin, kinds, sentence


@contextmanager
def full_disk(server: LiveServer) -> Iterator[None]:
    """Let the database have no room for one more page, until the block ends."""
    engine = server.services.database.engine

    def limit(connection: Any, _record: object) -> None:
        connection.execute("PRAGMA max_page_count = 1")  # SQLite takes the size that the file has

    event.listen(engine, "connect", limit)
    engine.dispose()
    try:
        yield
    finally:
        event.remove(engine, "connect", limit)
        engine.dispose()


def moved(i: int) -> dict[str, Any]:
    return {"T_world_object": pose.exp([0.001 * i, 0, 0.5, 0, 0, 0]).tolist()}


def until_full(write: Callable[[int], httpx.Response]) -> int:
    """Write for as long as pages have room; returns how often that went well."""
    for i in range(1000):
        answer = write(i)
        if answer.status_code != 200:
            assert sentence(answer, 507) == DISK_FULL
            return i
    raise AssertionError("the disk is not full")


def rows_of(server: LiveServer) -> list[Sequence[Any]]:
    tables = ("users", "credentials", "datasets", "tasks", "registrations", "events", "estimates", "exports")
    with server.services.database.read() as session:
        return [session.execute(text(f"SELECT * FROM {table}")).all() for table in tables]


def test_on_a_full_disk_nothing_changes_and_all_goes_on_when_there_is_room(own_live: LiveServer) -> None:
    script = own_live.script("robot")
    registration = begin(script)
    url = f"/api/registrations/{registration['id']}"
    with full_disk(own_live):
        saved = until_full(lambda i: script.put(f"{url}/pose", json=moved(i)))
        frame = {"frame_id": registration["frame_id"]}
        until_full(lambda i: script.put(f"{url}/frame", json=frame))  # nothing that is written is smaller
        before = rows_of(own_live)
        state = script.get(url).json()
        expected = moved(saved - 1) if saved else registration
        assert np.allclose(state["T_world_object"], expected["T_world_object"])
        calls: list[tuple[str, str, dict[str, Any] | None]] = [("PUT", f"{url}/pose", moved(99))]
        calls += [("POST", f"{url}/{action}", None) for action in ("reset", "submit", "snaps")]
        for method, address, body in calls:
            assert sentence(script.request(method, address, json=body), 507) == DISK_FULL
        assert script.get(url).json() == state
        assert rows_of(own_live) == before
    assert kinds(script, registration["id"]).count("set_pose") == saved
    assert script.put(f"{url}/pose", json=moved(99)).status_code == 200
    assert script.post(f"{url}/submit").json()["state"] == "submitted"
    assert kinds(script, registration["id"])[-2:] == ["set_pose", "submit"]


def test_a_file_that_is_gone_is_named_with_what_brings_it_back(own_live: LiveServer) -> None:
    script = own_live.script("robot", Role.ADMIN)
    frame = script.get("/api/scenes").json()["items"][0]["frames"][0]
    for path in own_live.services.files.root.rglob("*"):
        if path.is_file():
            path.unlink()
    for url in (frame["depth_url"], frame["color_url"], "/api/tasks/1/thumbnail.jpg"):
        said = sentence(script.get(url), 500)
        assert "is missing on the disk" in said and "import dataset 'tools' again" in said
        assert "/" not in said and "Error" not in said
    assert script.get("/api/me").status_code == 200


@pytest.mark.parametrize("path", ["/api", "/api/", "/api/nothing", "/api/tasks/1/nothing", "/nothing"])
def test_an_unknown_address_is_said(operator: httpx.Client, path: str) -> None:
    assert path in sentence(operator.get(path), 404)


def test_a_method_that_an_address_has_not_is_said(operator: httpx.Client) -> None:
    answer = operator.delete("/api/me")
    assert "DELETE /api/me" in sentence(answer, 405)
    assert answer.headers["allow"] == "GET"


@pytest.mark.parametrize(
    ("method", "url", "body", "field"),
    [
        ("GET", "/api/tasks/x", None, "path.task_id"),
        ("GET", "/api/tasks/0", None, "path.task_id"),
        ("GET", f"/api/tasks/{2**31}", None, "path.task_id"),
        ("GET", "/api/datasets?limit=none", None, "query.limit"),
        ("POST", "/api/sign-in", {"name": "ann"}, "body.password"),
        ("POST", "/api/sign-in", ["ann"], "body"),
    ],
)
def test_a_bad_request_names_the_field(
    operator: httpx.Client, method: str, url: str, body: Any, field: str
) -> None:
    assert sentence(operator.request(method, url, json=body), 422).startswith(f"{field}: ")


@pytest.mark.parametrize("content", [b"{", b"", b"\xff\xfe", b"[" * 20_000])
def test_a_body_that_is_no_json_is_said(operator: httpx.Client, content: bytes) -> None:
    answer = operator.post("/api/sign-in", content=content, headers={"content-type": "application/json"})
    sentence(answer, answer.status_code)
    assert answer.status_code in {400, 422}
