"""Orders of poses are compared as their definitions say, and the sparse one is no chance."""

import io

import numpy as np
import pytest
from rich.console import Console

from benchmarks.registration.agreement import SPREADS, WEIGHINGS, compared, print_agreement, rankings
from benchmarks.registration.instances import HALF, Instance
from registration_core.synthetic.objects import demo_objects
from registration_core.synthetic.scene import make_scene

SCORES = np.random.default_rng(4).normal(size=300)


@pytest.fixture(scope="module")
def drill() -> Instance:
    model = demo_objects()[0].model
    (view,) = make_scene(np.random.default_rng(2), [model], distractors=1).views
    T = view.instances[0].T_camera_object
    return Instance(HALF, "one", "drill", model, view.depth, view.camera, T, 0, view.perfect_depth)


def test_the_same_order_agrees_and_the_opposite_one_does_not() -> None:
    same, opposite = compared(np.exp(SCORES), SCORES), compared(-SCORES, SCORES)
    assert same.correlation == pytest.approx(1.0) and same.best_is_kept
    assert opposite.correlation == pytest.approx(-1.0) and not opposite.best_is_kept


def test_the_correlation_by_hand() -> None:
    # ranks 1 2 3 4 5 and 2 1 4 3 5: 1 - 6 * 4 / (5 * 24)
    assert compared([1, 2, 3, 4, 5], [20, 10, 40, 30, 50]).correlation == pytest.approx(0.8)


@pytest.mark.parametrize(("better", "kept"), [(0, True), (2, True), (3, False)])
def test_the_exact_best_has_to_be_among_three_of_300(better: int, kept: bool) -> None:
    sparse = SCORES.copy()
    sparse[np.argmax(SCORES)] = np.sort(np.delete(SCORES, np.argmax(SCORES)))[-1 - better] + 1e-9
    assert compared(sparse, SCORES).best_is_kept == kept


def test_sparse_and_exact_rank_alike(drill: Instance) -> None:
    for spread in SPREADS:
        proposals, last = rankings(drill, spread)
        assert 0.2 < proposals.correlation < 1.0
        assert 0.4 < last.correlation < 1.0


def test_the_table_has_a_row_for_each_spread_and_weighing(drill: Instance) -> None:
    written = io.StringIO()
    console = Console(file=written, width=120)
    print_agreement(console, [drill])
    lines = written.getvalue().splitlines()
    assert sum(any(name in line for name in WEIGHINGS) for line in lines) == len(SPREADS) * len(WEIGHINGS)
