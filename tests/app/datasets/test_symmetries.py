"""Symmetries of objects: suggested once, decided by people, every decision kept."""

from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from sqlalchemy import delete, select, update
from sqlalchemy.exc import DBAPIError
from sqlalchemy.orm import Session

from app.access.auth import Auth
from app.datasets.importing import import_dataset
from app.datasets.scene_data import SceneData, symmetries_from_json
from app.datasets.symmetries import (
    OutdatedError,
    axis_from_json,
    decide,
    present_axes,
    restore,
    suggestions_of,
    version_before,
    versions_of,
)
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from app.storage.tables import Object, SymmetrySuggestions, SymmetryVersion
from registration_core import Symmetries, SymmetryAxis
from tests.app.small_dataset import BLOCK, TOOL, change_json

HALF_TURN = [-1, 0, 0, 0, 0, -1, 0, 0, 0, 0, 1, 0, 0, 0, 0, 1]


@pytest.fixture
def imported(database: Database, files: FileStore, demo: Path) -> Database:
    import_dataset(database, files, demo)
    return database


@pytest.fixture
def lead(database: Database) -> int:
    """Who decides."""
    return Auth(database).create_user("lea", Role.ADMIN).id


@pytest.fixture
def session(imported: Database, lead: int) -> Iterator[Session]:  # who is there before it writes
    with imported.write() as opened:
        yield opened


def object_of(session: Session, obj_id: int) -> Object:
    return session.scalars(select(Object).where(Object.obj_id == obj_id)).one()


def accept(session: Session, files: FileStore, row: Object, lead: int, *numbers: int) -> None:
    """Decide for suggestions by their numbers."""
    suggestions = suggestions_of(session, row)
    assert suggestions is not None
    axes = [axis_from_json(suggestions[number]) for number in numbers]
    decide(session, row, axes, SceneData(files).model(row), lead, row.symmetries_version)


def count(session: Session, row: Object) -> int:
    """How many rotations the present symmetries are, with none."""
    return len(symmetries_from_json(row.symmetries).transforms(row.diameter))


# -- suggestions


def test_an_object_without_symmetries_gets_suggestions(session: Session) -> None:
    block, tool = object_of(session, BLOCK), object_of(session, TOOL)
    suggestions = suggestions_of(session, block)
    assert suggestions is not None
    assert [entry["fold"] for entry in suggestions] == [4, 2, 2, 2, 2]
    assert np.abs(suggestions[0]["axis"]) == pytest.approx([1, 0, 0], abs=1e-3)
    assert max(entry["residual"] for entry in suggestions) < 1e-4
    assert block.suggestions_open and count(session, block) == 1
    assert suggestions_of(session, tool) == []
    assert not tool.suggestions_open  # there is nothing to decide


def test_a_mesh_is_looked_into_once(imported: Database, files: FileStore, demo: Path) -> None:
    with imported.read() as session:
        first = {row.mesh_hash: row.utc for row in session.scalars(select(SymmetrySuggestions))}
    steps: list[str] = []
    import_dataset(imported, files, demo, "again", lambda _share, what: steps.append(what))
    assert "looking for symmetries" not in steps
    with imported.read() as session:
        after = {row.mesh_hash: row.utc for row in session.scalars(select(SymmetrySuggestions))}
        blocks = session.scalars(select(Object).where(Object.obj_id == BLOCK)).all()
    assert after == first and len(first) == 2
    assert [block.suggestions_open for block in blocks] == [True, True]


def test_symmetries_of_a_dataset_are_its_first_version(
    database: Database, files: FileStore, demo_copy: Path
) -> None:
    entry = {"symmetries_discrete": [HALF_TURN]}
    change_json(demo_copy / "models/models_info.json", lambda infos: infos[str(BLOCK)].update(entry))
    import_dataset(database, files, demo_copy)
    with database.read() as session:
        block = object_of(session, BLOCK)
        (version,) = versions_of(session, block.id)
        assert (version.version, version.user_id, version.axes) == (1, None, None)
        assert version.symmetries == block.symmetries and count(session, block) == 2
        (axis,) = present_axes(session, block)
        assert suggestions_of(session, block) is None
    assert axis["fold"] == 2 and np.abs(axis["axis"]) == pytest.approx([0, 0, 1])
    assert not block.suggestions_open


# -- decisions


def test_accepting_makes_a_version_of_the_closed_group(session: Session, files: FileStore, lead: int) -> None:
    block = object_of(session, BLOCK)
    accept(session, files, block, lead, 0, 1)
    assert block.symmetries_version == 2 and not block.suggestions_open
    assert count(session, block) == 8
    newest, first = versions_of(session, block.id)
    assert newest.user is not None
    assert (newest.version, newest.user.name) == (2, "lea") and first.version == 1
    assert [axis["fold"] for axis in present_axes(session, block)] == [4, 2]


def test_none_is_an_answer(session: Session, files: FileStore, lead: int) -> None:
    block = object_of(session, BLOCK)
    accept(session, files, block, lead)
    assert not block.suggestions_open
    assert block.symmetries_version == 2 and present_axes(session, block) == []


def test_undo_goes_back_step_by_step_and_everything_stays(
    session: Session, files: FileStore, lead: int
) -> None:
    block = object_of(session, BLOCK)
    accept(session, files, block, lead, 0)
    accept(session, files, block, lead, 0, 1)
    counts = []
    while (before := version_before(session, block)) is not None:
        restore(session, block, before, lead, None)
        counts.append(count(session, block))
    assert counts == [4, 1] and block.suggestions_open
    assert [row.restores for row in versions_of(session, block.id)] == [1, 2, None, None, None]
    restore(session, block, 3, lead, None)
    assert count(session, block) == 8 and not block.suggestions_open
    accept(session, files, block, lead, 1)
    assert version_before(session, block) == 3


def test_what_a_lead_decided_survives_another_import(
    imported: Database, files: FileStore, demo: Path, lead: int
) -> None:
    with imported.write() as session:
        accept(session, files, object_of(session, BLOCK), lead)
    import_dataset(imported, files, demo)
    with imported.read() as session:
        block = object_of(session, BLOCK)
    assert block.symmetries_version == 2 and not block.suggestions_open


def test_who_has_not_seen_the_present_version_has_to_look_first(
    session: Session, files: FileStore, lead: int
) -> None:
    block = object_of(session, BLOCK)
    model = SceneData(files).model(block)
    decide(session, block, [], model, lead, 1)
    for act in (
        lambda: decide(session, block, [], model, lead, 1),
        lambda: restore(session, block, 1, lead, 1),
    ):
        with pytest.raises(OutdatedError, match="version 2 is the present one, not 1"):
            act()
    assert block.symmetries_version == 2


def test_a_refused_decision_changes_nothing(session: Session, files: FileStore, lead: int) -> None:
    block = object_of(session, BLOCK)
    z = np.array([0.0, 0.0, 1.0])
    twice = [SymmetryAxis(z, np.zeros(3), 2), SymmetryAxis(z, np.zeros(3), 4)]
    with pytest.raises(ValueError, match=r"axes\[0\] and axes\[1\] have one direction"):
        decide(session, block, twice, SceneData(files).model(block), lead, None)
    with pytest.raises(ValueError, match="restore: there is no version 2; the newest is 1"):
        restore(session, block, 2, lead, None)
    assert block.symmetries_version == 1 and len(versions_of(session, block.id)) == 1


def test_versions_can_only_be_added(imported: Database) -> None:
    nothing: dict[str, list[object]] = {"discrete": [], "continuous": []}
    for statement in (update(SymmetryVersion).values(symmetries=nothing), delete(SymmetryVersion)):
        with pytest.raises(DBAPIError, match="append-only"), imported.write() as session:
            session.execute(statement)


def test_the_hash_of_the_import_stays(session: Session, files: FileStore, lead: int) -> None:
    block = object_of(session, BLOCK)
    before = block.model_hash
    accept(session, files, block, lead, 0)
    model = SceneData(files).model(block)
    assert block.model_hash == before != model.content_hash
    assert model.symmetries != Symmetries()
