"""Instances show what their set promises, at their true poses."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.registration.instances import (
    APC,
    BUNNY,
    HALF,
    MORO,
    RBT,
    YCB,
    Instance,
    real_instances,
    synthetic_instances,
)
from registration_core.rasterizer import render_depth


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
