"""The ports of the server's own workers serve nobody who lacks their certificates."""

import asyncio
import urllib.error
import urllib.request
from collections.abc import Iterator

import pytest
from distributed import Client, LocalCluster
from distributed.comm import connect
from distributed.security import Security

from app.workers.pool import start_workers
from tests.app.waiting import LONGEST

pytestmark = pytest.mark.slow  # starts workers

NO_CERTIFICATES = Security(require_encryption=False)


@pytest.fixture(scope="module")
def workers() -> Iterator[LocalCluster]:
    with start_workers(1), LocalCluster(n_workers=0, host="127.0.0.1", dashboard_address="127.0.0.1:0"):
        pass  # a cluster with pages, that leaves its mark on what is set
    with start_workers(1) as started:
        yield started


def addresses(workers: LocalCluster) -> list[str]:
    """Where the scheduler, the worker, and the process that looks after it listen."""
    with Client(workers, set_as_default=False) as client:
        known = client.scheduler_info(n_workers=-1)["workers"]
    (worker,) = known.values()
    return [workers.scheduler_address, *known, worker["nanny"]]


def answers(address: str, security: Security) -> bool:
    """Whether what listens there says who it is, which it does before it runs anything."""

    async def ask() -> bool:
        try:
            comm = await connect(address, timeout=5, **security.get_connection_args("client"))
            await comm.write({"op": "identity", "reply": True})
            told = await asyncio.wait_for(comm.read(), 5)
        except (OSError, TimeoutError):
            return False
        comm.abort()
        return "id" in told

    return asyncio.run(ask())


def test_who_has_the_certificates_is_answered(workers: LocalCluster) -> None:
    assert [answers(address, workers.security) for address in addresses(workers)] == [True] * 3


@pytest.mark.parametrize("index", range(3))
def test_a_stranger_is_not(workers: LocalCluster, index: int) -> None:
    address = addresses(workers)[index]
    assert not answers(address.replace("tls:", "tcp:"), NO_CERTIFICATES)
    assert not answers(address.replace("tcp:", "tls:"), Security.temporary())


def test_the_pages_of_the_scheduler_and_the_workers_tell_nothing(workers: LocalCluster) -> None:
    with Client(workers, set_as_default=False) as client:
        info = client.scheduler_info(n_workers=-1)
    ports = [
        info["services"]["dashboard"],
        *(one["services"]["dashboard"] for one in info["workers"].values()),
    ]
    assert len(ports) == 2
    paths = ("", "info/main/workers.html", "json/counts.json", "metrics", "status", "health")
    told = {path: [status_of(port, path) for port in ports] for path in paths}
    assert told == {path: [404, 404] for path in paths}


def status_of(port: int, path: str) -> int:
    """What the server of pages on a port answers."""
    try:
        with urllib.request.urlopen(f"http://127.0.0.1:{port}/{path}", timeout=LONGEST) as answer:
            return int(answer.status)
    except urllib.error.HTTPError as error:
        return error.code
