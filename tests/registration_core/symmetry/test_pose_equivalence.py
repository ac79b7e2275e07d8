"""Two poses are one where a snap would call both right."""

import numpy as np
import pytest

from registration_core.geometry import pose
from registration_core.geometry.object_model import Symmetries
from registration_core.symmetry.pose_equivalence import same_pose_of
from tests.registration_core.simple_scene import block, model_of

HALF_TURN = pose.exp([0, 0, 0, 0, 0, np.pi])
AT = pose.exp([0.1, -0.2, 0.9, 0.3, 0.8, -0.4])


@pytest.mark.parametrize(("share", "expected"), [(0.04, True), (0.06, False)])
def test_up_to_five_percent_of_the_diameter_two_poses_are_the_same(share, expected):
    model = model_of(block((0.3, 0.2, 0.1)))
    moved = AT @ pose.exp([share * model.diameter, 0, 0, 0, 0, 0])
    assert same_pose_of(model)(moved, AT) is expected


def test_poses_that_a_symmetry_leads_into_each_other_are_the_same():
    parts, half_turn = block((0.3, 0.2, 0.1)), tuple(map(tuple, HALF_TURN.tolist()))
    symmetric = model_of(parts, symmetries=Symmetries(discrete=(half_turn,)))
    assert same_pose_of(symmetric)(AT @ HALF_TURN, AT)
    assert not same_pose_of(model_of(parts))(AT @ HALF_TURN, AT)
