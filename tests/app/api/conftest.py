"""Fixtures: an application that belongs to one test file."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from app.auth import Role
from app.main import create_services
from tests.app.conftest import settings_for
from tests.app.live import LiveServer, running_server


@pytest.fixture(scope="module")
def server(
    imported_state: Path, cluster: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[LiveServer]:
    """The application behind a real port, for the tests of one file."""
    state_dir = Path(shutil.copytree(imported_state, tmp_path_factory.mktemp("server") / "state"))
    with running_server(create_services(settings_for(state_dir, cluster))) as running:
        yield running


@pytest.fixture(scope="module")
def operator(server: LiveServer) -> httpx.Client:
    """A script of an operator."""
    return server.script("olga")


@pytest.fixture(scope="module")
def reviewer(server: LiveServer) -> httpx.Client:
    """A script of a reviewer."""
    return server.script("rita", Role.REVIEWER)


@pytest.fixture(scope="module")
def chief(server: LiveServer) -> httpx.Client:
    """A script of an administrator."""
    return server.script("chief", Role.ADMIN)
