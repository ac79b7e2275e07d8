"""Laws and known answers of `benchmarks.registration.statistics`."""

import math

import numpy as np
import pytest

from benchmarks.registration.statistics import (
    auroc,
    calibration_error,
    false_accepts,
    measure_over_scenes,
    percentiles,
    reliability,
    share_over_scenes,
)

RNG = np.random.default_rng(3)
SCORES, RIGHT = RNG.random(400), RNG.random(400) < 0.6


def test_auroc_is_the_share_of_pairs_in_the_right_order() -> None:
    good, bad = SCORES[RIGHT], SCORES[~RIGHT]
    pairs = (good[:, None] > bad).mean()
    assert auroc(SCORES, RIGHT) == pytest.approx(pairs)


@pytest.mark.parametrize(
    ("scores", "expected"),
    [
        ([0.9, 0.8, 0.2, 0.1], 1.0),
        ([0.1, 0.2, 0.8, 0.9], 0.0),
        ([0.5] * 4, 0.5),
        ([0.9, 0.3, 0.3, 0.1], 0.875),
    ],
)
def test_auroc_by_hand(scores: list[float], expected: float) -> None:
    assert auroc(scores, [True, True, False, False]) == expected


def test_auroc_and_false_accepts_need_both_kinds() -> None:
    assert math.isnan(auroc([0.1, 0.2], [True, True]))
    assert math.isnan(false_accepts([0.1, 0.2], [False, False]))
    assert math.isnan(false_accepts([0.1, 0.2], [True, True]))


def test_auroc_knows_only_the_order() -> None:
    assert auroc(SCORES**3, RIGHT) == auroc(SCORES, RIGHT)
    assert auroc(-SCORES, RIGHT) == pytest.approx(1.0 - auroc(SCORES, RIGHT))


def test_calibration_error_by_hand() -> None:
    claims, right = [0.1, 0.1, 0.8, 0.8], [False, False, True, False]
    assert calibration_error(claims, right, bins=2) == pytest.approx((0.1 + 0.3) / 2)


def test_a_calibrated_confidence_has_a_small_error_and_a_bold_one_a_large_one() -> None:
    rng = np.random.default_rng(5)
    claims = rng.random(20_000)
    right = rng.random(20_000) < claims
    assert calibration_error(claims, right) < 0.015
    assert calibration_error(np.sqrt(claims), right) > 0.1


def test_the_order_of_ties_means_nothing() -> None:
    right = [True] * 30 + [False] * 10
    assert calibration_error([0.75] * 40, right) == pytest.approx(0.0)
    assert calibration_error([0.75] * 40, right[::-1]) == pytest.approx(0.0)


def test_bins_hold_everything_once_and_grow() -> None:
    parts = reliability(SCORES, RIGHT, bins=7)
    assert sum(part.count for part in parts) == 400
    assert max(part.count for part in parts) - min(part.count for part in parts) <= 1
    assert [part.confidence for part in parts] == sorted(part.confidence for part in parts)
    assert sum(part.count * part.correct for part in parts) == pytest.approx(RIGHT.sum())


def test_false_accepts_by_hand() -> None:
    good = [1.0, 0.9, 0.8, 0.7, 0.6, 0.5, 0.4, 0.3, 0.2, 0.1]
    bad = [0.95, 0.2, 0.15, 0.05]
    right = [True] * 10 + [False] * 4
    assert false_accepts(good + bad, right) == 0.5
    assert false_accepts(good + bad, right, accepted_good=0.1) == 0.0
    assert false_accepts(good + bad, right, accepted_good=1.0) == 0.75


def test_a_share_and_its_interval() -> None:
    values, scenes = RIGHT[:200], np.repeat(np.arange(20), 10).tolist()
    share = share_over_scenes(values, scenes)
    assert share.value == values.mean()
    assert 0.0 <= share.low < share.value < share.high <= 1.0
    assert share == share_over_scenes(values, scenes)


def test_the_interval_of_independent_values_is_the_textbooks() -> None:
    share = share_over_scenes(RIGHT, list(range(400)))
    half_width = 1.96 * np.sqrt(RIGHT.mean() * (1 - RIGHT.mean()) / 400)
    assert (share.high - share.low) / 2 == pytest.approx(half_width, rel=0.1)


def test_values_of_one_scene_count_as_one() -> None:
    scenes = np.repeat(np.arange(20), 20)
    alike = np.repeat(np.random.default_rng(1).random(20) < 0.6, 20)
    together = share_over_scenes(alike, scenes.tolist())
    apart = share_over_scenes(alike, list(range(400)))
    assert together.high - together.low > 3 * (apart.high - apart.low)


def test_percentiles() -> None:
    assert percentiles(range(101)) == (50.0, 95.0)


def test_a_measure_has_an_interval_over_scenes() -> None:
    scenes = [n // 20 for n in range(len(SCORES))]
    share = measure_over_scenes(auroc, SCORES, RIGHT, scenes)
    assert share.value == auroc(SCORES, RIGHT)
    assert share.low < share.value < share.high
    assert share == measure_over_scenes(auroc, SCORES, RIGHT, scenes)


def test_the_interval_of_one_scene_is_a_point_and_of_nothing_wrong_unknown() -> None:
    share = measure_over_scenes(auroc, SCORES, RIGHT, ["one"] * len(SCORES))
    assert share.low == share.value == share.high
    assert math.isnan(measure_over_scenes(auroc, [0.5, 0.6], [True, True], ["a", "b"]).low)
