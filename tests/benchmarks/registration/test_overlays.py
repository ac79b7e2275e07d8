"""Failures become pictures that show truth, start and result."""

from dataclasses import replace
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from benchmarks.registration.instances import HALF, Instance
from benchmarks.registration.judging import Judge
from benchmarks.registration.methods import DEFAULT, GICP
from benchmarks.registration.overlays import (
    A_MONTAGE,
    BEFORE,
    BEHIND,
    COLUMNS,
    GREEN,
    GREY,
    PANEL_WIDTH,
    RED,
    UNMEASURED,
    overlay,
    residuals,
    write_overlays,
)
from benchmarks.registration.starts import GOOD, NEAR
from benchmarks.registration.trials import Trial
from registration_core.geometry import pose
from registration_core.synthetic.objects import demo_objects
from registration_core.synthetic.scene import make_scene

DRILL = demo_objects()[0].model


@pytest.fixture(scope="module")
def drill() -> Instance:
    (view,) = make_scene(np.random.default_rng(2), [DRILL], distractors=1).views
    T = view.instances[0].T_camera_object
    return Instance(HALF, "scene 1", "drill", DRILL, view.depth, view.camera, T, 0, view.perfect_depth)


def trial(instance: Instance, moved: float, start: int = 0, method: str = DEFAULT) -> Trial:
    judge, T_start, T_result = Judge(DRILL), instance.truth.copy(), instance.truth.copy()
    T_start[1, 3] += 0.03
    T_result[0, 3] += moved
    return Trial(
        instance.set_name, instance.scene, 0, NEAR, start, method, judge.error(T_start, instance.truth),
        judge.error(T_result, instance.truth), T_start, T_result, False, 0.02, 0.9 - 0.01 * start,
    )  # fmt: skip


def test_failures_of_the_default_are_written_and_joined(drill: Instance, tmp_path: Path) -> None:
    failures = [trial(drill, 0.1, start) for start in range(A_MONTAGE + 1)]
    write_overlays(tmp_path / "out", [drill], [*failures, trial(drill, 0.0, 20), trial(drill, 0.1, 21, GICP)])
    names = sorted(path.name for path in (tmp_path / "out").iterdir())
    montages = [f"montage_at_least_half_visible_0{n}.png" for n in (1, 2)]
    assert names == sorted([*montages, *(f"scene_1_0_20mm_{n}.png" for n in range(A_MONTAGE + 1))])
    first = np.asarray(Image.open(tmp_path / "out" / montages[0]))
    one = np.asarray(Image.open(tmp_path / "out" / "scene_1_0_20mm_0.png"))  # the most confident
    assert np.array_equal(first[: one.shape[0], : one.shape[1]], one)
    assert first.shape[0] == one.shape[0] * A_MONTAGE // COLUMNS


@pytest.mark.parametrize("in_color", [True, False])
def test_all_outlines_are_drawn(drill: Instance, tmp_path: Path, in_color: bool) -> None:
    color_path = tmp_path / "color.png"
    Image.new("RGB", (drill.camera.width, drill.camera.height), (1, 2, 3)).save(color_path)
    alike = pose.exp([0.04, 0.0, 0.0, 0.0, 0.0, 0.0]) @ drill.truth
    instance = replace(drill, color_path=color_path if in_color else None, alike=(alike,))
    panel = np.asarray(overlay(instance, trial(instance, 0.06)))[:, :PANEL_WIDTH]
    colors = {tuple(color) for color in panel.reshape(-1, 3).tolist()}
    assert {GREEN, GREY, RED} <= colors
    assert ((1, 2, 3) in colors) == in_color


def test_residuals_have_a_sign() -> None:
    depth = np.array([[1.0, 1.02, 0.98, 0.0]], np.float32)
    picture = residuals(depth, np.ones_like(depth))[0]
    assert picture[0].min() > 200
    assert picture[1:].tolist() == [BEHIND.tolist(), BEFORE.tolist(), UNMEASURED.tolist()]
    assert residuals(depth, np.zeros_like(depth))[0].max() < 200


def test_nothing_that_is_right_is_shown(drill: Instance, tmp_path: Path) -> None:
    write_overlays(tmp_path, [drill], [replace(trial(drill, 0.0), shell=GOOD)])
    assert not list(tmp_path.iterdir())
