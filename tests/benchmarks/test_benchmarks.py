"""Every benchmark works, with tiny counts; how fast it is, is not judged here."""

import math
from pathlib import Path

import pytest

from benchmarks.__main__ import BENCHMARKS


@pytest.mark.parametrize("name", BENCHMARKS)
def test_a_benchmark_measures(name: str, tmp_path: Path) -> None:
    figures = BENCHMARKS[name].run(tmp_path, True)
    assert figures
    assert all(math.isfinite(figure.value) for figure in figures)
    nothing_lost = [figure for figure in figures if figure.unit == "" and figure.target is not None]
    assert not any(figure.is_missed for figure in nothing_lost)
    assert bool(nothing_lost) == (name == "load")
