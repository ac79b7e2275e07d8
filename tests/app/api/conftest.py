"""Fixtures: an application that belongs to one test file."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from app.datasets.importing import import_dataset
from app.main import create_services
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from tests.app.conftest import settings_for
from tests.app.live import LiveServer, running_server
from tests.app.postgres import new_database


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Run all tests of the interface on both databases."""
    if "server" in metafunc.fixturenames:
        metafunc.parametrize("server", ["sqlite", "postgresql"], indirect=True, scope="module")


@pytest.fixture(scope="session")
def imported_on_postgres(postgres_server: str, demo: Path, tmp_path_factory: pytest.TempPathFactory) -> str:
    """Name of a database into which the small dataset was imported; to be copied."""
    url = new_database(postgres_server)
    database = Database(url)
    database.migrate()
    import_dataset(database, FileStore(tmp_path_factory.mktemp("imported") / "files"), demo)
    database.close()
    return url.rpartition("/")[2]


@pytest.fixture(scope="module")
def server(
    request: pytest.FixtureRequest,
    imported_state: Path,
    cluster: str,
    tmp_path_factory: pytest.TempPathFactory,
) -> Iterator[LiveServer]:
    """The application behind a real port, for the tests of one file, on one of the databases."""
    state_dir = Path(shutil.copytree(imported_state, tmp_path_factory.mktemp("server") / "state"))
    settings = settings_for(state_dir, cluster)
    if request.param == "postgresql":
        place, template = (
            request.getfixturevalue(name) for name in ("postgres_server", "imported_on_postgres")
        )
        settings = settings.model_copy(update={"database_url": new_database(place, template)})
    with running_server(create_services(settings)) as running:
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
