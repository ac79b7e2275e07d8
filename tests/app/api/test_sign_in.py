"""Signing in and out, and who may act with whose cookie or token."""

from http.cookies import SimpleCookie

import httpx
import pytest

from app.access.auth import LOGIN_LIFETIME
from app.access.throttle import FREE_ATTEMPTS
from app.api.dependencies import SESSION_COOKIE
from app.storage.roles import Role
from tests.app.live import LiveServer
from tests.app.rest import begin, kinds, sentence

PASSWORD = "correct horse battery"
FOREIGN = ["http://evil.example", "null", "http://127.0.0.1", "http://127.0.0.1.evil.example"]


@pytest.fixture(scope="module", autouse=True)
def ann(server: LiveServer) -> int:
    return server.services.auth.create_user("ann", Role.REVIEWER, PASSWORD).id


def sign_in(client: httpx.Client, name: str, password: str, **headers: str) -> httpx.Response:
    return client.post("/api/sign-in", json={"name": name, "password": password}, headers=headers)


def test_a_password_signs_in_until_signing_out(server: LiveServer, ann: int) -> None:
    client = server.stranger()
    answer = sign_in(client, "ann", PASSWORD)
    assert answer.status_code == 204 and answer.content == b""
    assert client.get("/api/me").json() == {"id": ann, "name": "ann", "role": "reviewer", "submitted": 0}
    secret = client.cookies[SESSION_COOKIE]
    assert client.post("/api/sign-out").status_code == 204
    assert SESSION_COOKIE not in client.cookies
    sentence(client.get("/api/me"), 401)
    client.cookies.set(SESSION_COOKIE, secret)
    sentence(client.get("/api/me"), 401)


def test_scripts_of_a_page_cannot_read_the_cookie_nor_other_sites_send_it(server: LiveServer) -> None:
    answer = sign_in(server.stranger(), "ann", PASSWORD)
    cookie = SimpleCookie(answer.headers["set-cookie"])[SESSION_COOKIE]
    assert cookie["httponly"] and cookie["samesite"] == "lax" and cookie["path"] == "/"
    assert int(cookie["max-age"]) == LOGIN_LIFETIME.total_seconds()


@pytest.mark.parametrize(("name", "password"), [("ann", "wrong"), ("nobody", PASSWORD), ("", "")])
def test_wrong_credentials_are_refused_in_a_sentence(server: LiveServer, name: str, password: str) -> None:
    client = server.stranger()
    assert "do not belong together" in sentence(sign_in(client, name, password), 401)
    assert not client.cookies


def test_guessing_has_to_wait(server: LiveServer) -> None:
    client = server.stranger()
    answers = [sign_in(client, "guessed", str(i)).status_code for i in range(FREE_ATTEMPTS)]
    assert answers == [401] * FREE_ATTEMPTS
    assert "wait" in sentence(sign_in(client, "guessed", "again"), 429)


def test_a_link_signs_in_once(server: LiveServer, ann: int) -> None:
    token = server.services.auth.create_link(ann)
    client = server.stranger()
    assert client.post("/api/sign-in/link", json={"token": token}).status_code == 204
    assert client.get("/api/me").json()["name"] == "ann"
    again = server.stranger().post("/api/sign-in/link", json={"token": token})
    assert "used before" in sentence(again, 401)


def test_a_token_is_as_good_as_a_login(server: LiveServer, reviewer: httpx.Client) -> None:
    assert reviewer.get("/api/me").json()["name"] == "rita"
    client = server.stranger()
    for authorization in ("Bearer made-up", "Bearer", "Basic YW5uOmFubg==", "made-up"):
        sentence(client.get("/api/me", headers={"authorization": authorization}), 401)
    session_secret = server.login("sue")
    sentence(client.get("/api/me", headers={"authorization": f"Bearer {session_secret}"}), 401)


@pytest.mark.parametrize(
    ("body", "field"),
    [({"name": "ann"}, "password"), ({"name": 5, "password": "x"}, "name"), ({"name": "n" * 101}, "name")],
)
def test_incomplete_credentials_name_the_field(server: LiveServer, body: dict, field: str) -> None:
    assert f"body.{field}: " in sentence(server.stranger().post("/api/sign-in", json=body), 422)


# -- other people's pages


@pytest.mark.parametrize("origin", FOREIGN)
def test_a_foreign_page_cannot_act_with_the_cookie(server: LiveServer, origin: str) -> None:
    client = server.person("sam")
    registration = begin(client)
    url = f"/api/registrations/{registration['id']}"
    before = kinds(client, registration["id"])
    foreign = {"origin": origin}
    for answer in (
        client.put(f"{url}/pose", json={"T_world_object": registration["T_world_object"]}, headers=foreign),
        client.post(f"{url}/submit", headers=foreign),
        client.post(f"{url}/snaps", headers=foreign),
        client.delete("/api/snaps/1", headers=foreign),
        client.post("/api/sign-out", headers=foreign),
        sign_in(client, "ann", PASSWORD, **foreign),
        client.post("/api/sign-in/link", json={"token": "x"}, headers=foreign),
    ):
        assert "foreign page" in sentence(answer, 403)
    assert kinds(client, registration["id"]) == before


def test_our_own_page_and_callers_without_a_page_may_act(server: LiveServer) -> None:
    client = server.person("tom")
    registration = begin(client)
    url = f"/api/registrations/{registration['id']}/pose"
    body = {"T_world_object": registration["T_world_object"]}
    assert client.put(url, json=body, headers={"origin": server.url}).status_code == 200
    assert client.put(url, json=body).status_code == 200
