"""What runs inside a worker process, run in one."""

from collections.abc import Iterator
from dataclasses import replace
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from distributed import Client

from app.workers import jobs
from app.workers.jobs import SearchJob, SnapCancelledError
from registration_core import ObjectModel, SnapConfig, propose
from registration_core.search.viewpoint_model import packed, viewpoint_model
from tests.app.export.site import CAMERA
from tests.app.snap_jobs import DEPTH, T_CAMERA_TOOL, assert_same, done_here, new_job, new_model, view_of
from tests.app.waiting import LONGEST, wait_until

pytestmark = pytest.mark.slow  # starts workers


@pytest.fixture(scope="module")
def client(cluster: str) -> Iterator[Client]:
    with Client(cluster, set_as_default=False) as connected:
        yield connected


@pytest.fixture(scope="module")
def addresses(client: Client) -> list[str]:
    return sorted(client.scheduler_info(n_workers=-1)["workers"])


@pytest.fixture
def model() -> ObjectModel:
    return new_model()


@pytest.fixture
def content(model: ObjectModel) -> bytes:
    """What a worker builds of the model."""
    return packed(viewpoint_model(model))


def run(client: Client, address: str, function: Any, *arguments: Any) -> Any:
    return client.submit(function, *arguments, workers=[address], pure=False).result(LONGEST)


@pytest.mark.parametrize(
    "config",
    [
        SnapConfig(),
        SnapConfig.from_dict({"preset": "paper", "particle_filter": {"particles": 60, "iterations": 20}}),
    ],
    ids=["fast", "paper"],
)
def test_it_finds_what_the_library_finds(client, addresses, model, content, config):
    job = new_job(model, config=config)
    result = run(client, addresses[0], jobs.run_job, job, content)
    assert_same(result, done_here(job, model))
    assert np.linalg.norm(result.T_camera_object[:3, 3] - T_CAMERA_TOOL[:3, 3]) < 0.01
    assert result.hardware


def test_it_passes_by_what_it_is_told_of(client, addresses, model, content):
    everything = replace(view_of(DEPTH, CAMERA), explained=np.ones(DEPTH.shape, dtype=np.bool_))
    job = new_job(model, views=(everything,))
    result = run(client, addresses[0], jobs.run_job, job, content)
    assert np.allclose(result.T_camera_object, job.T_camera_object)
    assert not result.converged


@pytest.mark.parametrize("method", ["viewpoint", "particle_filter"])
def test_it_searches_as_far_as_it_is_told(client, addresses, model, content, method):
    config = SnapConfig.from_dict({"method": method, "particle_filter": {"particles": 60, "iterations": 20}})
    found = []
    for spread in (None, (0.006, 0.1), (0.06, 1.0)):
        job = new_job(model, config=config, start_spread=spread)
        result = run(client, addresses[0], jobs.run_job, job, content)
        assert_same(result, done_here(job, model))
        found.append(result.confidence)
    assert len(set(found)) == 3


def test_a_search_finds_what_the_library_finds(client, addresses, model, content):
    job = SearchJob("a search", "", model.content_hash, SnapConfig(), DEPTH, CAMERA, 3, (0, 0, 400, 300))
    found = run(client, addresses[0], jobs.run_job, job, content)
    here = propose(model, DEPTH, CAMERA, job.region, job.config, np.random.default_rng(job.seed))
    assert found.hypotheses and found.seconds > 0 and found.hardware
    for one, other in zip(found.hypotheses, here, strict=True):
        assert np.array_equal(one.T_camera_object, other.T_camera_object) and one.weight == other.weight


def test_a_search_cancelled_before_it_comes_does_not_run(client, addresses, model, content):
    job = SearchJob("left", "", model.content_hash, SnapConfig(), DEPTH, CAMERA, 3, None)
    client.run(jobs.cancel, [job.snap_id])
    with pytest.raises(SnapCancelledError):
        run(client, addresses[0], jobs.run_job, job, content)


def test_an_object_comes_once_and_is_kept_by_that_worker(client, addresses, model, content):
    here, there = addresses
    assert run(client, here, jobs.run_job, new_job(model), None) is None
    assert run(client, here, jobs.run_job, new_job(model), content) is not None
    assert run(client, here, jobs.run_job, new_job(model), None) is not None
    assert run(client, there, jobs.run_job, new_job(model), None) is None


def test_what_a_worker_builds_serves_all(client, addresses, model):
    here, there = addresses
    built = run(client, here, jobs.build, model)
    lacking = client.run(jobs.lacking, [model.content_hash])
    assert lacking == {here: set(), there: {model.content_hash}}
    client.run(jobs.keep, model.content_hash, built, workers=[there])
    for address in addresses:
        result = run(client, address, jobs.run_job, new_job(model), None)
        assert_same(result, done_here(new_job(model), model))


def test_progress_is_told_by_snap(client, addresses, model, content):
    told: list[dict[str, Any]] = []
    topic = f"progress of {model.content_hash}"
    client.subscribe_topic(topic, lambda event: told.append(event[1]))
    config = SnapConfig.from_dict(
        {"preset": "paper", "particle_filter": {"particles": 60, "iterations": 300}}
    )
    job = new_job(model, topic, config)
    run(client, addresses[0], jobs.run_job, job, content)
    wait_until(lambda: told, "progress")
    client.unsubscribe_topic(topic)
    assert {report["snap_id"] for report in told} == {job.snap_id}
    shares = [report["progress"] for report in told]
    assert shares == sorted(shares) and shares[0] == 0 < shares[-1] <= 1


def test_a_snap_cancelled_before_it_comes_does_not_run(client, addresses, model, content):
    job = new_job(model)
    client.run(jobs.cancel, [job.snap_id])
    with pytest.raises(SnapCancelledError):
        run(client, addresses[0], jobs.run_job, job, content)


def test_a_bad_job_is_refused_by_name(client, addresses, model, content):
    far = T_CAMERA_TOOL.copy()
    far[:3, 3] = [50.0, 0.0, 1.0]
    with pytest.raises(ValueError, match="T_world_object puts the object wholly outside"):
        run(client, addresses[0], jobs.run_job, new_job(model, T_camera_object=far), content)
    with pytest.raises(ValueError, match="start_spread must be"):
        run(client, addresses[0], jobs.run_job, new_job(model, start_spread=(-1.0, 0.1)), content)


def test_only_the_recent_objects_are_kept(monkeypatch, content):
    monkeypatch.setattr(jobs, "KEPT_OBJECTS", 2)
    models = [new_model() for _ in range(3)]
    for one in models[:2]:
        jobs.keep(one.content_hash, content)
    assert jobs.run_job(new_job(models[0]), None) is not None  # and so is used the latest
    jobs.keep(models[2].content_hash, content)
    assert jobs.lacking([model.content_hash for model in models]) == {models[1].content_hash}
    assert jobs.run_job(new_job(models[1]), None) is None


def test_the_module_is_a_dask_preload(client):
    kept = client.run(lambda: Path(__import__("app.workers.jobs").workers.jobs.__file__).name)
    assert set(kept.values()) == {"jobs.py"}
    assert callable(jobs.dask_setup)
