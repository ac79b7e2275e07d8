"""Which poses of a trace are snapped."""

from collections.abc import Sequence
from math import radians
from typing import cast

import numpy as np
import pytest

from app.study.offline.samples import Sample, SampledView
from app.study.offline.sampling import SAMPLINGS, Sampling
from registration_core.geometry import pose

VIEW = cast(SampledView, None)


def samples(*twists: Sequence[float], seconds: float = 0.5) -> list[Sample]:
    """One every half second."""
    return [Sample(1, seconds * i, pose.exp([*twist]), VIEW, f"{i:08x}") for i, twist in enumerate(twists)]


def along_x(*millimetres: float) -> list[Sample]:
    return samples(*([mm / 1000, 0, 0, 0, 0, 0] for mm in millimetres))


def about_z(*degrees: float) -> list[Sample]:
    return samples(*([0, 0, 0, 0, 0, radians(angle)] for angle in degrees))


def seconds_of(chosen: Sequence[Sample]) -> list[float]:
    return [sample.seconds for sample in chosen]


def test_with_the_default_all_poses_are_snapped():
    everything = along_x(*range(20))
    assert SAMPLINGS["default"].of(everything) == everything


def test_first_and_last_are_snapped_though_nothing_moved():
    assert seconds_of(Sampling(2.0, 0.005, 0.1).of(along_x(*[0] * 9))) == [0.0, 4.0]
    assert len(Sampling(2.0, 0.005, 0.1).of(along_x(0))) == 1


def test_poses_are_so_long_apart():
    assert seconds_of(Sampling(seconds=1.5).of(along_x(*range(9)))) == [0.0, 1.5, 3.0, 4.0]


def test_a_pose_counts_once_the_object_has_moved_or_turned_enough_since_the_last_one():
    sampling = Sampling(0.0, 0.005, radians(5))
    assert seconds_of(sampling.of(along_x(0, 2, 4, 6, 8, 10, 12, 12))) == [0.0, 1.5, 3.0, 3.5]
    assert seconds_of(sampling.of(about_z(0, 3, 6, 9, 12, 12))) == [0.0, 1.0, 2.0, 2.5]


def test_it_says_which_poses_it_chooses():
    assert f"{SAMPLINGS['paper']}" == "at least 2 s apart and moved by 5 mm or 5°"


@pytest.mark.parametrize("step", [0.5, 1 / 3])
def test_rounding_of_times_leaves_no_pose_out(step):
    times = seconds_of(Sampling(seconds=3 * step).of(samples(*np.zeros((13, 6)), seconds=step)))
    assert times == pytest.approx([0, 3 * step, 6 * step, 9 * step, 12 * step])
