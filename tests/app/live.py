"""The application behind a real port, in a thread of this process, and clients of it."""

import threading
from collections.abc import Iterator
from contextlib import contextmanager
from dataclasses import dataclass, field

import httpx
import uvicorn

from app.access.auth import Identity
from app.api.dependencies import SESSION_COOKIE
from app.labeling.live.live_session import LiveSession
from app.main import create_app
from app.services import Services
from app.serving.connections import server_config
from app.storage.roles import Actor, Role
from app.storage.tables import Registration
from tests.app.waiting import LONGEST, wait_until


@dataclass(frozen=True)
class LiveServer:
    """A running server, and clients of it: scripts with a token, people with a login cookie, strangers."""

    services: Services
    port: int
    clients: list[httpx.Client] = field(default_factory=list)

    @property
    def host(self) -> str:
        """As in the Host header."""
        return f"127.0.0.1:{self.port}"

    @property
    def url(self) -> str:
        """Where it answers."""
        return f"http://{self.host}"

    def stranger(self) -> httpx.Client:
        """Somebody who is not signed in."""
        self.clients.append(httpx.Client(base_url=self.url, timeout=LONGEST))
        return self.clients[-1]

    def script(self, name: str, role: Role = Role.OPERATOR) -> httpx.Client:
        """A script with a token."""
        client = self.stranger()
        client.headers["authorization"] = f"Bearer {self.services.auth.create_token(name, role)}"
        return client

    def person(self, name: str, role: Role = Role.OPERATOR) -> httpx.Client:
        """Somebody with a login cookie."""
        client = self.stranger()
        client.cookies.set(SESSION_COOKIE, self.login(name, role))
        return client

    def login(self, name: str, role: Role = Role.OPERATOR) -> str:
        """The secret of a new login session."""
        auth = self.services.auth
        return auth.sign_in_with_link(auth.create_link(auth.ensure_user(name, role).id))

    def live_session(self, registration_id: int) -> LiveSession:
        """The live session of a registration."""
        with self.services.database.read() as session:
            owner = session.get_one(Registration, registration_id).user_id
        identity = Identity(owner, "", Role.OPERATOR, Actor.HUMAN)
        return self.services.live_sessions.open(registration_id, identity)


@contextmanager
def running_server(services: Services) -> Iterator[LiveServer]:
    """Serve on a free port until the block ends; the services end with it."""
    config = server_config(
        create_app(services),
        services.settings,
        host="127.0.0.1",
        port=0,
        log_level="critical",
        timeout_graceful_shutdown=1,
    )
    server = uvicorn.Server(config)
    thread = threading.Thread(target=server.run)
    thread.start()
    try:
        wait_until(lambda: server.started or not thread.is_alive(), "the server to start")
        live = LiveServer(services, server.servers[0].sockets[0].getsockname()[1])
        yield live
        for client in live.clients:
            client.close()
    finally:
        server.should_exit = True
        thread.join(LONGEST)
        assert not thread.is_alive()
