"""The scripted hand drags one handle at a time, and gets there."""

import numpy as np
import pytest

from benchmarks.hand import CLOSE, DECIDE, UPDATES, next_stroke
from registration_core import pose

WANTED = pose.exp([0.1, -0.2, 0.8, 0.3, 0.2, -0.4])


def off_by(twist: list[float]) -> np.ndarray:
    return WANTED @ pose.inverse(pose.exp(twist))


@pytest.mark.parametrize(
    ("twist", "axis"),
    [([0.2, 0, 0, 0, 0.3, 0], 0), ([0.01, 0, 0, 0, 0, -1.0], 5), ([0, -0.1, 0.02, 0, 0, 0], 1)],
)
def test_a_stroke_follows_the_handle_that_is_farthest_off(twist: list[float], axis: int) -> None:
    T = off_by(twist)
    stroke = next_stroke(T, WANTED, np.random.default_rng(0))
    moved = np.array([pose.log(pose.inverse(T) @ there) for there in stroke.path])
    assert len(moved) == UPDATES
    assert np.allclose(np.delete(moved, axis, axis=1), 0.0)
    assert (np.diff(np.abs(moved[:, axis])) > 0).all()
    assert moved[-1, axis] == pytest.approx(twist[axis], rel=0.6)
    assert np.sign(moved[-1, axis]) == np.sign(twist[axis])


def test_farther_takes_longer_as_fitts_says() -> None:
    near, far = (
        np.mean(
            [
                next_stroke(off_by([d, 0, 0, 0, 0, 0]), WANTED, np.random.default_rng(n)).seconds
                for n in range(50)
            ]
        )
        for d in (0.02, 0.2)
    )
    assert DECIDE < near < far
    assert far - near == pytest.approx(0.25 * np.log2((0.2 / CLOSE[0] + 1) / (0.02 / CLOSE[0] + 1)), abs=0.15)


def test_strokes_lead_to_the_pose() -> None:
    rng = np.random.default_rng(1)
    T = off_by([0.12, -0.12, 0.1, 0.4, -0.5, 0.3])
    strokes = 0
    while (np.array(pose.distance(T, WANTED)) >= CLOSE).any():
        T = next_stroke(T, WANTED, rng).path[-1]
        strokes += 1
        assert strokes < 60
    assert strokes >= 6
