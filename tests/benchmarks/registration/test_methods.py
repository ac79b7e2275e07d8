"""Every method registers an object from nearby, and fits in one signature."""

import numpy as np
import pytest

from benchmarks.registration.ambiguity import fits_as_well
from benchmarks.registration.instances import HALF, Instance
from benchmarks.registration.judging import Judge
from benchmarks.registration.methods import (
    NOTHING,
    PAPER,
    PROTOTYPE,
    available_methods,
    polished_truth,
    register,
)
from benchmarks.registration.several_views import turned_mug
from benchmarks.registration.starts import SHELLS, starts
from benchmarks.registration.trials import Trial, try_instance
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth
from registration_core.synthetic.objects import demo_objects
from registration_core.synthetic.scene import CAMERA, make_scene

SHELL, METHODS = SHELLS[0], available_methods()
DRILL, MUG = (known.model for known in demo_objects()[:2])


@pytest.fixture(scope="module")
def drill() -> Instance:
    (view,) = make_scene(np.random.default_rng(2), [DRILL], distractors=1).views
    T = view.instances[0].T_camera_object
    return Instance(HALF, "one", "drill", DRILL, view.depth, view.camera, T, 0, view.perfect_depth)


@pytest.fixture(scope="module")
def trials(drill: Instance) -> list[Trial]:
    return try_instance(drill, 0, {SHELL: dict.fromkeys(METHODS, 1)}, quick=True).trials


def test_every_method_leaves_a_pose_and_a_time(trials: list[Trial]) -> None:
    assert [trial.method for trial in trials] == list(METHODS)
    for trial in trials:
        assert pose.checked(trial.T_result, "T_result") == pytest.approx(trial.T_result, abs=1e-6)
        assert trial.seconds >= 0.0
        assert trial.start_error.translation == pytest.approx(SHELL.translation)
        assert (trial.confidence is not None) == (trial.method.startswith("default") or trial.method == PAPER)


def test_methods_come_nearer_to_the_truth(trials: list[Trial]) -> None:
    for trial in trials:
        if trial.method == NOTHING:
            assert trial.error.add == trial.start_error.add
        elif trial.method != PAPER:  # a quick one is too short for that
            assert trial.error.add < 0.5 * trial.start_error.add


def test_the_polish_stays_at_the_truth(drill: Instance) -> None:
    assert Judge(DRILL).error(polished_truth(drill), drill.truth).is_close


def test_nothing_seen_changes_nothing(drill: Instance) -> None:
    (start,) = starts(drill.truth, DRILL, drill.camera, SHELL, 1, 0)
    empty = np.zeros_like(drill.depth)
    empty[0, 0] = 1.0
    blind = Instance(HALF, "none", "drill", DRILL, empty, drill.camera, drill.truth, 0)
    for method in (name for name in METHODS if name != PROTOTYPE):  # which goes astray
        assert register(method, blind, start, SHELL, 0, quick=True).T_camera_object == pytest.approx(start)


def test_a_mug_with_its_handle_behind_fits_in_other_ways() -> None:
    T_camera_table = pose.exp([0.0, 0.0, 0.8, -2.1, 0.0, 0.0])
    handle_behind, handle_in_view = (
        T_camera_table @ turned_mug(np.radians(angle)) for angle in (-90.0, 90.0)
    )
    assert fits_as_well(alone(handle_behind), T_camera_table @ turned_mug(np.radians(-80.0)))
    assert not fits_as_well(alone(handle_behind), handle_in_view)
    assert not fits_as_well(alone(handle_in_view), handle_behind)
    assert not fits_as_well(alone(handle_in_view), T_camera_table @ turned_mug(np.radians(60.0)))


def alone(truth: np.ndarray) -> Instance:
    depth = render_depth(MUG, CAMERA, truth)
    return Instance(HALF, "mug", "mug", MUG, depth, CAMERA, truth, 0, depth)
