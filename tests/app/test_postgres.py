"""The same tables and sessions on PostgreSQL, where its server is installed."""

import os
import shutil
import socket
import subprocess
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from app.auth import Actor, Auth, Role
from app.config import Settings
from app.database import Database
from app.importing import import_dataset
from app.main import create_services
from app.storage import FileStore
from app.study.erasing import erase_registrations
from tests.app.waiting import wait_until


@pytest.fixture(scope="module")
def postgres_url() -> Iterator[str]:
    """Address of an empty database on a server of its own, which listens on the loopback."""
    programs = sorted(Path("/usr/lib/postgresql").glob("*/bin"))
    if not programs:
        pytest.skip("PostgreSQL's server is not installed (Debian: apt-get install postgresql)")
    folder = Path(subprocess.check_output(["mktemp", "-d"], text=True).strip())
    as_owner: list[str] = []
    if os.geteuid() == 0:  # the server refuses to run as root
        shutil.chown(folder, "postgres")
        as_owner = ["setpriv", "--reuid=postgres", "--regid=postgres", "--clear-groups"]
    with socket.socket() as free:
        free.bind(("127.0.0.1", 0))
        port = free.getsockname()[1]

    def run(program: str, *arguments: str) -> None:
        command = [*as_owner, str(programs[-1] / program), *arguments]
        subprocess.run(command, check=True, cwd=folder, stdout=subprocess.DEVNULL)

    data = str(folder / "data")
    run("initdb", "-D", data, "-A", "trust", "-U", "snap6d")
    options = f"-p {port} -k {folder} -c listen_addresses=127.0.0.1"
    run("pg_ctl", "-D", data, "-o", options, "-l", str(folder / "log"), "-w", "start")
    try:
        yield f"postgresql+psycopg://snap6d@127.0.0.1:{port}/postgres"
    finally:
        run("pg_ctl", "-D", data, "-m", "immediate", "-w", "stop")
        shutil.rmtree(folder)


def refuses_changes(database: Database) -> None:
    for statement in ("DELETE FROM events", "UPDATE estimates SET seed = 0", "TRUNCATE events"):
        with pytest.raises(DBAPIError, match="append-only"), database.write() as session:
            session.execute(text(statement))


def test_a_registration_on_postgresql_and_its_erasing(
    postgres_url: str, demo: Path, cluster: str, tmp_path: Path
) -> None:
    database = Database(postgres_url)
    database.migrate()
    database.migrate()
    database.check_version()
    summary = import_dataset(database, FileStore(tmp_path / "files"), demo)
    assert summary.tasks > 0
    assert import_dataset(database, FileStore(tmp_path / "files"), demo).tasks == 0
    database.close()

    settings = Settings(state_dir=tmp_path, database_url=postgres_url, scheduler_address=cluster)
    services = create_services(settings)
    try:
        auth: Auth = services.auth
        identity = auth.identify_token(auth.create_token("robot", Role.OPERATOR))
        assert identity is not None
        seat = services.desk.start(1, identity)
        snap_id = seat.session.snap(Actor.SCRIPT, seed=1)
        wait_until(lambda: services.log.estimate(snap_id) is not None, "an estimate")
        seat.session.submit(Actor.SCRIPT)
        kinds = [event.kind for event in services.log.events(seat.registration.id)]
        assert kinds == ["opened", "snap_requested", "snap_applied", "submit"]
        again = services.desk.start(1, identity)
        assert np.allclose(again.session.snapshot().T_world_object, seat.session.snapshot().T_world_object)
        refuses_changes(services.database)
        with services.database.write() as session:
            erase_registrations(session, identity.user_id)
        assert services.log.events(seat.registration.id) == []
        refuses_changes(services.database)
    finally:
        services.desk.close()
        services.export_jobs.close()
        services.snapper.close()
        services.database.close()
