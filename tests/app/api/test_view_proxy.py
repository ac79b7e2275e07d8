"""The door to the views: for the owner, from our own pages, and for nobody else."""

import threading
from functools import partial
from typing import Any

import httpx
import numpy as np
import pytest
import viser
from websockets.exceptions import ConnectionClosed, InvalidStatus

from app.api import view_proxy as proxy
from app.api.dependencies import SESSION_COOKIE
from registration_core.geometry import pose
from tests.app.labeling.viser_client import ViserClient
from tests.app.live import LiveServer
from tests.app.rest import begin, log_of
from tests.app.waiting import wait_until


class Operator:
    """A user with a registration under way."""

    def __init__(self, live: LiveServer, name: str) -> None:
        self.live = live
        self.http: httpx.Client = live.person(name)
        self.registration = begin(self.http)
        self.id: int = self.registration["id"]

    @property
    def cookie(self) -> dict[str, str]:
        return {"cookie": f"{SESSION_COOKIE}={self.http.cookies[SESSION_COOKIE]}"}

    def view(self, registration_id: int | str | None = None, origin: str | None = "own") -> ViserClient:
        """A WebSocket to a view with this user's cookie."""
        url = f"ws://{self.live.host}/view/{registration_id or self.id}/"
        return ViserClient(url, self.cookie, self.live.url if origin == "own" else origin)

    @property
    def T_object_gizmo(self) -> np.ndarray:
        live_session = self.live.live_session(self.id)
        return pose.from_rotation_translation(np.eye(3), live_session.model.centre)


@pytest.fixture(scope="module")
def ann(live: LiveServer) -> Operator:
    return Operator(live, "ann of the proxy")


@pytest.fixture(scope="module")
def bob(live: LiveServer) -> Operator:
    return Operator(live, "bob of the proxy")


def refused(open_view) -> int:
    """The status with which a WebSocket is refused."""
    with pytest.raises(InvalidStatus) as caught:
        open_view()
    return caught.value.response.status_code


def test_the_owner_gets_the_page_and_the_scene(ann):
    page = ann.http.get(ann.registration["view_url"])
    assert page.status_code == 200
    assert page.headers["content-type"].startswith("text/html")
    assert "private" in page.headers["cache-control"]
    with ann.view() as view:
        assert view.subprotocol == f"viser-v{viser.__version__}"
        assert view.node("PointCloudMessage", "/cloud")["props"]["points"].size > 100_000
        view.node("MeshMessage", "/object/mesh")


def test_the_address_also_works_without_its_last_slash(ann):
    url = f"ws://{ann.live.host}/view/{ann.id}"
    with ViserClient(url, ann.cookie, ann.live.url) as view:
        view.node("TransformControlsMessage", "/object")


def test_nobody_reaches_another_users_view(ann, bob):
    assert bob.http.get(f"/view/{ann.id}/").status_code == 404
    assert bob.http.get(f"/view/{ann.id}/index.html").status_code == 404
    assert refused(lambda: bob.view(ann.id)) == 403
    assert refused(lambda: ann.view(bob.id)) == 403
    with ann.view() as hers, bob.view() as his:
        hers.node("MeshMessage", "/object/mesh")
        his.node("MeshMessage", "/object/mesh")


def test_strangers_reach_nothing(live, ann):
    assert live.stranger().get(f"/view/{ann.id}/").status_code == 401
    url = f"ws://{live.host}/view/{ann.id}/"
    assert refused(lambda: ViserClient(url, {}, live.url)) == 403
    forged = {"cookie": f"{SESSION_COOKIE}=made-up"}
    assert refused(lambda: ViserClient(url, forged, live.url)) == 403


def test_after_signing_out_the_door_is_closed(live):
    carl = Operator(live, "carl of the proxy")
    cookie = carl.cookie
    assert carl.http.post("/api/sign-out").status_code == 204
    url = f"ws://{live.host}/view/{carl.id}/"
    assert refused(lambda: ViserClient(url, cookie, live.url)) == 403


def test_signing_out_closes_the_views_of_that_login_and_no_others(live, ann, monkeypatch):
    monkeypatch.setattr(proxy, "SECONDS_BETWEEN_LOGIN_CHECKS", 0.05)
    ida = Operator(live, "ida of the proxy")
    elsewhere = {"cookie": f"{SESSION_COOKIE}={live.login('ida of the proxy')}"}
    url = f"ws://{live.host}/view/{ida.id}/"
    with ida.view() as left, ViserClient(url, elsewhere, live.url) as kept, ann.view() as hers:
        left.node("MeshMessage", "/object/mesh")
        live_session = live.live_session(ida.id)
        wait_until(lambda: live_session.viewers == 2, "both of her views to be open")
        assert ida.http.post("/api/sign-out").status_code == 204
        with pytest.raises(ConnectionClosed):
            left.wait_for("NoSuchMessage")
        wait_until(lambda: live_session.viewers == 1, "the view to be left")
        kept.drag([np.array(ida.registration["T_world_object"]) @ ida.T_object_gizmo @ pose.exp([0.01] * 6)])
        wait_until(lambda: live_session.session.snapshot().can_undo, "the drag in the other view")
        hers.node("MeshMessage", "/object/mesh")
        assert live.live_session(ann.id).viewers == 1


@pytest.mark.parametrize(
    "origin", [None, "null", "http://evil.example", "http://127.0.0.1", "http://127.0.0.1.evil.example"]
)
def test_a_websocket_from_a_foreign_page_is_refused(ann, origin):
    assert refused(lambda: ann.view(origin=origin)) == 403


@pytest.mark.parametrize("registration_id", ["0", "999", "x", "1e3", "99999999999999999999"])
def test_a_view_that_does_not_exist_is_refused(ann, registration_id):
    assert ann.http.get(f"/view/{registration_id}/").status_code in {404, 422}
    url = f"ws://{ann.live.host}/view/{registration_id}/"
    assert refused(lambda: ViserClient(url, ann.cookie, ann.live.url)) == 403


@pytest.mark.parametrize(
    "path", ["nothing-here.js", "..%2f..%2f..%2fapp.py", "%2e%2e/%2e%2e/pyproject.toml", "..%5c..%5cx", "%00"]
)
def test_no_path_leads_out_of_the_views_folder(ann, path):
    assert ann.http.get(f"/view/{ann.id}/{path}").status_code == 404


def test_the_public_tunnel_is_refused_through_the_door(ann, monkeypatch):
    asked: list[viser.ViserServer] = []
    monkeypatch.setattr(viser.ViserServer, "request_share_url", lambda server: asked.append(server))  # noqa: PLW0108 - a function binds
    with ann.view() as view:
        view.send("ShareUrlRequest")
        view.node("MeshMessage", "/object/mesh")
        before = len(log_of(ann.http, ann.id))
        view.drag([np.array(ann.registration["T_world_object"]) @ ann.T_object_gizmo @ pose.exp([0.01] * 6)])
        wait_until(lambda: len(log_of(ann.http, ann.id)) > before, "the drag")
        assert not [m for m in view.messages if m["type"].startswith("ShareUrl")]
    assert not asked


def test_a_drag_is_in_the_log_with_its_freedom_and_its_way(live):
    dora = Operator(live, "dora of the proxy")
    start = np.array(dora.registration["T_world_object"])
    way = [start @ dora.T_object_gizmo @ pose.exp([0, 0.005 * i, 0, 0, 0, 0]) for i in range(1, 11)]
    pace = threading.Event()
    with dora.view() as view:
        view.take()
        for T in way:
            view.move(T)
            pace.wait(0.05)  # a page tells of a drag 20 times a second
        view.let_go()
        wait_until(lambda: log_of(dora.http, dora.id)[-1]["kind"] == "drag", "the drag")
    event = log_of(dora.http, dora.id)[-1]
    assert (event["actor"], event["dof"]) == ("human", ["ty"])
    assert np.allclose(event["T_before"], start)
    assert np.allclose(event["T_after"], way[-1] @ pose.inverse(dora.T_object_gizmo))
    path = np.array(event["path"])
    assert len(path) == 12  # the start, each of the 10, and the end
    assert path[0, 0] == 0.0 and (np.diff(path[:, 0]) >= 0).all()
    assert 0.5 <= event["duration_seconds"] == pytest.approx(path[-1, 0], abs=0.1)
    along = (path[:, 1:4] - start[:3, 3]) @ start[:3, 1]
    assert along == pytest.approx([0.005 * i for i in [*range(11), 10]], abs=1e-5)
    state = dora.http.get(f"/api/registrations/{dora.id}").json()
    assert np.allclose(state["T_world_object"], event["T_after"]) and state["can_undo"]


def log_of_five_drags(operator: Operator) -> list[dict[str, Any]] | None:
    """The whole log, once it has as many."""
    found = log_of(operator.http, operator.id)
    return found if len(found) == 6 else None


def test_each_users_drags_are_in_their_own_log_only(live):
    two = [Operator(live, f"{name} of the proxy") for name in ("eva", "finn")]
    with two[0].view() as first, two[1].view() as second:
        for i in range(5):
            for operator, view, axis in ((two[0], first, 0), (two[1], second, 2)):
                T = np.array(operator.registration["T_world_object"]) @ operator.T_object_gizmo
                T[:3, 3] += 0.01 * (i + 1) * T[:3, axis]
                view.drag([T])
        for operator, freedom in zip(two, ("tx", "tz"), strict=True):
            events = wait_until(partial(log_of_five_drags, operator), "five drags")
            assert [event["dof"] for event in events[1:]] == [[freedom]] * 5


def test_a_session_is_watched_as_long_as_its_view_is_open(live):
    gil = Operator(live, "gil of the proxy")
    live_session = live.live_session(gil.id)
    with gil.view() as view:
        view.node("MeshMessage", "/object/mesh")
        assert live_session.watchers == 1
    wait_until(lambda: live_session.watchers == 0, "the view to be left")


def test_the_page_learns_that_its_view_came_and_went(live):
    hal = Operator(live, "hal of the proxy")
    url = f"/api/registrations/{hal.id}"
    told: list[bool] = []
    live_session = live.live_session(hal.id)
    live_session.session.subscribe(lambda _state: told.append(live_session.viewers > 0))
    assert not hal.http.get(url).json()["view_open"]
    with hal.view() as view:
        view.node("MeshMessage", "/object/mesh")
        wait_until(lambda: hal.http.get(url).json()["view_open"], "the view to be open")
    wait_until(lambda: not hal.http.get(url).json()["view_open"], "the view to be left")
    wait_until(lambda: told[-1:] == [False], "the page to be told")
    assert True in told


def test_text_ends_the_connection_and_nothing_else(live, ann):
    with ann.view() as view:
        view.send_text("hello")
        with pytest.raises(ConnectionClosed):
            view.wait_for("NoSuchMessage")
    with ann.view() as view:
        view.node("MeshMessage", "/object/mesh")
