"""Two people at once, and what listens on the network."""

from collections.abc import Callable
from pathlib import Path

import psutil
import pytest
from playwright.sync_api import Page, expect

from tests.e2e.labelling_page import LabellingPage
from tests.processes import Server, serving

pytestmark = pytest.mark.e2e


def test_two_operators_do_not_reach_each_other(server: Server, open_page: Callable[[str], Page]) -> None:
    ann = LabellingPage(open_page(server.new_link("ann")), server)
    bob = LabellingPage(open_page(server.new_link("bob")), server)
    assert ann.url != bob.url
    assert ann.page.request.get(bob.url).status == 404
    assert ann.page.request.put(f"{bob.url}/pose", data={"T_world_object": []}).status in {404, 422}
    bobs_view = bob.page.locator("#view").get_attribute("src")
    assert bobs_view is not None
    view_path = bobs_view.split("?")[0]
    assert ann.page.request.get(f"{server.url}{view_path}").status == 404
    opened = ann.page.evaluate(
        """path => new Promise(done => {
          const socket = new WebSocket(location.origin.replace("http", "ws") + path, "viser-v1.1.1");
          socket.onopen = () => done("opened");
          socket.onclose = event => done("refused");
        })""",
        view_path,
    )
    assert opened == "refused"


def test_only_the_public_port_listens_beyond_loopback(
    tmp_path: Path, open_page: Callable[[str], Page]
) -> None:
    with serving(tmp_path / "state", "--prepare", "--host", "0.0.0.0") as running:
        labelling = LabellingPage(
            open_page(running.sign_in_link), running
        )  # a view and its viser server are up
        expect(labelling.page.locator("#snap")).to_be_enabled()
        public = {port for address, port in listening(running.process.pid) if address != "127.0.0.1"}
        assert public == {int(running.url.rsplit(":", 1)[1])}
        assert len(listening(running.process.pid)) > 3  # scheduler, workers and the view, all on the loopback


def listening(pid: int) -> set[tuple[str, int]]:
    """Addresses and ports that a process and its children listen on."""
    server = psutil.Process(pid)
    processes = (server, *server.children(recursive=True))
    sockets = [socket for process in processes for socket in process.net_connections("tcp")]
    return {(socket.laddr.ip, socket.laddr.port) for socket in sockets if socket.status == psutil.CONN_LISTEN}


def test_a_foreign_page_cannot_act(server: Server, open_page: Callable[[str], Page]) -> None:
    page = open_page(server.new_link("carl"))
    page.wait_for_url(f"{server.url}/")
    answer = page.request.post(
        f"{server.url}/api/tasks/1/registration", headers={"origin": "http://evil.example"}
    )
    assert answer.status == 403
    assert "foreign" in answer.json()["detail"]
