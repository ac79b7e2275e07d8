"""What reports are made of is kept until something of it changes."""

from pathlib import Path

from sqlalchemy import select

from app.analysis.kept import Kept
from app.auth import Auth, Role
from app.database import Database
from app.importing import import_dataset
from app.scene_data import SceneData
from app.storage import FileStore
from app.symmetries import decide
from app.tables import Object


def test_errors_are_collected_anew_when_symmetries_were_decided(
    database: Database, files: FileStore, demo: Path
) -> None:
    import_dataset(database, files, demo)
    lead = Auth(database).create_user("lea", Role.ADMIN)
    kept = Kept(database)
    first = kept.team()
    assert kept.team() is first
    with database.write() as session:
        row = session.scalars(select(Object).limit(1)).one()
        decide(session, row, [], SceneData(files).model(row), lead.id, None)
    second = kept.team()
    assert second is not first and kept.team() is second
