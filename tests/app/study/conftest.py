"""Fixtures: studies of the small dataset."""

from collections.abc import Iterator
from pathlib import Path

import pytest
from sqlalchemy import select

from app.access.auth import Auth
from app.config import Settings
from app.datasets.scene_data import SceneData
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from app.storage.tables import Task, User
from app.study.plan import StudyPlan, TaskRef
from app.study.studies import Studies


@pytest.fixture
def database(state_dir: Path) -> Iterator[Database]:
    """A database into which the small dataset was imported."""
    opened = Database(Settings(state_dir=state_dir).resolved_database_url)
    yield opened
    opened.close()


@pytest.fixture
def files(state_dir: Path) -> FileStore:
    """Its files."""
    return FileStore(Settings(state_dir=state_dir).files_dir)


@pytest.fixture
def studies(database: Database, files: FileStore) -> Studies:
    """Of the small dataset."""
    return Studies(database, SceneData(files))


@pytest.fixture
def admin(database: Database, studies: Studies) -> User:
    """Whoever sets studies up."""
    return Auth(database).create_user("root", Role.ADMIN)


@pytest.fixture
def plan(database: Database, studies: Studies) -> StudyPlan:
    """Two tasks and one for practice; one novice, two experts."""
    with database.read() as session:
        found = session.scalars(select(Task).order_by(Task.id)).all()
    refs = [TaskRef(scene_id=t.scene_id, object_id=t.object_id, instance=t.instance) for t in found]
    return StudyPlan(
        tasks=refs[:2],
        practice=refs[2:3],
        groups={"novice": 1, "expert": 2},
        questions=[{"text": "Have you used a 3-D program?", "choices": ["yes", "no"]}],
    )
