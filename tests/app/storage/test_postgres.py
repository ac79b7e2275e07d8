"""The same tables and sessions on PostgreSQL, where its server is installed."""

import subprocess
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from app.access.auth import Auth
from app.config import Settings
from app.datasets.importing import import_dataset
from app.main import create_services
from app.storage.backup import BackupError, back_up
from app.storage.checkup import examine
from app.storage.database import Database, DatabaseError
from app.storage.files import FileStore
from app.storage.named_files import open_store
from app.storage.roles import Actor, Role
from app.study.erasing import erase_registrations
from tests.app.postgres import new_database
from tests.app.waiting import wait_until
from tests.processes import failure, run_snap6d


@pytest.fixture(scope="module")
def postgres_url(postgres_server: str) -> str:
    """Address of an empty database."""
    return new_database(postgres_server)


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
        live_session = services.live_sessions.start(1, identity)
        snap_id = live_session.session.snap(Actor.SCRIPT, seed=1)
        wait_until(lambda: services.log.estimate(snap_id) is not None, "an estimate")
        live_session.session.submit(Actor.SCRIPT)
        kinds = [event.kind for event in services.log.events(live_session.registration.id)]
        assert kinds == ["opened", "snap_requested", "snap_applied", "submit"]
        again = services.live_sessions.start(1, identity)
        assert np.allclose(
            again.session.snapshot().T_world_object, live_session.session.snapshot().T_world_object
        )
        refuses_changes(services.database)
        with services.database.write() as session:
            erase_registrations(session, identity.user_id)
        assert services.log.events(live_session.registration.id) == []
        refuses_changes(services.database)
    finally:
        services.live_sessions.close()
        services.export_jobs.close()
        services.snapper.close()
        services.database.close()


def test_a_backup_of_postgresql_is_restored_into_another_database(
    postgres_url: str, demo: Path, tmp_path: Path, monkeypatch: pytest.MonkeyPatch
) -> None:
    database = Database(postgres_url)
    database.migrate()
    files = FileStore(tmp_path / "files")
    import_dataset(database, files, demo, "kept")
    archive = tmp_path / "backup.tar"
    back_up(database, files, archive, lambda share, what: None)
    with database.engine.connect().execution_options(isolation_level="AUTOCOMMIT") as connection:
        connection.execute(text("CREATE DATABASE another"))
    (tmp_path / "again").mkdir()
    subprocess.run(["tar", "-xf", archive, "-C", tmp_path / "again"], check=True)
    url = postgres_url.rpartition("/")[0].replace("+psycopg", "") + "/another"
    restore = ["pg_restore", "--no-owner", f"--dbname={url}", str(tmp_path / "again/snap6d.pgdump")]
    subprocess.run(restore, check=True)
    other = Database(url.replace("postgresql", "postgresql+psycopg"))
    found = examine(other, open_store(tmp_path / "again/files", other), lambda share, what: None)
    assert found.faults == () and found.files == 6
    refuses_changes(other)
    other.close()

    monkeypatch.setenv("PATH", str(tmp_path))
    with pytest.raises(BackupError, match="pg_dump is not installed here"):
        back_up(database, files, tmp_path / "none.tar", lambda share, what: None)
    assert not (tmp_path / "none.tar").exists()
    database.close()


def test_one_server_works_on_a_database_whatever_its_state_folder(postgres_url: str, tmp_path: Path) -> None:
    database, other = Database(postgres_url), Database(postgres_url)
    database.migrate()
    with database.kept_to_one_server():
        refused = pytest.raises(DatabaseError, match="another Snap6D server works on this database")
        with refused, other.kept_to_one_server():
            pass
        serve = ("serve", "--port", "0", "--workers", "1", "--database-url", postgres_url)
        assert "another Snap6D server works on this database" in failure(run_snap6d(tmp_path, *serve))
    with other.kept_to_one_server():
        pass
    database.close()
    other.close()


def test_a_database_of_a_newer_version_is_refused_with_a_sentence(postgres_url: str) -> None:
    database = Database(postgres_url)
    database.migrate()
    with database.write() as session:
        found = session.scalar(text("SELECT version_num FROM alembic_version"))
        session.execute(text("UPDATE alembic_version SET version_num = 'later'"))
    try:
        for use in (database.check_version, database.migrate):
            with pytest.raises(DatabaseError, match=r"newer Snap6D \(revision later\); update Snap6D"):
                use()
    finally:
        with database.write() as session:
            session.execute(text("UPDATE alembic_version SET version_num = :found"), {"found": found})
        database.close()
