"""The objects of all datasets are built in the background, on real workers."""

import threading
from collections.abc import Iterator
from contextlib import closing

import numpy as np
import pytest
from sqlalchemy import delete, select, update

from app.datasets.scene_data import symmetries_to_json
from app.datasets.symmetries import decide, suggestions_of
from app.services import Services
from app.storage.roles import Role
from app.storage.tables import Object, SymmetrySuggestions
from app.workers.preparation import Preparation
from registration_core import ObjectModel, Symmetries, SymmetryAxis
from registration_core.geometry.object_model import ContinuousSymmetry
from tests.app.datasets.test_importing import THREAD_MESH
from tests.app.small_dataset import BLOCK, TOOL
from tests.app.snap_jobs import knowing
from tests.app.waiting import wait_until

HALF_TURN = SymmetryAxis(np.array([0.0, 0.0, 1.0]), np.zeros(3), 2)


@pytest.fixture
def preparation(services: Services) -> Iterator[Preparation]:
    with closing(services.preparation) as prepared:
        yield prepared


def objects_of(services: Services) -> list[Object]:
    with services.database.read() as session:
        return list(session.scalars(select(Object)))


def hashes_of(services: Services) -> list[str]:
    return [services.data.model(item).content_hash for item in objects_of(services)]


def suggested(services: Services, item: Object) -> list | None:
    with services.database.read() as session:
        return suggestions_of(session, item)


def wait_until_prepared(services: Services) -> None:
    wait_until(
        lambda: all(map(services.preparation.is_prepared, objects_of(services))), "the objects to be prepared"
    )


def test_what_is_there_is_built_kept_and_known_to_all_workers(services, preparation):
    assert not any(map(preparation.is_prepared, objects_of(services)))
    preparation.start()
    wait_until_prepared(services)
    assert all(knowing(services.snapper, model_hash) == 2 for model_hash in hashes_of(services))
    files = {path.name.split(".")[0] for path in services.settings.prepared_dir.iterdir()}
    assert files == set(hashes_of(services))


def test_new_symmetries_are_built_when_it_looks_again(services, preparation):
    preparation.start()
    wait_until_prepared(services)
    around = Symmetries(continuous=(ContinuousSymmetry((0.0, 0.0, 1.0)),))
    with services.database.write() as session:
        session.scalars(select(Object)).first().symmetries = symmetries_to_json(around)
    assert [preparation.is_prepared(item) for item in objects_of(services)].count(False) == 1
    preparation.look()
    wait_until_prepared(services)


def test_symmetries_of_objects_from_before_there_were_suggestions_are_suggested(services, preparation):
    with services.database.write() as session:
        session.execute(delete(SymmetrySuggestions))
        session.execute(update(Object).values(suggestions_open=False))
    block, tool = (next(item for item in objects_of(services) if item.obj_id == id_) for id_ in (BLOCK, TOOL))
    preparation.start()
    wait_until(lambda: None not in (suggested(services, block), suggested(services, tool)), "suggestions")
    found = suggested(services, block)
    assert found is not None and [entry["fold"] for entry in found] == [4, 2, 2, 2, 2]
    assert suggested(services, tool) == []
    assert [item.obj_id for item in objects_of(services) if item.suggestions_open] == [BLOCK]


def test_what_came_with_symmetries_or_was_decided_is_left_in_peace(services, preparation):
    lead = services.auth.create_user("lea", Role.ADMIN).id
    with services.database.write() as session:
        session.execute(delete(SymmetrySuggestions))
        session.execute(update(Object).values(suggestions_open=False))
        rows = session.scalars(select(Object)).all()
        block, tool = (next(row for row in rows if row.obj_id == id_) for id_ in (BLOCK, TOOL))
        decide(session, block, [], services.data.model(block), lead, None)  # it has none, somebody said
        decide(session, tool, [HALF_TURN], services.data.model(tool), lead, None)
    preparation.start()
    wait_until(lambda: suggested(services, block), "suggestions")
    wait_until_prepared(services)
    assert suggested(services, tool) is None
    assert not any(item.suggestions_open for item in objects_of(services))


def test_an_object_that_cannot_be_built_says_why_and_stops_no_other(services, preparation):
    with services.database.write() as session:
        first = session.scalars(select(Object)).first()
        first.mesh_hash, first.name = services.files.put_bytes(THREAD_MESH.encode()), "thread"
    preparation.start()
    bad, *others = objects_of(services)
    wait_until(lambda: preparation.problem(bad), "the object to be looked at, which is the last")
    assert all(map(preparation.is_prepared, others))
    assert not preparation.is_prepared(bad)
    assert preparation.problem(bad).startswith("thread cannot be snapped to: mesh is too thin")
    assert preparation.problem(others[0]) is None


def test_an_object_whose_file_is_damaged_says_so_until_it_is_mended(services, preparation):
    item = objects_of(services)[0]
    path = services.files.path(item.mesh_hash)
    whole = path.read_bytes()
    path.write_bytes(whole[:-1])
    preparation.start()
    wait_until(lambda: preparation.problem(item), "the damage to be noticed")
    assert f"the mesh of object {item.name!r} of dataset 'tools' is damaged" in preparation.problem(item)
    services.files.put_bytes(whole)
    preparation.look()
    wait_until_prepared(services)
    assert preparation.problem(item) is None


def test_a_server_that_ends_leaves_nobody_in_the_database(services, preparation, monkeypatch):
    before = threading.enumerate()
    inside, ended = threading.Event(), threading.Event()
    model_of = services.data.model

    def slow_model(item: Object) -> ObjectModel:
        inside.set()
        assert ended.wait(30)
        return model_of(item)

    monkeypatch.setattr(services.data, "model", slow_model)
    preparation.start()
    assert inside.wait(30)
    preparation.close()
    services.snapper.close()
    ended.set()
    preparation.join()
    assert "preparation" not in [thread.name for thread in threading.enumerate() if thread not in before]
