"""What reports are made of is kept until something of it changes."""

from pathlib import Path

from sqlalchemy import select

from app.access.auth import Auth
from app.analysis.report.report_cache import ReportCache
from app.datasets.importing import import_dataset
from app.datasets.scene_data import SceneData
from app.datasets.symmetries import decide
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from app.storage.tables import Object


def test_errors_are_collected_anew_when_symmetries_were_decided(
    database: Database, files: FileStore, demo: Path
) -> None:
    import_dataset(database, files, demo)
    lead = Auth(database).create_user("lea", Role.ADMIN)
    kept = ReportCache(database)
    first = kept.team()
    assert kept.team() is first
    with database.write() as session:
        row = session.scalars(select(Object).limit(1)).one()
        decide(session, row, [], SceneData(files).model(row), lead.id, None)
    second = kept.team()
    assert second is not first and kept.team() is second
