"""The names under which the app answers: a page of another site cannot make the app one of its own.

A site may let its name lead to the machine of whoever looks at it; its pages would then be of the same
origin as the app. Such a name is none of ours, and an address, which no site can claim, is never refused.
"""

import asyncio
import ipaddress
import socket
from urllib.parse import urlsplit

from starlette.requests import HTTPConnection
from starlette.types import ASGIApp, Receive, Scope, Send
from starlette.websockets import WebSocketClose

from app.api.dependencies import get_services
from app.api.problems import problem
from app.config import Settings

MISDIRECTED = 421


class HostNames:
    """Refuses requests to names that are not the app's; a middleware.

    Behind a public address, which says what a foreign page is, the Host header is asked for nothing.
    """

    def __init__(self, app: ASGIApp) -> None:
        self._app = app
        self._names: frozenset[str] | None = None

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] not in {"http", "websocket"}:
            await self._app(scope, receive, send)
            return
        connection = HTTPConnection(scope)
        settings = get_services(connection).settings
        name = host_name(connection.headers.get("host", ""))
        if settings.public_url or _is_address(name) or await self._is_own(name, settings):
            await self._app(scope, receive, send)
        elif scope["type"] == "websocket":
            await WebSocketClose()(scope, receive, send)
        else:
            detail = (
                f"Snap6D is not known here as {name!r}: where this is its name, let SNAP6D_PUBLIC_URL or"
                " SNAP6D_HOST_NAMES say so."
            )
            await problem(MISDIRECTED, detail)(scope, receive, send)

    async def _is_own(self, name: str, settings: Settings) -> bool:
        if self._names is None:  # looking up the machine's full name may take a moment
            self._names = await asyncio.to_thread(own_names, settings)
        return name in self._names


def own_names(settings: Settings) -> frozenset[str]:
    """The names of this machine, and those that the settings give it."""
    machine = socket.gethostname().lower()
    given = [settings.host, *settings.host_names.split(",")]
    names = {"localhost", machine, f"{machine}.local", socket.getfqdn().lower()}
    return frozenset(names | {name.strip().lower() for name in given} - {""})


def host_name(host: str) -> str:
    """The name in a Host header, without its port."""
    try:
        return (urlsplit(f"//{host}").hostname or "").rstrip(".")
    except ValueError:
        return host


def _is_address(name: str) -> bool:
    try:
        ipaddress.ip_address(name)
    except ValueError:
        return False
    return True
