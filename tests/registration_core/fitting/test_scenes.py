"""Scenes for fitting: what they say of each object is what the depth image shows."""

import numpy as np
import pytest

from registration_core.fitting.objects import random_object
from registration_core.fitting.scenes import SETTINGS, picture
from registration_core.rendering.rasterizer import render_depth

MODELS = [random_object(kind, 0).model for kind in ("mug", "carton", "gear", "bowl", "figure")]


@pytest.mark.parametrize("setting", SETTINGS)
def test_visible_share_is_what_the_image_shows(setting) -> None:
    view = picture(setting, MODELS, np.random.default_rng(3), 2.0)
    assert len(view.seen) == SETTINGS[setting].objects
    for seen in view.seen:
        drawn = render_depth(MODELS[seen.index], view.camera, seen.T_camera_object)
        inside = drawn > 0
        if inside.sum() > 500 and not (_touches_the_border(inside)):
            shown = np.abs(drawn - view.depth)[inside] < 1e-4
            assert shown.mean() == pytest.approx(seen.visible, abs=0.05)


def test_copies_are_of_one_object_and_nothing_is_farther_than_asked() -> None:
    view = picture("bin", MODELS, np.random.default_rng(5), 0.5)
    assert [seen.index for seen in view.seen].count(0) == SETTINGS["bin"].copies
    assert max(seen.T_camera_object[2, 3] for seen in view.seen) < 0.75


def test_what_is_cut_out_is_the_object() -> None:
    view = picture("cut out", MODELS, np.random.default_rng(4), 2.0)
    assert view.kept is not None
    np.testing.assert_allclose(
        view.depth[view.kept],
        render_depth(MODELS[0], view.camera, view.seen[0].T_camera_object)[view.kept],
        atol=1e-5,
    )


def _touches_the_border(mask: np.ndarray) -> bool:
    return bool(mask[[0, -1]].any() or mask[:, [0, -1]].any())
