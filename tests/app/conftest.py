"""Fixtures: a database, a file store, a small dataset, workers, and the application on top of them."""

import logging
import shutil
import sys
import uuid
from collections.abc import Iterator
from pathlib import Path
from subprocess import CompletedProcess
from typing import cast

import dask
import httpx
import pytest

import app.cli.commands
from app.access.auth import Identity
from app.config import Settings
from app.datasets.importing import import_dataset
from app.labeling.live.live_session import LiveSession
from app.main import create_services
from app.services import Services
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from app.workers.pool import start_workers
from tests.app import postgres
from tests.app.empty_database import new_empty_database
from tests.app.labeling.live_sessions import sign_up
from tests.app.live import LiveServer, running_server
from tests.app.small_dataset import NAME, write_small_dataset
from tests.processes import Command

# pytest hangs what captures logs on loggers that keep theirs to themselves, and Dask, whose loggers do,
# silences whatever hangs on them for as long as a cluster lives: no test would see a log any more
for name in ("distributed", "bokeh"):
    logging.getLogger(name).propagate = True


ON_BOTH_DATABASES = {
    "tests.app.access.test_auth",
    "tests.app.storage.test_event_log",
    "tests.app.datasets.test_importing",
}
"""Modules whose tests of a database run on SQLite and on PostgreSQL."""


def pytest_generate_tests(metafunc: pytest.Metafunc) -> None:
    """Let tests of these modules have each database."""
    if "database" in metafunc.fixturenames and metafunc.module.__name__ in ON_BOTH_DATABASES:
        metafunc.parametrize("database", ["sqlite", "postgresql"], indirect=True)


@pytest.fixture(scope="session")
def postgres_server() -> Iterator[str]:
    """Address of a PostgreSQL server."""
    with postgres.postgres_server() as address:
        yield address


@pytest.fixture(scope="session")
def postgres_template(postgres_server: str) -> str:
    """Name of an empty database with its tables on that server; to be copied."""
    url = postgres.new_database(postgres_server)
    template = Database(url)
    template.migrate()
    template.close()
    return url.rpartition("/")[2]


@pytest.fixture
def database(request: pytest.FixtureRequest, tmp_path: Path) -> Iterator[Database]:
    """An empty database with its tables."""
    if getattr(request, "param", "sqlite") == "postgresql":
        server, template = (request.getfixturevalue(f"postgres_{name}") for name in ("server", "template"))
        opened = Database(postgres.new_database(server, template))
    else:
        opened = new_empty_database(tmp_path)
    yield opened
    opened.close()


@pytest.fixture
def files(tmp_path: Path) -> FileStore:
    """An empty file store."""
    return FileStore(tmp_path / "files")


@pytest.fixture(scope="session")
def demo(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The small dataset; to be read, not to be changed."""
    return write_small_dataset(tmp_path_factory.mktemp("small") / NAME)


@pytest.fixture
def demo_copy(demo: Path, tmp_path: Path) -> Path:
    """The small dataset; to be changed."""
    return Path(shutil.copytree(demo, tmp_path / NAME))


@pytest.fixture(scope="session")
def cluster() -> Iterator[str]:
    """Address of a scheduler with two workers, whose certificates Dask's configuration names."""
    with start_workers(2) as started:
        certificates = {
            "ca-file": started.security.tls_ca_file,
            "client.key": started.security.tls_client_key,
            "client.cert": started.security.tls_client_cert,
        }
        with dask.config.set({f"distributed.comm.tls.{key}": text for key, text in certificates.items()}):
            yield started.scheduler_address


@pytest.fixture(scope="session")
def imported_state(demo: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """A state directory into which the small dataset was imported; to be copied."""
    settings = Settings(state_dir=tmp_path_factory.mktemp("imported") / "state")
    database = new_empty_database(settings.state_dir)
    import_dataset(database, FileStore(settings.files_dir), demo)
    database.close()
    return settings.state_dir


@pytest.fixture
def state_dir(imported_state: Path, tmp_path: Path) -> Path:
    """A state directory with the small dataset."""
    return Path(shutil.copytree(imported_state, tmp_path / "state"))


def settings_for(state_dir: Path, cluster: str) -> Settings:
    """What the application is started with."""
    return Settings(state_dir=state_dir, scheduler_address=cluster, max_upload_mb=8)


@pytest.fixture
def services(state_dir: Path, cluster: str) -> Iterator[Services]:
    """The parts of an application, without their port."""
    opened = create_services(settings_for(state_dir, cluster))
    yield opened
    opened.live_sessions.close()
    opened.replays.close()
    opened.export_jobs.close()
    opened.snapper.close()
    opened.database.close()


@pytest.fixture
def own_live(state_dir: Path, cluster: str) -> Iterator[LiveServer]:
    """The application behind a real port, for a test that changes what all users see."""
    with running_server(create_services(settings_for(state_dir, cluster))) as server:
        yield server


@pytest.fixture(scope="session")
def live(
    imported_state: Path, cluster: str, tmp_path_factory: pytest.TempPathFactory
) -> Iterator[LiveServer]:
    """The application behind a real port, for tests whose users keep to their own registrations."""
    state_dir = Path(shutil.copytree(imported_state, tmp_path_factory.mktemp("live") / "state"))
    with running_server(create_services(settings_for(state_dir, cluster))) as server:
        yield server


@pytest.fixture
def script(live: LiveServer) -> httpx.Client:
    """A script of a new operator."""
    return live.script(f"robot {uuid.uuid4().hex}")


@pytest.fixture
def admin(live: LiveServer) -> httpx.Client:
    """A script of a new administrator."""
    return live.script(f"root {uuid.uuid4().hex}", Role.ADMIN)


@pytest.fixture
def snap6d(monkeypatch: pytest.MonkeyPatch, capsys: pytest.CaptureFixture[str]) -> Command:
    """Runs a command to its end within this process, which is quicker."""

    def run(state_dir: Path, *arguments: str, **variables: str) -> CompletedProcess[str]:
        with monkeypatch.context() as patched:
            for name, value in {"SNAP6D_STATE_DIR": str(state_dir), **variables}.items():
                patched.setenv(name, value)
            patched.setattr(sys, "argv", ["snap6d", *arguments])
            with pytest.raises(SystemExit) as ended:
                app.cli.commands.main()
                raise SystemExit(0)
        return CompletedProcess(arguments, cast(int, ended.value.code or 0), *capsys.readouterr())

    return run


@pytest.fixture
def ann(services: Services) -> Identity:
    return sign_up(services, "ann")


@pytest.fixture
def live_session(services: Services, ann: Identity) -> LiveSession:
    """Ann before the first task: the angle tool of scene 1."""
    return services.live_sessions.start(1, ann)
