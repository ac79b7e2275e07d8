"""A pose over time: between knots it moves evenly, and a jump is at once."""

import numpy as np
from hypothesis import given
from hypothesis import strategies as st

from app.analysis.trace.motion import MotionWriter
from app.labeling.moves.drag import _path_row
from registration_core.geometry import pose
from tests.app.analysis.hand_made import START, at


def test_it_rests_before_the_first_knot_and_after_the_last():
    writer = MotionWriter(START)
    writer.jump(2.0, at(0.1))
    motion = writer.motion()
    assert np.allclose(motion.at([-5.0, 0.0, 1.999, 2.0, 99.0])[:, 0, 3], [0, 0, 0, 0.1, 0.1])


def test_a_path_is_followed_evenly_in_place_and_turn():
    writer = MotionWriter(START)
    writer.follow(1.0, [[0.0, *_path_row(START)], [2.0, *_path_row(at(0.2, 1.0))]], at(0.2, 1.0))
    T = writer.motion().at([0.5, 1.0, 1.5, 2.0, 3.0, 4.0])
    assert np.allclose(T, [START, START, at(0.05, 0.25), at(0.1, 0.5), at(0.2, 1.0), at(0.2, 1.0)])


@given(st.floats(-3.0, 3.0), st.floats(0.0, 1.0))
def test_it_turns_the_short_way_and_stays_a_pose(turn, share):
    writer = MotionWriter(at(0.0, 2.0))
    writer.follow(0.0, [[1.0, *_path_row(at(0.0, 2.0 + turn))]], at(0.0, 2.0 + turn))
    (T,) = writer.motion().at([share])
    assert np.allclose(T, pose.orthonormalised(T))
    assert np.allclose(T, at(0.0, 2.0 + share * turn), atol=1e-5)


def test_knots_that_come_late_never_turn_time_back():
    writer = MotionWriter(START)
    writer.jump(5.0, at(0.1))
    writer.follow(4.0, [[0.0, *_path_row(at(0.1))], [3.0, *_path_row(at(0.2))]], at(0.2))
    motion = writer.motion()
    assert (np.diff(motion.seconds) >= 0).all()
    assert np.allclose(motion.at([7.0])[0], at(0.2))
