"""The softmax over candidates: finds the weights that choices were made by, within known signs."""

import numpy as np

from registration_core.fitting.ranking import (
    RIDGES,
    Choice,
    best_ridge,
    fitted_weights,
    judged_features,
    needless,
    signs,
)
from registration_core.judge import pixel_evidence as evidence

F = evidence.COUNT + 2


def choices_by(weights, trials=400, seed=0):
    """Trials of random candidates in which the one is right that the weights make most of."""
    rng = np.random.default_rng(seed)
    found = []
    for _ in range(trials):
        features = np.zeros((12, F))
        features[:, [0, evidence.MATCHED, F - 1]] = rng.uniform(0.0, 1.0, (12, 3))
        right = np.zeros(12, np.bool_)
        right[np.argmax(features @ weights)] = True
        found.append(Choice(features, right, right))
    return found


def hits(choices, weights):
    return np.mean([one.right[np.argmax(one.features @ weights)] for one in choices])


def test_weights_choose_as_the_true_ones_do() -> None:
    truth = np.zeros(F)
    truth[[0, evidence.MATCHED, F - 1]] = -2.0, 5.0, 1.0
    weights = fitted_weights(choices_by(truth), ridge=1e-4)
    assert hits(choices_by(truth, seed=1), weights) > 0.97
    assert weights[evidence.MATCHED] > 0 > weights[0]


def test_known_signs_hold_whatever_the_data_say() -> None:
    against_reason = np.zeros(F)
    against_reason[[0, F - 1]] = 3.0, -3.0  # hidden pixels speak for a pose, nearness against it
    weights = fitted_weights(choices_by(against_reason), 0.01)
    for weight, (low, high) in zip(weights, signs(), strict=True):
        assert (low is None or weight >= low) and (high is None or weight <= high)
    assert weights[0] == 0.0 == weights[F - 1]


def test_trials_without_a_right_or_a_wrong_candidate_say_nothing() -> None:
    truth = np.zeros(F)
    truth[evidence.MATCHED] = 4.0
    choices = choices_by(truth)
    none = Choice(choices[0].features, *np.zeros((2, 12), np.bool_))
    every = Choice(choices[0].features, *np.ones((2, 12), np.bool_))
    np.testing.assert_array_equal(
        fitted_weights([*choices, none, every], 0.01), fitted_weights(choices, 0.01)
    )


def test_the_exact_ones_are_wanted_and_the_right_ones_only_where_none_is_exact() -> None:
    right, exact = np.array([True, True, False]), np.array([False, True, False])
    np.testing.assert_array_equal(Choice(np.zeros((3, F)), right, exact).wanted, exact)
    np.testing.assert_array_equal(Choice(np.zeros((3, F)), right, ~right & exact).wanted, right)


def test_a_start_changes_nothing_and_removed_features_weigh_nothing() -> None:
    truth = np.zeros(F)
    truth[[0, evidence.MATCHED, F - 1]] = -2.0, 5.0, 1.0
    choices = choices_by(truth)
    weights = fitted_weights(choices, 0.01)
    again = fitted_weights(choices, 0.01, start=2.0 * weights)
    np.testing.assert_allclose(again, weights, atol=0.02)
    without = fitted_weights(choices, 0.01, removed=[0])
    assert without[0] == 0.0 > weights[0]
    assert without[evidence.MATCHED] > 0.0


def test_classes_that_do_not_help_are_needless_and_those_that_do_are_not() -> None:
    truth = np.zeros(F)
    truth[[0, evidence.MATCHED]] = -3.0, 5.0
    rng = np.random.default_rng(3)
    choices = choices_by(truth, trials=100)
    for one in choices:
        one.features[:, evidence.RING] = rng.uniform(0.0, 1.0, 12)  # says nothing
    folds = [np.arange(100) % 3 == fold for fold in range(3)]
    removed = needless(choices, folds, 0.001)
    assert evidence.RING in removed
    assert 0 not in removed and evidence.MATCHED not in removed


def test_features_end_with_the_match_and_the_nearness() -> None:
    counts = np.zeros((2, evidence.COUNT))
    counts[0, evidence.MATCHED] = 1.0
    features = judged_features(counts, np.array([0.5, 2.0]))
    np.testing.assert_array_equal(features[:, -1], [-0.5, -2.0])
    np.testing.assert_array_equal(features[:, -2], [1.0, 0.0])


def test_a_strong_penalty_is_chosen_where_choices_are_noise_and_a_weak_one_where_they_are_not() -> None:
    truth = np.zeros(F)
    truth[[0, evidence.MATCHED, F - 1]] = -2.0, 5.0, 1.0
    rng = np.random.default_rng(2)
    folds = [np.arange(60) % 3 == fold for fold in range(3)]
    lawful = choices_by(truth, trials=60)
    noise = [Choice(one.features, *[rng.permutation(one.right)] * 2) for one in lawful]
    assert best_ridge(lawful, folds) < best_ridge(noise, folds) == RIDGES[-1]
