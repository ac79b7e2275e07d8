"""Environment variables choose a part of the run."""

import pytest

from benchmarks.registration.choice import Choice

SETS, METHODS = (
    ("at least half visible", "moro", "apc"),
    ("default", "default, spread told", "small_gicp GICP"),
)


def test_all_is_run_unless_something_is_chosen() -> None:
    assert Choice.read(SETS, SETS, METHODS, {}) == Choice(SETS, METHODS, None, False)
    assert Choice.read(SETS, SETS[:1], METHODS, {}).sets == SETS[:1]


def test_names_and_parts_of_names_choose() -> None:
    environment = {
        "BENCHMARK_SETS": "apc, half",
        "BENCHMARK_METHODS": "gicp,default",
        "BENCHMARK_STARTS": "2",
    }
    chosen = Choice.read(SETS, SETS[:2], METHODS, environment)
    assert chosen.sets == ("at least half visible", "apc")
    assert chosen.methods == ("default", "small_gicp GICP")
    assert chosen.starts == 2 and chosen.is_part


@pytest.mark.parametrize(
    ("variable", "value", "named"),
    [
        ("BENCHMARK_SETS", "moro,mora", "'mora'"),
        ("BENCHMARK_METHODS", "", "''"),
        ("BENCHMARK_STARTS", "0", "'0'"),
        ("BENCHMARK_STARTS", "few", "'few'"),
    ],
)
def test_what_fits_nothing_is_named(variable: str, value: str, named: str) -> None:
    with pytest.raises(ValueError, match=variable) as caught:
        Choice.read(SETS, SETS, METHODS, {variable: value})
    assert named in str(caught.value)
