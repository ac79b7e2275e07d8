"""Bookkeeping finds what is lost and what is doubled."""

import numpy as np
import pytest

from benchmarks.bookkeeping import Balance, compare_drags, compare_snaps
from registration_core.geometry import pose

A, B, C = (pose.exp([x, 0.0, 0.5, 0.0, 0.1, 0.0]) for x in (0.1, 0.2, 0.3))


@pytest.mark.parametrize(
    ("logged", "balance"),
    [
        ([A, B, C], Balance()),
        ([A, C], Balance(lost=1)),
        ([], Balance(lost=3)),
        ([A, B, B, C], Balance(surplus=1)),
        ([A, B, C, C], Balance(surplus=1)),
        ([A, B + 1e-6, C], Balance(lost=1, surplus=1)),
    ],
)
def test_drags(logged: list[np.ndarray], balance: Balance) -> None:
    assert compare_drags([A, B, C], logged) == balance


def test_snaps_that_are_there_once() -> None:
    assert compare_snaps({"a": A, "b": None}, ["a", "b"], {"a": A, "b": B}) == Balance()


@pytest.mark.parametrize(
    ("results", "estimates", "balance"),
    [
        (["a"], {"a": A, "b": B}, Balance(lost=1)),
        (["a", "b"], {"a": A}, Balance(lost=1)),
        (["a", "b"], {"a": C, "b": B}, Balance(lost=1)),
        (["a", "b", "b"], {"a": A, "b": B}, Balance(surplus=1)),
        (["a", "b", "c"], {"a": A, "b": B, "c": C}, Balance(surplus=2)),
    ],
)
def test_snaps_that_are_not(results: list[str], estimates: dict[str, np.ndarray], balance: Balance) -> None:
    assert compare_snaps({"a": A, "b": B}, results, estimates) == balance


def test_balances_add_up() -> None:
    assert Balance(1, 2) + Balance(3, 4) == Balance(4, 6)
