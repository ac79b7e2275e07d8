"""Objects are built once for all who ask, and what was built is kept."""

import logging
from collections.abc import Callable
from concurrent.futures import CancelledError, Future
from pathlib import Path

import pytest

from app.storage.files import PreparedStore
from app.workers.prepared import PreparedObjects
from registration_core import ObjectModel
from registration_core.algorithm import VIEWPOINT_ALGORITHM
from registration_core.search.viewpoint_model import packed, viewpoint_model
from tests.app.snap_jobs import new_model


class Builders:
    """Workers that are told when to be done."""

    def __init__(self) -> None:
        self.asked: list[tuple[ObjectModel, int]] = []
        self.futures: list[Future[bytes]] = []

    def submit(self, model: ObjectModel, priority: int) -> Future[bytes]:
        self.asked.append((model, priority))
        self.futures.append(Future())
        return self.futures[-1]


def at_once(function: Callable[..., None], *args: object) -> None:
    function(*args)


@pytest.fixture
def builders() -> Builders:
    return Builders()


@pytest.fixture
def objects(tmp_path: Path, builders: Builders) -> PreparedObjects:
    return PreparedObjects(
        PreparedStore(tmp_path / "prepared", VIEWPOINT_ALGORITHM), builders.submit, at_once
    )


@pytest.fixture(scope="module")
def model() -> ObjectModel:
    return new_model()


@pytest.fixture(scope="module")
def content(model: ObjectModel) -> bytes:
    return packed(viewpoint_model(model))


def test_whoever_asks_while_it_is_built_waits_for_the_same(objects, builders, model, content):
    first, second = objects.get(model, -1), objects.get(model, 0)
    assert first is second and not first.done()
    assert builders.asked == [(model, -1)]
    builders.futures[0].set_result(content)
    assert first.result() == content
    assert objects.get(model, 0).result() == content and len(builders.asked) == 1


def test_what_was_built_outlives_the_program(objects, builders, model, content, tmp_path):
    objects.get(model, 0)
    builders.futures[0].set_result(content)
    again = PreparedObjects(
        PreparedStore(tmp_path / "prepared", VIEWPOINT_ALGORITHM), builders.submit, at_once
    )
    assert again.read(model.content_hash) == content == again.get(model, 0).result()
    assert len(builders.asked) == 1


def test_what_is_damaged_is_built_anew(objects, builders, model, content, tmp_path, caplog):
    objects.get(model, 0)
    builders.futures[0].set_result(content)
    (file,) = (tmp_path / "prepared").iterdir()
    file.write_bytes(content[:1000])
    with caplog.at_level(logging.WARNING):
        promise = objects.get(model, 0)
    assert "is built anew: the viewpoint model cannot be read" in caplog.text
    builders.futures[1].set_result(content)
    assert promise.result() == content == file.read_bytes()


def test_what_cannot_be_kept_is_handed_on_all_the_same(objects, builders, model, content, tmp_path, caplog):
    (tmp_path / "prepared").write_text("a file where the folder should be")
    with caplog.at_level(logging.WARNING):
        promise = objects.get(model, 0)
        builders.futures[0].set_result(content)
    assert promise.result() == content
    assert "what was built of an object could not be kept" in caplog.text


def test_an_object_that_cannot_be_built_says_why_and_may_be_asked_for_again(objects, builders, model):
    promise = objects.get(model, 0)
    builders.futures[0].set_exception(ValueError("mesh is too thin"))
    with pytest.raises(ValueError, match="mesh is too thin"):
        promise.result()
    objects.get(model, 0)
    assert len(builders.asked) == 2


def test_workers_that_cannot_be_reached_fail_the_promise(tmp_path, model):
    def refuse(model: ObjectModel, priority: int) -> Future[bytes]:
        raise OSError("no scheduler")

    objects = PreparedObjects(PreparedStore(tmp_path, VIEWPOINT_ALGORITHM), refuse, at_once)
    with pytest.raises(OSError, match="no scheduler"):
        objects.get(model, 0).result()


def test_nobody_waits_for_what_is_closed(objects, builders, model, content):
    promise = objects.get(model, 0)
    objects.close()
    with pytest.raises(CancelledError):
        promise.result()
    builders.futures[0].set_result(content)  # which comes too late, and is kept all the same
    assert objects.read(model.content_hash) == content
