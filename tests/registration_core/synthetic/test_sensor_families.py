import dataclasses
import json
from typing import Any

import numpy as np
import pytest

from registration_core.synthetic.scene import CAMERA
from registration_core.synthetic.sensor_families import (
    DEMO,
    FAMILIES,
    Sensor,
    SensorFamily,
    draw_sensor,
    measure,
)

DRAWS = 20
FULL = tuple(FAMILIES.values())


def wall(z: float) -> np.ndarray:
    return np.full((CAMERA.height, CAMERA.width), z, dtype=np.float32)


def box_before_wall() -> np.ndarray:
    depth = wall(0.9)
    depth[150:330, 220:420] = 0.8
    return depth


@pytest.mark.parametrize("family", FULL, ids=list(FAMILIES))
def test_what_is_drawn_lies_in_the_ranges(family: SensorFamily):
    rng = np.random.default_rng(0)
    for _ in range(DRAWS):
        sensor = draw_sensor(family, rng)
        for name, (low, high) in family.ranges.items():
            values = np.atleast_1d(getattr(sensor, name))
            assert np.all((low <= values) & (values <= high))


def test_a_sensor_is_drawn_anew_for_each_image_except_for_the_demo():
    rng = np.random.default_rng(0)
    for family in FULL:
        assert (draw_sensor(family, rng) == draw_sensor(family, rng)) == (family is DEMO)


def test_a_sensor_is_json_and_back():
    sensor = draw_sensor(FAMILIES["active stereo"], np.random.default_rng(3))
    read = json.loads(json.dumps(dataclasses.asdict(sensor)))
    values: dict[str, Any] = {k: tuple(v) if isinstance(v, list) else v for k, v in read.items()}
    assert Sensor(**values) == sensor


@pytest.mark.parametrize("family", FULL, ids=list(FAMILIES))
def test_the_same_seed_gives_the_same_image(family: SensorFamily):
    images = []
    for seed in (5, 5, 6):
        rng = np.random.default_rng(seed)
        images.append(measure(box_before_wall(), CAMERA, rng, draw_sensor(family, rng)))
    assert images[0].dtype == np.float32
    assert np.array_equal(images[0], images[1])
    assert not np.array_equal(images[0], images[2])


@pytest.mark.parametrize("family", FULL, ids=list(FAMILIES))
def test_nothing_stays_nothing(family: SensorFamily):
    """Apart from the few pixels by which rims are displaced."""
    depth = box_before_wall()
    depth[:, 500:] = 0.0
    rng = np.random.default_rng(0)
    for _ in range(3):
        assert not measure(depth, CAMERA, rng, draw_sensor(family, rng))[:, 512:].any()


@pytest.mark.parametrize("family", FULL, ids=list(FAMILIES))
def test_errors_grow_with_distance_squared(family: SensorFamily):
    """Those that vary over the image, before they are rounded to what is stored."""
    sensor = dataclasses.replace(draw_sensor(family, np.random.default_rng(1)), unit=0.0, step=0.0)
    spread = []
    for z in (0.5, 1.0):
        depth = measure(wall(z), CAMERA, np.random.default_rng(2), sensor)
        spread.append(float(np.std(depth[depth > 0.0])))
    assert spread[1] / spread[0] == pytest.approx(4.0, rel=0.15)


@pytest.mark.parametrize("family", FULL, ids=list(FAMILIES))
def test_as_much_is_missing_as_the_kind_of_sensor_loses(family: SensorFamily):
    rng = np.random.default_rng(0)
    lost = [
        float((measure(wall(0.8), CAMERA, rng, draw_sensor(family, rng)) == 0).mean()) for _ in range(DRAWS)
    ]
    assert max(lost) < (0.75 if family.name == "line pattern" else 0.15)
    if family.name == "line pattern":
        assert min(lost) > 0.25


def test_the_sensors_differ_as_their_kinds_do():
    """Spread of the error on a wall at 0.8 m, metres: from the calmest to the wildest."""
    rng = np.random.default_rng(0)

    def spread(name: str) -> float:
        found = []
        for _ in range(5):
            depth = measure(wall(0.8), CAMERA, rng, draw_sensor(FAMILIES[name], rng))
            found.append(float(np.std(depth[depth > 0.0])))
        return float(np.median(found))

    assert spread("industrial") < 0.0005 < spread("structured light") < spread("active stereo") < 0.008
