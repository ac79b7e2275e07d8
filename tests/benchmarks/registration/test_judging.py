"""What is called right, close and worse."""

from dataclasses import replace

import numpy as np
import pytest

from benchmarks.registration.judging import Judge
from registration_core import ObjectModel
from registration_core.geometry import pose
from registration_core.synthetic.objects import demo_objects

OBJECTS = {known.name: known.model for known in demo_objects()}
TRUTH = pose.exp([0.02, 0.05, 0.7, 0.4, -1.0, 0.2])


def turned(T: np.ndarray, axis: int, degrees: float) -> np.ndarray:
    return T @ pose.exp([0.0, 0.0, 0.0, *np.radians(degrees) * np.eye(3)[axis]])


@pytest.mark.parametrize("name", OBJECTS)
def test_the_truth_has_no_error(name: str) -> None:
    error = Judge(OBJECTS[name]).error(TRUTH, TRUTH)
    assert (error.add, error.mssd, error.translation) == pytest.approx((0.0, 0.0, 0.0), abs=1e-9)
    assert error.rotation == pytest.approx(0.0, abs=1e-7)
    assert error.is_right and error.is_exact and error.is_close and not error.is_worse_than_good


def test_a_shift_is_measured_by_all() -> None:
    drill = OBJECTS["drill"]
    moved = TRUTH.copy()
    moved[:3, 3] += [0.0, 0.003, 0.004]
    error = Judge(drill).error(moved, TRUTH)
    share = 0.005 / drill.diameter
    assert (error.add, error.mssd, error.translation) == pytest.approx((share, share, 0.005))
    assert error.is_worse_than_good and not error.is_close and error.is_right


@pytest.mark.parametrize(
    ("name", "axis", "degrees"), [("bottle", 2, 77.0), ("box", 0, 180.0), ("box", 2, 180.0)]
)
def test_symmetric_twins_are_right(name: str, axis: int, degrees: float) -> None:
    error = Judge(OBJECTS[name]).error(turned(TRUTH, axis, degrees), TRUTH)
    assert error.is_close and error.is_exact and error.is_right


@pytest.mark.parametrize(
    ("name", "axis", "degrees"), [("mug", 2, 180.0), ("box", 2, 90.0), ("bottle", 0, 180.0)]
)
def test_others_are_not(name: str, axis: int, degrees: float) -> None:
    error = Judge(OBJECTS[name]).error(turned(TRUTH, axis, degrees), TRUTH)
    assert not error.is_close and not error.is_exact and error.is_worse_than_good


def test_rotations_are_measured_about_the_centre() -> None:
    bottle = OBJECTS["bottle"]
    far_origin = replace(bottle, vertices=bottle.vertices + np.array([0.0, 0.0, 0.5]))
    T_object_centre = pose.from_rotation_translation(np.eye(3), far_origin.centre)
    estimate = turned(TRUTH @ T_object_centre, 0, 1.5) @ pose.inverse(T_object_centre)
    error = Judge(far_origin).error(estimate, TRUTH)
    assert error.translation == pytest.approx(0.0, abs=1e-9)
    assert error.rotation == pytest.approx(np.radians(1.5))


def test_add_of_an_asymmetric_object_matches_points_with_themselves() -> None:
    drill = OBJECTS["drill"]
    alike = ObjectModel(drill.vertices, drill.faces, OBJECTS["box"].symmetries)
    estimate = turned(TRUTH, 0, 25.0)
    assert Judge(alike).error(estimate, TRUTH).add < 0.7 * Judge(drill).error(estimate, TRUTH).add


def test_the_nearest_of_several_true_poses_counts() -> None:
    judge, other = Judge(OBJECTS["drill"]), pose.exp([0.3, 0.0, 0.8, 0.0, 1.0, 0.0])
    estimate = turned(TRUTH, 0, 5.0)
    assert judge.nearest_error(estimate, [other, TRUTH]) == judge.error(estimate, TRUTH)
    assert judge.nearest_error(other, [TRUTH, other]).is_close
