"""Guessing is slow by name and address, and by address alone; nobody else is slowed down."""

import sqlite3
from collections.abc import Iterator
from contextlib import closing
from pathlib import Path
from types import SimpleNamespace

import pytest

from app.access.throttle import (
    FREE_ATTEMPTS,
    FREE_ATTEMPTS_OF_AN_ADDRESS,
    LONGEST_WAIT_SECONDS,
    SECONDS_UNTIL_FORGOTTEN,
    Throttle,
)

HERE = "192.0.2.1"


@pytest.fixture
def clock(monkeypatch: pytest.MonkeyPatch) -> SimpleNamespace:
    now = SimpleNamespace(seconds=1e9)
    monkeypatch.setattr("app.access.throttle.time", SimpleNamespace(time=lambda: now.seconds))
    return now


@pytest.fixture
def throttle(clock: SimpleNamespace) -> Iterator[Throttle]:
    opened = Throttle()
    yield opened
    opened.close()


def test_waiting_doubles_up_to_a_limit(throttle, clock):
    waits = []
    for _ in range(FREE_ATTEMPTS + 20):
        wait = throttle.attempt("ann", HERE)
        if wait:
            waits.append(wait)
            clock.seconds += wait
            assert throttle.attempt("ann", HERE) == 0.0
    assert waits[:4] == pytest.approx([1.0, 2.0, 4.0, 8.0])
    assert max(waits) == pytest.approx(LONGEST_WAIT_SECONDS)


def test_an_address_that_tries_all_names_waits_as_well(throttle):
    waits = [throttle.attempt(f"name {i}", HERE) for i in range(FREE_ATTEMPTS_OF_AN_ADDRESS + 1)]
    assert waits[:-1] == [0.0] * FREE_ATTEMPTS_OF_AN_ADDRESS and waits[-1] > 0
    assert throttle.attempt("name 0", "192.0.2.2") == 0.0


def test_who_signs_in_uses_up_nothing(throttle):
    for _ in range(2 * FREE_ATTEMPTS_OF_AN_ADDRESS):
        assert throttle.attempt("ann", HERE) == 0.0
        throttle.succeeded("ann", HERE)


def test_an_own_account_does_not_buy_guesses_of_other_names(throttle):
    for i in range(FREE_ATTEMPTS_OF_AN_ADDRESS):
        assert throttle.attempt(f"name {i}", HERE) == 0.0
        if i < FREE_ATTEMPTS_OF_AN_ADDRESS - 1:
            assert throttle.attempt("mallory", HERE) == 0.0
            throttle.succeeded("mallory", HERE)
    assert throttle.attempt("another", HERE) > 0


@pytest.mark.parametrize(
    ("one", "other", "are_one"),
    [
        ("2001:db8::1", "2001:db8::ffff:2", True),
        ("2001:db8::1", "2001:db8:0:1::1", False),
        ("::ffff:192.0.2.1", "192.0.2.1", True),
        ("192.0.2.1", "192.0.2.2", False),
    ],
)
def test_a_network_of_ipv6_is_one_caller(throttle, one, other, are_one):
    for _ in range(FREE_ATTEMPTS):
        throttle.attempt("ann", one)
    assert (throttle.attempt("ann", other) > 0) is are_one


def test_what_was_long_ago_is_forgotten_and_cleared_away(clock, tmp_path: Path):
    throttle = Throttle(tmp_path / "throttle.sqlite")
    for i in range(FREE_ATTEMPTS):
        throttle.attempt("ann", HERE)
        throttle.attempt(f"name {i}", f"198.51.100.{i}")
    clock.seconds += SECONDS_UNTIL_FORGOTTEN + 1
    assert throttle.attempt("ann", HERE) == 0.0
    throttle.close()
    with closing(sqlite3.connect(tmp_path / "throttle.sqlite")) as counts:
        assert counts.execute("SELECT count(*) FROM attempts").fetchone() == (2,)


def test_no_name_is_kept_as_it_was_typed(clock, tmp_path: Path):
    throttle = Throttle(tmp_path / "throttle.sqlite")
    throttle.attempt("a password in the wrong field", HERE)
    throttle.close()
    assert b"a password" not in b"".join(file.read_bytes() for file in tmp_path.iterdir())


def test_a_clock_that_was_set_back_makes_nobody_wait_longer(throttle, clock):
    for _ in range(FREE_ATTEMPTS):
        throttle.attempt("ann", HERE)
    clock.seconds -= 3600
    assert throttle.attempt("ann", HERE) <= 1.0
    clock.seconds += 1.0
    assert throttle.attempt("ann", HERE) == 0.0
