"""Colour images for fitting: of the scene that the depth shows."""

from functools import cache

import numpy as np
import pytest
from numpy.typing import NDArray

from registration_core.fitting.colors import colored
from registration_core.fitting.objects import random_object
from registration_core.fitting.scenes import FIRST, SETTINGS, Picture, picture
from registration_core.search.color_edges import color_changes, color_is_aligned

pytestmark = pytest.mark.slow  # makes pictures of many scenes

MODELS = [random_object(kind, 0).model for kind in ("mug", "carton", "gear", "bowl", "figure")]


@cache
def seen(setting: str, seed: int) -> tuple[Picture, NDArray[np.uint8]]:
    """A picture and its colours, made once for all tests."""
    rng = np.random.default_rng(seed)
    view = picture(setting, MODELS, rng, 2.0)
    return view, colored(view, rng)


@pytest.mark.parametrize("setting", SETTINGS)
def test_colours_change_most_where_things_end(setting) -> None:
    told = []
    for seed in range(3):
        view, color = seen(setting, seed)
        assert color.shape == (*view.depth.shape, 3) and color.dtype == np.uint8
        ends = np.zeros(view.labels.shape, np.bool_)
        ends[:, 1:] = view.labels[:, 1:] != view.labels[:, :-1]
        changes = color_changes(color)
        told.append((changes[ends].mean(), changes.mean()))
    at_ends, everywhere = np.mean(told, axis=0)
    assert at_ends > 0.5 and at_ends > 2.0 * everywhere


def test_most_of_them_are_found_to_be_aligned() -> None:
    found = []
    for seed in range(7):
        view, color = seen("clutter", seed)
        found.append(color_is_aligned(color, view.depth))
    assert np.mean(found) > 0.7


def test_copies_look_the_same_and_the_same_seed_gives_the_same_picture() -> None:
    view = picture("bin", MODELS, np.random.default_rng(5), 2.0)
    first, again = (colored(view, np.random.default_rng(2)) for _ in range(2))
    np.testing.assert_array_equal(first, again)
    levels = [
        np.median(first[view.labels == FIRST + k].astype(float), axis=0)
        for k in range(SETTINGS["bin"].copies)
        if (view.labels == FIRST + k).sum() > 500
    ]
    assert len(levels) >= 2
    hues = [level / np.linalg.norm(level) for level in levels]
    assert all(np.abs(hue - hues[0]).max() < 0.1 for hue in hues)
