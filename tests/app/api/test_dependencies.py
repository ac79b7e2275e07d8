"""What all routes share: who is asking, from which page, and lists in pages."""

import uuid

import httpx
import pytest

from app.storage.roles import Role
from tests.app.live import LiveServer
from tests.app.rest import begin, sentence


@pytest.fixture
def person(live: LiveServer) -> httpx.Client:
    """A new operator with a login cookie."""
    return live.person(f"ann {uuid.uuid4().hex}")


@pytest.mark.parametrize("authorization", ["Bearer nonsense", "Bearer a b", "Basic YTpi", "bearer"])
def test_made_up_tokens_are_refused(live: LiveServer, authorization: str) -> None:
    answer = live.stranger().get("/api/me", headers={"authorization": authorization})
    assert sentence(answer, 401) == "Please sign in first."


def test_a_cookie_does_not_save_a_made_up_token(person: httpx.Client) -> None:
    assert person.get("/api/me").status_code == 200
    assert person.get("/api/me", headers={"authorization": "Bearer nonsense"}).status_code == 401


def test_roles_say_which_one_is_needed(live: LiveServer) -> None:
    for role in (Role.OPERATOR, Role.REVIEWER):
        client = live.script(f"{role} {uuid.uuid4().hex}", role)
        said = sentence(client.post("/api/exports", json={"dataset_id": 1}), 403)
        assert said == f"This needs the role admin; yours is {role}."


@pytest.mark.parametrize(
    "origin",
    [
        "http://evil.example",
        "null",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        "http://127.0.0.1.evil.example",
    ],
)
def test_a_foreign_page_may_change_nothing(live: LiveServer, person: httpx.Client, origin: str) -> None:
    registration = begin(person)
    url = f"/api/registrations/{registration['id']}"
    for method, path in (
        ("POST", f"/api/tasks/{registration['task_id']}/registration"),
        ("POST", f"{url}/reset"),
        ("PUT", f"{url}/pose"),
        ("POST", f"{url}/snaps"),
        ("DELETE", "/api/snaps/x"),
        ("POST", "/api/sign-out"),
    ):
        answer = person.request(method, path, headers={"origin": origin}, json={})
        assert "foreign page" in sentence(answer, 403)
    assert person.get(url).json() == registration
    assert person.post(f"{url}/reset", headers={"origin": live.url}).status_code == 200


@pytest.mark.parametrize("path", ["tasks", "scenes", "objects", "datasets"])
def test_lists_come_in_pages(live: LiveServer, person: httpx.Client, path: str) -> None:
    whole = person.get(f"/api/{path}").json()
    assert whole["items"] and whole["next"] is None
    items, after = [], 0
    while after is not None:
        page = person.get(f"/api/{path}?limit=1&after={after}").json()
        assert len(page["items"]) <= 1
        items += page["items"]
        after = page["next"]
    assert items == whole["items"]


@pytest.mark.parametrize(
    "query", ["limit=0", "limit=501", "limit=x", "after=-1", "after=1e99", "after=x", f"after={2**63}"]
)
def test_pages_out_of_range_are_named(person: httpx.Client, query: str) -> None:
    answer = person.get(f"/api/tasks?{query}")
    assert sentence(answer, 422).startswith(f"query.{query.split('=', maxsplit=1)[0]}: ")
