"""Snaps in worker processes that the snapper starts itself."""

import os
import signal
from collections.abc import Callable, Iterator
from contextlib import closing
from typing import Any

import numpy as np
import psutil
import pytest
from distributed import Nanny, Scheduler, Worker

from app.workers.pool import DIED, SnapError, Snapper
from registration_core import Estimate, ObjectModel, SnapConfig, region_of_interest
from tests.app.export.site import CAMERA
from tests.app.rest import SLOW_SNAP
from tests.app.snap_jobs import (
    DEPTH,
    START,
    T_CAMERA_TOOL,
    Outcome,
    assert_same,
    done_here,
    knowing,
    new_job,
    new_model,
    pids,
    request,
    result_of,
    store_in,
    view_of,
)
from tests.app.waiting import LONGEST, wait_until

pytestmark = pytest.mark.slow  # starts workers

SLOW = SnapConfig.from_dict(SLOW_SNAP)


@pytest.fixture(scope="module")
def snapper(tmp_path_factory: pytest.TempPathFactory) -> Iterator[Snapper]:
    started = Snapper("", 2, store_in(tmp_path_factory.mktemp("prepared")))
    started.wait_until_ready()
    yield started
    workers = pids(started)
    started.close()
    assert not any(map(psutil.pid_exists, workers))


@pytest.fixture(scope="module")
def model(snapper: Snapper) -> ObjectModel:
    prepared = new_model()
    snapper.prepare(prepared)
    wait_until(lambda: knowing(snapper, prepared.content_hash) == 2, "the workers to be prepared")
    return prepared


@pytest.fixture(autouse=True)
def idle_workers(snapper: Snapper, monkeypatch: pytest.MonkeyPatch) -> Iterator[None]:
    """Each test finds the workers idle and leaves them so."""
    wait_until(lambda: busy(snapper) == 0, "the workers to be idle")
    cancels: list[Callable[[], None]] = []
    real = snapper.request

    def requested(*args: Any, **named: Any) -> Callable[[], None]:
        cancels.append(real(*args, **named))
        return cancels[-1]

    monkeypatch.setattr(snapper, "request", requested)
    yield
    for cancel in cancels:
        cancel()


def executing(snapper: Snapper) -> dict[str, int]:
    """How many tasks each worker is at."""
    return snapper.client().run(lambda dask_worker: len(dask_worker.state.executing))


def busy(snapper: Snapper) -> int:
    """How many workers are at something."""
    return sum(executing(snapper).values())


def addresses(snapper: Snapper) -> list[str]:
    """Of the workers that are there now."""
    return list(snapper.client().scheduler_info(n_workers=-1)["workers"])


def forbid_building(snapper: Snapper) -> None:
    """Let every worker fail that builds what it needs of an object."""

    def forbid() -> None:
        from app.workers import jobs

        jobs.build_viewpoint_model = None  # type: ignore[attr-defined,assignment]

    snapper.client().run(forbid)


def test_it_finds_what_the_library_finds_on_the_whole_image(snapper, model):
    margin = 200
    image = np.pad(DEPTH, margin)
    camera = CAMERA.cropped(-margin, -margin, image.shape[1], image.shape[0])
    left, top, width, height = region_of_interest(model, camera, START, SnapConfig())
    assert width * height < 0.5 * image.size
    crop = np.ascontiguousarray(image[top : top + height, left : left + width])
    job = new_job(model, snapper.topic, views=(view_of(crop, camera.cropped(left, top, width, height)),))
    outcome, _ = request(snapper, job, model)
    result = result_of(outcome)
    assert isinstance(result, Estimate)
    assert_same(result, done_here(new_job(model, views=(view_of(image, camera),)), model))
    assert np.linalg.norm(result.T_camera_object[:3, 3] - T_CAMERA_TOOL[:3, 3]) < 0.005


def test_progress_arrives_while_it_runs(snapper, model):
    outcome, cancel = request(snapper, new_job(model, snapper.topic, SLOW), model)
    wait_until(lambda: len(outcome.shares) >= 5, "progress")
    assert not outcome.ended.is_set()
    cancel()
    assert outcome.shares == sorted(outcome.shares) and 0 == outcome.shares[0] < outcome.shares[-1] <= 1


def test_a_cancelled_snap_brings_nothing_and_its_worker_is_free_at_once(snapper, model):
    outcome, cancel = request(snapper, new_job(model, snapper.topic, SLOW), model)
    assert outcome.moved.wait(LONGEST)
    assert busy(snapper) == 1
    cancel()
    wait_until(lambda: busy(snapper) == 0, "the worker to stop")
    count = len(outcome.shares)
    other, _ = request(snapper, new_job(model, snapper.topic), model)
    assert isinstance(result_of(other), Estimate)
    assert len(outcome.shares) == count and outcome.ends == []
    cancel()  # once more does no harm


def test_cancelling_one_of_many_lets_the_next_begin(snapper, model):
    running = [request(snapper, new_job(model, snapper.topic, SLOW), model) for _ in range(2)]
    assert all(outcome.moved.wait(LONGEST) for outcome, _ in running)
    waiting, cancel_waiting = request(snapper, new_job(model, snapper.topic, SLOW), model)
    last, _ = request(snapper, new_job(model, snapper.topic), model)
    cancel_waiting()
    running[0][1]()
    assert isinstance(result_of(last), Estimate)
    assert waiting.shares == [] and not running[1][0].ended.is_set()
    running[1][1]()
    wait_until(lambda: busy(snapper) == 0, "the workers to stop")


def test_of_those_that_wait_for_a_worker_the_urgent_goes_first(tmp_path, model):
    with closing(Snapper("", 1, store_in(tmp_path))) as alone:
        alone.wait_until_ready()
        check_that_the_urgent_goes_first(alone, model)


def check_that_the_urgent_goes_first(snapper: Snapper, model: ObjectModel) -> None:
    running, cancel = request(snapper, new_job(model, snapper.topic, SLOW), model)
    assert running.moved.wait(LONGEST)
    order: list[str] = []
    told = Outcome()

    def note(name: str) -> Callable[[Estimate | SnapError], None]:
        def on_end(outcome: Estimate | SnapError) -> None:
            order.append(name)
            if len(order) == 2:
                told.on_end(outcome)

        return on_end

    for name, priority in (("live", -1), ("asked for", 0)):
        before = set(snapper.client().futures)
        snapper.request(new_job(model), model, told.on_progress, note(name), priority)
        wait_until(lambda: set(snapper.client().futures) - before, "the snap to be handed over")  # noqa: B023 - called here
    cancel()
    assert isinstance(result_of(told), Estimate)
    assert order == ["asked for", "live"] and told.shares == []


def test_it_is_known_how_a_snap_stands(snapper, model):
    running = [new_job(model, snapper.topic, SLOW) for _ in range(2)]
    outcomes = [request(snapper, job, model)[0] for job in running]
    assert all(outcome.moved.wait(LONGEST) for outcome in outcomes)
    waiting = [new_job(model, snapper.topic) for _ in range(2)]
    cancels = [request(snapper, job, model)[1] for job in waiting]
    live = new_job(model)
    snapper.request(live, model, print, print, priority=-1)
    stands = [snapper.standing(job.snap_id) for job in waiting]
    assert [(standing.workers, standing.ahead) for standing in stands] == [(2, 0), (2, 1)]
    assert all(standing.seconds >= 0 for standing in stands)
    assert snapper.standing(live.snap_id).ahead == 2
    assert snapper.waiting_count() == 2
    cancels[0]()
    assert snapper.standing(waiting[1].snap_id).ahead == 0
    assert snapper.standing(waiting[0].snap_id) is None
    assert all(snapper.standing(job.snap_id).ahead == 0 for job in running)


def test_a_snap_that_waits_for_its_object_says_so(snapper, model):
    held = [request(snapper, new_job(model, snapper.topic, SLOW), model) for _ in range(2)]
    assert all(outcome.moved.wait(LONGEST) for outcome, _ in held)
    unknown = new_model()
    built = snapper.built(unknown)  # which waits for a worker
    outcome, _ = request(snapper, job := new_job(unknown, snapper.topic), unknown)
    assert not snapper.standing(job.snap_id).preparing
    # as if it came back from a worker, of which none is free to let it come back
    snapper._call(job.snap_id, snapper._submit_with_object, job.snap_id)  # noqa: SLF001
    wait_until(lambda: snapper.standing(job.snap_id).preparing, "the snap to wait for its object")
    assert snapper.built(unknown) is built
    for _, cancel in held:
        cancel()
    assert isinstance(result_of(outcome), Estimate) and built.done()


def test_workers_outlast_a_sleep_of_the_machine(snapper):
    async def wake_up(dask_scheduler: Scheduler) -> None:
        for state in dask_scheduler.workers.values():
            state.last_seen -= 3600.0
        if (watch := dask_scheduler.periodic_callbacks.get("worker-ttl")) is not None:
            await watch.callback()

    before = pids(snapper)
    snapper.client().run_on_scheduler(wake_up)
    assert pids(snapper) == before and len(before) == 2


def test_an_object_that_no_worker_knows_is_sent_along(snapper):
    unknown = new_model()
    assert knowing(snapper, unknown.content_hash) == 0
    outcome, _ = request(snapper, new_job(unknown, snapper.topic), unknown)
    assert isinstance(result_of(outcome), Estimate)
    assert knowing(snapper, unknown.content_hash) in (1, 2)  # the one that built it, and the one that snapped


def test_a_prepared_object_is_with_every_worker(snapper):
    prepared = new_model()
    snapper.prepare(prepared)
    wait_until(lambda: knowing(snapper, prepared.content_hash) == 2, "the workers to be prepared")


def test_a_snap_that_cannot_work_says_why(snapper, model):
    far = T_CAMERA_TOOL.copy()
    far[:3, 3] = [50.0, 0.0, 1.0]
    outcome, _ = request(snapper, new_job(model, snapper.topic, T_camera_object=far), model)
    end = result_of(outcome)
    assert isinstance(end, SnapError)
    assert str(end).startswith("The snap cannot work on this: T_world_object puts the object wholly outside")


def test_what_nobody_foresaw_fails_the_snap_too(snapper, model):
    job = new_job(model, snapper.topic, config=None, views="no views")
    outcome, _ = request(snapper, job, model)
    end = result_of(outcome)
    assert isinstance(end, SnapError) and "the server's log says why" in str(end)


def test_a_worker_that_dies_in_mid_snap_fails_that_snap_only(snapper, model):
    assert snapper.worker_count() == 2
    doomed, _ = request(snapper, new_job(model, snapper.topic, SnapConfig.paper()), model)
    assert doomed.moved.wait(LONGEST)
    client = snapper.client()
    (address,) = [worker for worker, count in executing(snapper).items() if count]
    os.kill(client.run(os.getpid, workers=[address])[address], signal.SIGKILL)
    end = result_of(doomed)
    assert isinstance(end, SnapError) and str(end) == DIED
    for _ in range(3):
        outcome, _ = request(snapper, new_job(model, snapper.topic), model)
        assert isinstance(result_of(outcome), Estimate)
    wait_until(lambda: snapper.worker_count() == 2, "another worker in its place")


def test_what_was_built_is_never_built_again(tmp_path):
    model = new_model()
    with closing(Snapper("", 1, store_in(tmp_path))) as first:
        first.built(model).result(LONGEST)
        assert knowing(first, model.content_hash) == 1
    with closing(Snapper("", 1, store_in(tmp_path))) as second:
        second.wait_until_ready()
        forbid_building(second)
        outcome, _ = request(second, new_job(model, second.topic), model)
        result = result_of(outcome)
        assert isinstance(result, Estimate)
        assert_same(result, done_here(new_job(model), model))
        other = new_model()
        outcome, _ = request(second, new_job(other, second.topic), other)
        assert isinstance(result_of(outcome), SnapError)  # so building was forbidden indeed


def test_idle_processes_rest(snapper):
    def pauses(dask_worker: Worker | Nanny) -> dict[str, float]:
        """Milliseconds between the calls of whatever recurs."""
        return {name: call.callback_time for name, call in dask_worker.periodic_callbacks.items()}

    client = snapper.client()
    workers, nannies = client.run(pauses), client.run(pauses, nanny=True)
    recurring = [*workers.values(), *nannies.values()]
    assert len(recurring) == 4
    for found in recurring:
        assert "profile" not in found
        assert found["tick"] >= 1000.0 and found["monitor"] >= 1000.0
