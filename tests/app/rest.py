"""Short ways to say what tests often do over REST."""

import json
from typing import Any

import httpx
import numpy as np

from tests.app.waiting import wait_until

SLOW_SNAP = {"preset": "paper", "particle_filter": {"iterations": 10_000, "particles": 200}}
"""A configuration that runs for a long time in small steps."""


def begin(client: httpx.Client, task: int = 0) -> dict[str, Any]:
    """Start the registration of the task with this place in the list."""
    task_id = client.get("/api/tasks").json()["items"][task]["id"]
    answer = client.post(f"/api/tasks/{task_id}/registration")
    assert answer.status_code == 200, answer.text
    return answer.json()


def log_of(client: httpx.Client, registration_id: int) -> list[dict[str, Any]]:
    """All events of a registration but those that tell where the camera of its view stands."""
    events = client.get(f"/api/registrations/{registration_id}/events?limit=500").json()["items"]
    return [event for event in events if event["kind"] != "view"]


def kinds(client: httpx.Client, registration_id: int) -> list[str]:
    """What the log of a registration holds, in order."""
    return [event["kind"] for event in log_of(client, registration_id)]


def finished_snap(client: httpx.Client, snap_id: str) -> dict[str, Any]:
    """A snap when it has ended."""

    def look() -> dict[str, Any] | None:
        snap = client.get(f"/api/snaps/{snap_id}").json()
        return snap if snap["state"] not in {"queued", "running"} else None

    return wait_until(look, "the snap to end")


def sentence(answer: httpx.Response, status: int) -> str:
    """The one sentence of an `application/problem+json` answer with this status."""
    assert answer.status_code == status, answer.text
    assert answer.headers["content-type"] == "application/problem+json"
    content = answer.json()
    assert set(content) - {"suggested"} == {"type", "title", "status", "detail"}
    assert content["status"] == status
    assert isinstance(content["detail"], str) and content["detail"].endswith(".")
    assert "\n" not in content["detail"]
    return content["detail"]


def url_of(registration: dict[str, Any]) -> str:
    return f"/api/registrations/{registration['id']}"


def put_pose(client: httpx.Client, registration: dict[str, Any], T: object) -> httpx.Response:
    """Put the object at a pose, or at what is none."""
    # written by json, since httpx refuses to send the NaN that Python's json reads
    content = json.dumps({"T_world_object": T.tolist() if isinstance(T, np.ndarray) else T})
    url = f"{url_of(registration)}/pose"
    return client.put(url, content=content, headers={"content-type": "application/json"})


def shown(answer: httpx.Response) -> np.ndarray:
    """The pose that a successful answer tells."""
    assert answer.status_code == 200, answer.text
    return np.array(answer.json()["T_world_object"])
