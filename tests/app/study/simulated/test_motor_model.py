"""The simulated hand drags one handle at a time, and gets there."""

import numpy as np
import pytest

from app.study.simulated.motor_model import (
    CLOSE,
    DECIDE,
    EXPERT,
    NOVICE,
    MotorModel,
    next_stroke,
    seen_offset,
    stroke_along,
)
from registration_core.geometry import pose

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
    assert len(moved) == len(stroke.seconds_held)
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


SURE = MotorModel(misjudged=0.0, unseen=(0.0, 0.0), biased=(0.0, 0.0))


def test_a_stroke_takes_the_time_of_its_models_worked_out_by_hand() -> None:
    offset = np.array([0.035, 0, 0, 0, 0, 0])  # 7 widths: log2(7 + 1) = 3 bits
    stroke = stroke_along(WANTED, offset, CLOSE, SURE, np.random.default_rng(0))
    assert stroke.reach == pytest.approx(1.35 + 1.1 + 0.1)
    assert stroke.seconds_held[-1] == pytest.approx(0.3 + 3 * 0.25)
    assert stroke.seconds == pytest.approx(3.6)


def test_the_pose_is_told_twenty_times_a_second_and_fastest_half_way() -> None:
    offset = np.array([0, 0, 0, 0.6, 0, 0])
    stroke = stroke_along(WANTED, offset, CLOSE, SURE, np.random.default_rng(0))
    assert np.allclose(np.diff(stroke.seconds_held)[:-1], 0.05)
    turned = np.array([pose.log(pose.inverse(WANTED) @ there)[3] for there in stroke.path])
    speed = np.diff(turned) / np.diff(stroke.seconds_held)
    peak = stroke.seconds_held[speed.argmax()] / stroke.seconds_held[-1]
    assert peak == pytest.approx(0.5, abs=0.1)
    assert speed.max() / (turned[-1] / stroke.seconds_held[-1]) == pytest.approx(1.875, abs=0.05)


def test_a_movement_ends_beside_its_aim_by_a_share_of_the_width() -> None:
    offset = np.array([0, 0.05, 0, 0, 0, 0])
    rng = np.random.default_rng(3)
    ends = [stroke_along(np.eye(4), offset, CLOSE, SURE, rng).path[-1][1, 3] for _ in range(2000)]
    assert np.mean(ends) == pytest.approx(0.05, abs=1e-4)
    assert np.std(ends) == pytest.approx(CLOSE[0] / 4.133, rel=0.06)


def test_more_looks_see_more_and_novices_see_less() -> None:
    T = off_by([0.02, 0, 0, 0, 0, 0])

    def spread_of(hand: MotorModel, looks: int) -> float:
        rng = np.random.default_rng(4)
        return float(np.std([seen_offset(T, WANTED, hand, rng, looks)[1] for _ in range(2000)]))

    assert spread_of(EXPERT, 1) == pytest.approx(EXPERT.unseen[0], rel=0.06)
    assert spread_of(EXPERT, 4) == pytest.approx(EXPERT.unseen[0] / 2, rel=0.06)
    assert spread_of(NOVICE, 1) > spread_of(EXPERT, 1)


def test_the_same_seed_gives_the_same_stroke() -> None:
    one, other = (next_stroke(off_by([0.1] * 6), WANTED, np.random.default_rng(7)) for _ in range(2))
    assert np.array_equal(one.path, other.path) and one.seconds == other.seconds
