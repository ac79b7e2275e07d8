"""Snaps on workers that several servers share, and what becomes of them when one of the servers closes."""

import os
import signal
from concurrent.futures import CancelledError
from contextlib import closing
from threading import Event, Thread, current_thread

import dask
import pytest
from distributed import Client, Future, Worker

from app.workers.pool import UNREACHABLE, SnapError, Snapper
from app.workers.prepared import PreparedObjects
from registration_core import Estimate, ObjectModel, SnapConfig
from tests.app.rest import SLOW_SNAP
from tests.app.snap_jobs import knowing, new_job, new_model, pids, request, result_of, store_in
from tests.app.waiting import LONGEST, wait_until

pytestmark = pytest.mark.slow  # starts workers

SLOW = SnapConfig.from_dict(SLOW_SNAP)


@pytest.fixture(scope="module")
def model() -> ObjectModel:
    return new_model()


def jobs_at(dask_worker: Worker) -> int:
    """How many jobs a worker is at."""
    return len(dask_worker.active_threads)


def wait_until_idle(cluster: str) -> None:
    with Client(cluster, set_as_default=False) as onlooker:
        wait_until(lambda: sum(onlooker.run(jobs_at).values()) == 0, "the workers to stop", seconds=5.0)


def test_workers_of_a_cluster_get_what_one_of_them_built(cluster, tmp_path):
    with closing(Snapper(cluster, 1, store_in(tmp_path))) as elsewhere:
        model, other = new_model(), new_model()
        outcome, _ = request(elsewhere, new_job(model, elsewhere.topic), model)
        assert isinstance(result_of(outcome), Estimate)
        assert knowing(elsewhere, model.content_hash) in (1, 2)
        elsewhere.hand_over([model.content_hash, other.content_hash])
        assert knowing(elsewhere, model.content_hash) == 2 and knowing(elsewhere, other.content_hash) == 0
        elsewhere.prepare(other)
        wait_until(lambda: knowing(elsewhere, other.content_hash) == 2, "the workers to be prepared")


def test_workers_of_a_cluster_do_not_go_on_for_who_has_closed(cluster, model, tmp_path):
    with closing(Snapper(cluster, 1, store_in(tmp_path))) as elsewhere:
        outcome, _ = request(elsewhere, new_job(model, elsewhere.topic, SLOW), model)
        assert outcome.moved.wait(LONGEST)
    wait_until_idle(cluster)


def test_who_asks_while_the_server_closes_leaves_no_worker_at_it(cluster, model, tmp_path, monkeypatch):
    elsewhere = Snapper(cluster, 1, store_in(tmp_path))
    close_objects, asked = PreparedObjects.close, []

    def late(objects: PreparedObjects) -> None:
        outcome, cancel = request(elsewhere, new_job(model, elsewhere.topic, SLOW), model)
        assert outcome.moved.wait(LONGEST)
        asked.append(cancel)
        close_objects(objects)

    monkeypatch.setattr(PreparedObjects, "close", late)
    elsewhere.close()
    asked[0]()  # too late to matter
    wait_until_idle(cluster)


def test_a_worker_that_is_stuck_does_not_hold_the_closing_up(cluster, model, tmp_path, monkeypatch):
    monkeypatch.setattr("app.workers.pool.PATIENCE", 0.5)
    elsewhere = Snapper(cluster, 1, store_in(tmp_path))
    jobs = [request(elsewhere, new_job(model, elsewhere.topic, SLOW), model) for _ in range(2)]
    assert all(outcome.moved.wait(LONGEST) for outcome, _ in jobs)
    stuck = next(iter(pids(elsewhere)))
    os.kill(stuck, signal.SIGSTOP)
    try:
        elsewhere.hand_over([new_model().content_hash])  # no error
        jobs[0][1]()
        closing_it = Thread(target=elsewhere.close)
        closing_it.start()
        closing_it.join(15.0)
        assert not closing_it.is_alive()
    finally:
        os.kill(stuck, signal.SIGCONT)
    wait_until_idle(cluster)


def test_only_own_threads_wait_for_what_the_scheduler_brings(cluster, tmp_path, monkeypatch):
    """Dask's one is every client's, and who waits there while his own closes may wait for ever."""
    waited_in: list[str] = []
    result = Future.result

    def noted(future: Future, *args: object) -> object:
        waited_in.append(current_thread().name.rstrip("_0123456789"))
        return result(future, *args)

    monkeypatch.setattr(Future, "result", noted)
    with closing(Snapper(cluster, 1, store_in(tmp_path))) as elsewhere:
        model = new_model()
        outcome, _ = request(elsewhere, new_job(model, elsewhere.topic), model)
        assert isinstance(result_of(outcome), Estimate)
    assert waited_in == ["results"] * 3  # the object was not known, is built, and the snap is done


def test_what_ends_after_closing_is_not_waited_for(cluster, tmp_path):
    held, free, told = Event(), Event(), Event()

    def hold(_: object) -> None:
        held.set()
        free.wait(LONGEST)

    with Client(cluster, set_as_default=False) as other:
        other.submit(int, pure=False).add_done_callback(hold)  # in the thread that all clients share
        assert held.wait(LONGEST)
        with closing(Snapper(cluster, 1, store_in(tmp_path))) as closed:
            promise = closed.built(new_model())
        with pytest.raises(CancelledError):
            promise.result(LONGEST)
        free.set()
        other.submit(int, pure=False).add_done_callback(lambda _: told.set())
        assert told.wait(LONGEST)


def test_without_a_scheduler_a_snap_says_so(model, tmp_path):
    with dask.config.set({"distributed.comm.timeouts.connect": "0.5s"}):
        alone = Snapper("tcp://127.0.0.1:1", 1, store_in(tmp_path))
        with pytest.raises(OSError, match="Timed out"):
            alone.wait_until_ready()
    assert alone.worker_count() == 0
    outcome, cancel = request(alone, new_job(model), model)
    end = result_of(outcome)
    assert isinstance(end, SnapError) and str(end) == UNREACHABLE
    cancel()
    alone.close()
