"""Every benchmark works, with tiny counts; how fast it is, is not judged here."""

import math
from collections.abc import Iterator, Sequence
from pathlib import Path

import pytest

from benchmarks.__main__ import BENCHMARKS
from benchmarks.big_mesh import SMALL_SECTIONS, ring
from benchmarks.figures import Figure
from benchmarks.memory import IMPATIENT
from benchmarks.scenes import dense_objects, write_full_frames
from benchmarks.server import RunningServer, server_on

ON_A_SERVER = (
    "memory",  # before the others leave sessions open
    "churn",
    "open_task",
    "big_mesh",
    "first_snap",
    "snap",
    "many_tasks",
    "idle",
    "browser",
    "techniques",
    "live",
)
"""What measures on any server with scenes: here all on the same one."""
ON_THEIR_OWN = tuple(name for name in BENCHMARKS if name not in ON_A_SERVER)
FRAMES = 4
"""As many as pages are open at once; of the objects in them the second is a large mesh."""


@pytest.fixture(scope="module")
def full_frames(tmp_path_factory: pytest.TempPathFactory) -> Iterator[RunningServer]:
    folder = tmp_path_factory.mktemp("benchmarks")
    objects = [*dense_objects(1), ring(SMALL_SECTIONS)]
    write_full_frames(folder / "frames", FRAMES, objects)
    with server_on(folder, [folder / "frames"], IMPATIENT) as server:
        yield server


@pytest.mark.parametrize("name", ON_A_SERVER)
def test_a_benchmark_measures_a_server(name: str, full_frames: RunningServer) -> None:
    assert not are_lost(BENCHMARKS[name].measure(full_frames, True))


@pytest.mark.parametrize("name", ON_THEIR_OWN)
def test_a_benchmark_runs(name: str, tmp_path: Path) -> None:
    assert bool(are_lost(BENCHMARKS[name].run(tmp_path, True))) == (name == "load")


def are_lost(figures: Sequence[Figure]) -> list[Figure]:
    """Check figures; of them those that count what must not be lost, of which nothing may be."""
    assert figures
    assert all(math.isfinite(figure.value) for figure in figures)
    counts = [figure for figure in figures if figure.unit == "" and figure.target is not None]
    assert not any(figure.is_missed for figure in counts)
    return counts
