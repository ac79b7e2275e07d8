"""Starts are off by exactly what their shell says."""

import numpy as np
import pytest

from benchmarks.registration.starts import GOOD, SHELLS, Shell, starts
from registration_core import Intrinsics, ObjectModel
from registration_core.geometry import pose

CAMERA = Intrinsics(640, 480, 570.0, 570.0, 319.5, 239.5)
# its origin lies outside of it, as a scan's may
OBJECT = ObjectModel(
    np.array([[0.1, 0.2, 0.3], [0.2, 0.2, 0.3], [0.1, 0.35, 0.3], [0.1, 0.2, 0.36]]),
    np.array([[0, 1, 2], [0, 1, 3], [0, 2, 3], [1, 2, 3]], dtype=np.int32),
)
T_OBJECT_CENTRE = pose.from_rotation_translation(np.eye(3), OBJECT.centre)
TRUTH = pose.exp([0.05, -0.02, 0.8, 0.3, 2.0, -0.4]) @ pose.inverse(T_OBJECT_CENTRE)


@pytest.mark.parametrize("shell", [*SHELLS, GOOD], ids=str)
def test_the_perturbation_has_the_size_of_the_shell(shell: Shell) -> None:
    for T in starts(TRUTH, OBJECT, CAMERA, shell, 20, seed=1):
        moved = pose.apply(T, OBJECT.centre) - pose.apply(TRUTH, OBJECT.centre)
        assert np.linalg.norm(moved) == pytest.approx(shell.translation, abs=1e-12)
        assert pose.rotation_angle(T[:3, :3] @ TRUTH[:3, :3].T) == pytest.approx(shell.rotation, abs=1e-9)
        assert T[:3, :3] @ T[:3, :3].T == pytest.approx(np.eye(3), abs=1e-12)


def test_seeds_fix_the_starts() -> None:
    few, many = (starts(TRUTH, OBJECT, CAMERA, SHELLS[1], count, seed=4) for count in (3, 10))
    assert np.array_equal(few, many[:3])
    assert len({T.tobytes() for T in many}) == 10
    assert not np.array_equal(few[0], starts(TRUTH, OBJECT, CAMERA, SHELLS[1], 1, seed=5)[0])
    assert not np.allclose(few[0], starts(TRUTH, OBJECT, CAMERA, SHELLS[2], 1, seed=4)[0])


def test_directions_and_axes_have_no_preference() -> None:
    found = np.array(starts(TRUTH, OBJECT, CAMERA, SHELLS[0], 600, seed=2))
    centres = np.array([pose.apply(T, OBJECT.centre) for T in found]) - pose.apply(TRUTH, OBJECT.centre)
    axes = np.array([pose.log(T @ pose.inverse(TRUTH))[3:] for T in found])
    assert np.abs(centres.mean(axis=0)).max() < 0.1 * SHELLS[0].translation
    assert np.abs(axes.mean(axis=0)).max() < 0.1 * SHELLS[0].rotation


def test_a_start_stays_in_the_image() -> None:
    at_the_border = TRUTH.copy()
    at_the_border[:3, 3] += [-0.25, -0.15, 0.5] - pose.apply(TRUTH, OBJECT.centre)
    for T in starts(at_the_border, OBJECT, CAMERA, SHELLS[3], 50, seed=0):
        x, y, z = pose.apply(T, OBJECT.centre)
        assert z > 0 and 0 <= 570 * x / z + 319.5 < 640 and 0 <= 570 * y / z + 239.5 < 480


def test_shells_have_short_names() -> None:
    assert [str(shell) for shell in (*SHELLS, GOOD)] == [
        "2 cm/15°",
        "5 cm/30°",
        "10 cm/60°",
        "15 cm/90°",
        "2 mm/2°",
    ]
