"""Short ways to say what tests of studies often do over REST."""

import uuid
from typing import Any

import httpx

from tests.app.live import LiveServer

AGREE = "You move objects. Nothing else is kept."
QUESTION = {"text": "Have you used a 3-D program?", "choices": ["yes", "no"]}


def plan_of(client: httpx.Client, **changes: Any) -> dict[str, Any]:
    """Two tasks and one for practice, in all modes by hand alone; one novice, two experts."""
    tasks = client.get("/api/tasks").json()["items"]
    refs = [
        {"scene_id": t["scene"]["id"], "object_id": t["object"]["id"], "instance": t["instance"]}
        for t in tasks
    ]
    plan = {"tasks": refs[:2], "practice": refs[2:3], "groups": {"novice": 1, "expert": 2}, "break_after": 2}
    return plan | changes


def new_study(client: httpx.Client, **changes: Any) -> dict[str, Any]:
    """A study that was just set up."""
    body = {"name": f"study {uuid.uuid4().hex}", "plan": plan_of(client, **changes), "seed": 5}
    answer = client.post("/api/studies", json=body)
    assert answer.status_code == 201, answer.text
    return answer.json()


def invite(client: httpx.Client, study: dict[str, Any], group: str = "novice") -> dict[str, Any]:
    """A new participant with their link."""
    answer = client.post(f"/api/studies/{study['id']}/participants", json={"group": group})
    assert answer.status_code == 201, answer.text
    return answer.json()


def take_part(server: LiveServer, link: str) -> httpx.Client:
    """Somebody who opened their link."""
    client = server.stranger()
    answer = client.post("/api/sign-in/study", json={"token": link.partition("#")[2]})
    assert answer.status_code == 204, answer.text
    return client


def next_of(client: httpx.Client) -> dict[str, Any]:
    """Where a participant stands."""
    answer = client.get("/api/participation")
    assert answer.status_code == 200, answer.text
    return answer.json()


def begin_next(client: httpx.Client) -> dict[str, Any]:
    """The registration of a participant's next task, begun."""
    answer = client.post(f"/api/tasks/{next_of(client)['task']['id']}/registration")
    assert answer.status_code == 200, answer.text
    return answer.json()


def do_next(client: httpx.Client) -> None:
    """Submit a participant's next task as it is."""
    answer = client.post(f"/api/registrations/{begin_next(client)['id']}/submit")
    assert answer.status_code == 200, answer.text
