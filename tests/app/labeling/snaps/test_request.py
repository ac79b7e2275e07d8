"""One order at a time, whose end is written down before it is told, and that brings nothing once let go."""

from collections.abc import Callable
from dataclasses import dataclass, field

import pytest

from app.labeling.snaps.request import Request
from app.labeling.snaps.snap_exchange import FramesReport, SnapStatus
from app.storage.roles import Actor
from app.workers.pool import SnapError

FRAMES = FramesReport(2, 1, 1)
Outcome = int | SnapError


@dataclass
class Workers:
    """Take orders, and do what a test says."""

    progress: list[Callable[[float], None]] = field(default_factory=list)
    end: list[Callable[[Outcome], None]] = field(default_factory=list)
    cancelled: list[str] = field(default_factory=list)
    at_once: Outcome | None = None

    def submit(
        self, order: str, on_progress: Callable[[float], None], on_end: Callable[[Outcome], None]
    ) -> Callable[[], None]:
        self.progress.append(on_progress)
        self.end.append(on_end)
        if self.at_once is not None:
            on_end(self.at_once)
        return lambda: self.cancelled.append(order)


@pytest.fixture
def workers() -> Workers:
    return Workers()


@pytest.fixture
def request_(workers: Workers) -> Request[str, int]:
    return Request(workers.submit, "number")


@pytest.fixture
def settled() -> list[Outcome]:
    return []


@pytest.fixture
def start(request_: Request[str, int], settled: list[Outcome]) -> Callable[[str], None]:
    def begin(order: str) -> None:
        def settle(outcome: Outcome) -> FramesReport | None:
            assert request_.status is not None and request_.status.is_live, "written down before it is told"
            settled.append(outcome)
            return None if isinstance(outcome, SnapError) else FRAMES

        request_.start(order, SnapStatus(order, Actor.HUMAN), settle)

    return begin


def test_a_result_ends_it(request_, workers, start, settled):
    start("a")
    assert request_.is_under_way and request_.status.state == "queued"
    workers.progress[0](0.4)
    workers.progress[0](0.2)
    assert (request_.status.state, request_.status.progress) == ("running", 0.4)
    workers.end[0](7)
    status = request_.status
    assert (status.state, status.progress, status.frames) == ("done", 1.0, FRAMES)
    assert settled == [7] and not request_.is_under_way
    request_.drop()
    assert workers.cancelled == [], "what has ended is not cancelled"


def test_a_failure_is_told_in_its_words(request_, workers, start, settled):
    start("a")
    workers.end[0](SnapError("The worker died."))
    assert (request_.status.state, request_.status.message) == ("failed", "The worker died.")
    assert len(settled) == 1


def test_an_older_one_brings_nothing(request_, workers, start, settled):
    start("a")
    start("b")
    workers.progress[0](0.9)
    workers.end[0](1)
    assert workers.cancelled == ["a"] and settled == []
    assert (request_.status.id, request_.status.state) == ("b", "queued")


def test_one_that_ends_while_it_is_handed_over_is_not_cancelled_later(request_, workers, start):
    workers.at_once = SnapError("Nothing was measured.")
    start("a")
    assert request_.status.state == "failed" and not request_.is_under_way
    request_.drop()
    assert workers.cancelled == []


def test_letting_go_is_written_down_first(request_, workers, start, settled):
    start("a")
    request_.abandon(lambda order: settled.append((order, list(workers.cancelled))))
    assert settled == [("a", [])] and workers.cancelled == ["a"]
    assert request_.status.state == "cancelled"
    request_.abandon(lambda order: pytest.fail("nothing is under way"))


def test_where_that_fails_it_goes_on(request_, workers, start, settled):
    start("a")
    with pytest.raises(ZeroDivisionError):
        request_.abandon(lambda order: 1 // 0)
    workers.end[0](3)
    assert settled == [3] and workers.cancelled == []


def test_an_end_that_cannot_be_written_down_is_told_and_raised(request_, workers):
    def settle(outcome: Outcome) -> None:
        raise OSError("no space left")

    request_.start("a", SnapStatus("a", Actor.HUMAN), settle)
    with pytest.raises(OSError, match="no space"):
        workers.end[0](1)
    assert request_.status.state == "failed"
    assert request_.status.message.startswith("The number could not be saved: ")
