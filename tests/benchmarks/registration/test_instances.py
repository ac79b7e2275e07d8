"""Instances show what their set promises, at their true poses."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.registration.instances import (
    APC,
    BUNNY,
    HALF,
    INEXACT,
    MORO,
    RBT,
    SENSORS,
    YCB,
    Instance,
    inexact_instances,
    real_instances,
    sensor_instances,
    synthetic_instances,
)
from registration_core.rendering.rasterizer import render_depth


def shares(instance: Instance) -> tuple[float, float]:
    """Of the silhouette: where the sensor sees the object, and how much of that lies within 5 mm of it."""
    drawn = render_depth(instance.model, instance.camera, instance.truth)
    measured = (drawn > 0) & (instance.depth > 0)
    unhidden = measured & (instance.depth > drawn - 0.02)
    near = np.abs(instance.depth - drawn)[unhidden] < 0.005
    return unhidden.sum() / measured.sum(), float(near.mean())


@pytest.fixture(scope="module")
def few() -> list[Instance]:
    return synthetic_instances(HALF, 1, most_scenes=1)


def test_synthetic_objects_are_where_they_are_said_to_be(few: list[Instance]) -> None:
    assert few
    for instance in few:
        unhidden, near = shares(instance)
        assert unhidden > 0.45 and near > 0.7
        assert instance.depth.shape == (480, 640)


def test_synthetic_instances_are_always_the_same(few: list[Instance]) -> None:
    again = synthetic_instances(HALF, 1, most_scenes=1)
    assert [one.object_name for one in again] == [one.object_name for one in few]
    assert all(np.array_equal(a.depth, b.depth) for a, b in zip(again, few, strict=True))


@pytest.mark.parametrize("set_name", SENSORS)
def test_other_sensors_measure_the_same_scenes(set_name: str, few: list[Instance]) -> None:
    measured = sensor_instances(set_name, 1, most_scenes=1)
    assert [one.object_name for one in measured] == [one.object_name for one in few]
    for one, plain in zip(measured, few, strict=True):
        assert one.perfect_depth is not None and plain.perfect_depth is not None
        assert one.set_name == set_name and np.array_equal(one.perfect_depth, plain.perfect_depth)
        assert not np.array_equal(one.depth, plain.depth)
        drawn = render_depth(one.model, one.camera, one.truth)
        seen = (drawn > 0) & (np.abs(one.perfect_depth - drawn) < 0.002) & (one.depth > 0)
        assert seen.sum() > 0.1 * (drawn > 0).sum()  # a line pattern leaves most of a small thing out
        assert np.median(np.abs(one.depth - drawn)[seen]) < 0.03


def test_inexact_meshes_are_off_by_a_little(few: list[Instance]) -> None:
    for one, plain in zip(inexact_instances(1, most_scenes=1), few, strict=True):
        assert one.set_name == INEXACT and one.depth is not None
        off = np.linalg.norm(one.model.vertices - plain.model.vertices, axis=1).max()
        assert 0.0 < off < 0.02 * plain.model.diameter


@pytest.mark.parametrize(
    ("set_name", "count", "least_near"),
    [(YCB, 6, 0.85), (BUNNY, 8, 0.85), (MORO, 60, 0.6), (APC, 5, 0.6), (RBT, 26, 0.85)],
)
def test_real_objects_are_where_they_are_said_to_be(
    set_name: str, count: int, least_near: float, shared_data: Path
) -> None:
    found = real_instances(set_name)
    assert len(found) == count
    assert len({instance.seed for instance in found}) == count
    for instance in found:
        unhidden, near = shares(instance)
        assert unhidden > 0.7 and near > least_near, (instance.scene, instance.object_name)


def test_instances_of_one_shape_know_of_each_other(shared_data: Path) -> None:
    (first, second, third, *_), other = real_instances(MORO)[:3], real_instances(MORO)[5]
    assert [one.object_name for one in (first, second, third)] == ["moro 1", "moro 2", "moro 2"]
    for one in (first, second, third):
        assert len(one.truths) == 3 and one.truths[0] is one.truth
        assert {T.tobytes() for T in one.truths} == {T.tobytes() for T in first.truths}
    assert other.object_name == "moro 4" and len(other.truths) == 1
