"""Runs the application on its one port."""

import socket
import threading
from collections.abc import Callable

import rich
import uvicorn
from sqlalchemy import select

from app.access.auth import LOCAL_ADMINISTRATOR
from app.config import Settings
from app.datasets.importing import import_dataset
from app.main import create_app, create_services
from app.resources import DEMO_SCENES
from app.services import Services
from app.serving.connections import server_config
from app.serving.listening import ServeError, sign_in_link
from app.serving.memory import keep_large_blocks_apart
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from app.storage.tables import Dataset
from app.workers.pool import Snapper

SECONDS_TO_FINISH = 3


def run(
    settings: Settings,
    listener: socket.socket,
    snapper: Snapper,
    prepare: bool,
    say: Callable[[str], None],
) -> None:
    """Serve until stopped; when pages can be opened, tell a one-time sign-in link.

    Args:
        settings: What to serve with.
        listener: Where to serve.
        snapper: The workers, which may still be starting.
        prepare: Make or update the database before; a new one gets the demo scenes.
        say: Tells the person at the console.

    Raises:
        ServeError: where the workers cannot be had.
        DatabaseError: where the database is not of this version.
    """
    keep_large_blocks_apart()
    rich.reconfigure(quiet=True)  # or viser announces the private address of every view
    if prepare:
        prepare_state(settings, say)
    services = create_services(settings, snapper)
    config = server_config(
        create_app(services), settings, log_level="warning", timeout_graceful_shutdown=SECONDS_TO_FINISH
    )
    server = _AnnouncingServer(config, lambda: _announce(services, listener, say))
    failures: list[Exception] = []

    def stop_without_workers() -> None:
        try:
            snapper.wait_until_ready()
        except Exception as error:
            failures.append(error)
            server.should_exit = True

    threading.Thread(target=stop_without_workers, daemon=True).start()
    with services.database.kept_to_one_server():
        server.run(sockets=[listener])
    if failures:
        raise ServeError(f"the workers cannot be reached: {failures[0]}")


def prepare_state(settings: Settings, say: Callable[[str], None]) -> None:
    """Make or update the database, and import the demo scenes where it holds no dataset yet."""
    database = Database(settings.resolved_database_url)
    try:
        database.migrate()
        with database.read() as session:
            is_empty = session.scalar(select(Dataset.id).limit(1)) is None
        if is_empty and DEMO_SCENES.is_dir():
            summary = import_dataset(database, FileStore(settings.files_dir), DEMO_SCENES)
            say(f"Imported the demo scenes: {summary.tasks} tasks.")
    finally:
        database.close()


class _AnnouncingServer(uvicorn.Server):
    """Says when it is ready."""

    def __init__(self, config: uvicorn.Config, announce: Callable[[], None]) -> None:
        super().__init__(config)
        self._announce = announce

    async def startup(self, sockets: list[socket.socket] | None = None) -> None:
        await super().startup(sockets)
        if self.started:
            self._announce()


def _announce(services: Services, listener: socket.socket, say: Callable[[str], None]) -> None:
    user = services.auth.ensure_user(LOCAL_ADMINISTRATOR, Role.ADMIN)
    port = listener.getsockname()[1]
    say("Snap6D is ready. Open this link to sign in; it works once:")
    say(sign_in_link(services.settings, port, services.auth.create_link(user.id)))
