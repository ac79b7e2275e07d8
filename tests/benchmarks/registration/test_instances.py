"""Instances show what their set promises, at their true poses."""

from pathlib import Path

import numpy as np
import pytest

from benchmarks.registration.instances import BUNNY, HALF, YCB, Instance, real_instances, synthetic_instances
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


@pytest.mark.parametrize(("set_name", "count"), [(YCB, 6), (BUNNY, 8)])
def test_real_objects_are_where_they_are_said_to_be(set_name: str, count: int, shared_data: Path) -> None:
    found = real_instances(set_name)
    assert len(found) == count
    assert len({instance.seed for instance in found}) == count
    for instance in found:
        unhidden, near = shares(instance)
        assert unhidden > 0.7 and near > 0.85
