"""Results are kept, the oldest go, errors are not kept, and several who ask at once share one computation."""

import threading
from concurrent.futures import ThreadPoolExecutor

import pytest

from app.recent import Recent
from tests.app.waiting import LONGEST


def test_the_last_results_are_kept() -> None:
    asked: list[int] = []

    def square(number: int) -> int:
        asked.append(number)
        return number * number

    squares = Recent(2, square)
    assert [squares(number) for number in (1, 2, 1, 3, 1, 2)] == [1, 4, 1, 9, 1, 4]
    assert asked == [1, 2, 3, 2]


def test_what_is_raised_is_not_kept() -> None:
    asked: list[int] = []

    def fails_once(number: int) -> int:
        asked.append(number)
        if len(asked) == 1:
            raise ValueError("not yet")
        return number

    kept = Recent(2, fails_once)
    with pytest.raises(ValueError, match="not yet"):
        kept(7)
    assert [kept(7), kept(7)] == [7, 7] and asked == [7, 7]


def test_who_asks_meanwhile_waits_for_the_one_computation() -> None:
    began, may_end, asked = threading.Event(), threading.Event(), []

    def slow(number: int) -> int:
        asked.append(number)
        began.set()
        assert may_end.wait(LONGEST)
        return number

    kept = Recent(2, slow)
    with ThreadPoolExecutor(4) as pool:
        first = pool.submit(kept, 5)
        assert began.wait(LONGEST)
        others = [pool.submit(kept, 5) for _ in range(3)]
        may_end.set()
        assert [call.result(LONGEST) for call in (first, *others)] == [5] * 4
    assert asked == [5]
