"""Laws of `benchmarks.figures`."""

import math

import pytest
from rich.console import Console

from benchmarks.figures import Figure, Target, percentile, spread, table


@pytest.mark.parametrize(
    ("target", "value", "missed"),
    [
        (Target(0.3), 0.3, False),
        (Target(0.3), 0.31, True),
        (Target(500, at_least=True), 500, False),
        (Target(500, at_least=True), 499, True),
        (Target(0.3), math.nan, True),
        (None, 1e9, False),
    ],
)
def test_a_target_is_reached_from_its_own_side(target: Target | None, value: float, missed: bool) -> None:
    assert Figure("x", value, "s", target).is_missed is missed


def test_percentiles_of_known_values() -> None:
    assert percentile([float(n) for n in range(101)], 95) == 95.0
    assert math.isnan(percentile([], 50))


def test_only_the_95th_percentile_is_judged() -> None:
    median, p95 = spread("x", [0.1] * 99 + [9.0], Target(0.2))
    assert (median.value, median.target) == (0.1, None)
    assert not p95.is_missed


def test_the_table_says_what_was_reached() -> None:
    console = Console(width=100)
    with console.capture() as shown:
        figures = [Figure("fast", 0.1, "s", Target(1.0)), Figure("big", 900, "MB", Target(700))]
        console.print(table("All", figures))
    fast, big = (next(line for line in shown.get().splitlines() if word in line) for word in ("fast", "big"))
    assert "0.100 s" in fast and "≤ 1.000 s" in fast and "yes" in fast
    assert "900 MB" in big and "≤ 700 MB" in big and "no" in big
