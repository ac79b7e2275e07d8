"""Pages of other sites, in a browser of somebody who is signed in, and on the server's machine."""

from collections.abc import Iterator

import httpx
import psutil
import viser
from websockets.exceptions import WebSocketException
from websockets.sync.client import connect
from websockets.typing import Origin, Subprotocol

from tests.tools.attack.target import Outcome, Target, refused

VIEWS = [Subprotocol(f"viser-v{viser.__version__}")]


def foreign_origins(target: Target) -> list[str]:
    """Of pages that are not the app's, some of which look like it."""
    return [
        "http://evil.example",
        "null",
        "http://127.0.0.1",
        "http://127.0.0.1:1",
        f"http://127.0.0.1:{target.port}.evil.example",
        f"http://evil.example:{target.port}",
        f"http://evil.example#{target.host}",
    ]


def attack_origins(target: Target) -> Iterator[Outcome]:
    """They change nothing with somebody's cookie, see no view, and may read no answer."""
    url = f"/api/registrations/{target.registration_id}"
    with httpx.Client(base_url=target.url, headers=target.login, timeout=60) as browser:
        for origin in foreign_origins(target):
            headers = {"origin": origin}
            for method, path in (
                ("POST", f"{url}/reset"),
                ("PUT", f"{url}/pose"),
                ("POST", f"{url}/submit"),
                ("POST", "/api/participation/withdraw"),
                ("POST", "/api/sign-out"),
                ("POST", "/api/sign-in"),
            ):
                body = {"name": "x", "password": "x"} if path.endswith("sign-in") else {}
                answer = browser.request(method, path, json=body, headers=headers)
                yield refused(f"{method} {path} from {origin}", answer, 403)
            for path in (f"{url}/stream", "/api/me", f"/view/{target.registration_id}/"):
                with browser.stream("GET", path, headers=headers) as open_answer:
                    readable = "access-control-allow-origin" in open_answer.headers
                yield Outcome(f"GET {path} from {origin}", not readable, str(open_answer.status_code))
            asked = headers | {"access-control-request-method": "PUT"}
            allowed = "access-control-allow-methods" in browser.options(f"{url}/pose", headers=asked).headers
            yield Outcome(f"OPTIONS {url}/pose from {origin}", not allowed, "")
            for path in (f"/view/{target.registration_id}/", f"/view/replay/{target.registration_id}/"):
                yield _websocket(f"ws://{target.host}{path}", origin, target.login)


def attack_ports(target: Target) -> Iterator[Outcome]:
    """No other port of the server or its workers shows or takes anything."""
    server = psutil.Process(target.pid)
    for process in (server, *server.children(recursive=True)):
        for connection in process.net_connections("tcp"):
            if connection.status == "LISTEN" and connection.laddr.port != target.port:
                address = f"127.0.0.1:{connection.laddr.port}"
                yield _page(address)
                yield _websocket(f"ws://{address}/", "http://evil.example", {})
                yield _websocket(f"ws://{address}/", None, {})


def _page(address: str) -> Outcome:
    try:
        answer = httpx.get(f"http://{address}/", timeout=5)
    except httpx.HTTPError as error:
        return Outcome(f"GET http://{address}/", True, str(error))
    return refused(f"GET http://{address}/", answer)


def _websocket(url: str, origin: str | None, headers: dict[str, str]) -> Outcome:
    what = f"WebSocket {url} from {origin or 'no page'}"
    try:
        with connect(
            url,
            origin=None if origin is None else Origin(origin),
            subprotocols=VIEWS,
            additional_headers=headers,
            open_timeout=5,
            proxy=None,
        ):
            return Outcome(what, False, "opened")
    except (OSError, WebSocketException, EOFError) as error:
        return Outcome(what, True, str(error))
