"""What an estimate says of its own pose, against drawn poses."""

from dataclasses import dataclass, field
from typing import Any

import numpy as np
import pytest
from scipy.spatial.transform import Rotation

from app.confidence.uncertainty import REACH, uncertainty_of
from registration_core.geometry import pose

T_WORLD_CAMERA = pose.exp([0.3, -0.2, 0.5, 0.4, -1.1, 0.7])
T_CAMERA_OBJECT = pose.exp([0.05, 0.1, 0.8, -0.3, 0.9, 0.2])
CENTRE = np.array([0.1, -0.05, 0.2])
SIDES = np.array([0.1, 0.2, 0.3])
"""Of the bounding box, metres."""


@dataclass
class Told:
    """An estimate."""

    covariance: list[Any]
    ambiguities: list[Any] | None = field(default_factory=list)
    T_world_object: list[list[float]] = field(default_factory=(T_WORLD_CAMERA @ T_CAMERA_OBJECT).tolist)


def random_covariance() -> np.ndarray:
    root = np.random.default_rng(1).normal(size=(6, 6)) * np.repeat([0.002, 0.01], 3)[:, None]
    return root @ root.T


def test_the_ellipsoid_holds_95_percent_of_where_the_middle_may_be():
    covariance = random_covariance()
    known = uncertainty_of(Told(covariance.tolist()), T_WORLD_CAMERA, CENTRE, SIDES)
    drawn = np.random.default_rng(2).multivariate_normal(np.zeros(6), covariance, size=20_000)
    moved = np.repeat(T_CAMERA_OBJECT[None], len(drawn), axis=0)
    moved[:, :3, 3] += drawn[:, :3]
    moved[:, :3, :3] = Rotation.from_rotvec(drawn[:, 3:]).as_matrix() @ moved[:, :3, :3]
    middles = (T_WORLD_CAMERA @ moved @ [*CENTRE, 1.0])[:, :3]
    assert known.centre == pytest.approx(pose.apply(T_WORLD_CAMERA @ T_CAMERA_OBJECT, CENTRE))
    inside = np.linalg.norm(np.linalg.solve(known.ellipsoid, (middles - known.centre).T), axis=0) < 1.0
    assert inside.mean() == pytest.approx(0.95, abs=0.01)
    assert known.translation == np.linalg.norm(known.ellipsoid, axis=0).max()


def test_a_plain_covariance_gives_a_ball():
    covariance = np.diag([4e-6] * 3 + [1e-4] * 3)
    known = uncertainty_of(Told(covariance.tolist()), T_WORLD_CAMERA, np.zeros(3), SIDES)
    assert np.allclose(np.linalg.norm(known.ellipsoid, axis=0), REACH * 0.002)
    assert known.rotation == pytest.approx(REACH * 0.01)


def test_a_rotation_is_never_off_by_more_than_half_a_turn():
    assert uncertainty_of(Told(np.eye(6).tolist()), T_WORLD_CAMERA, CENTRE, SIDES).rotation <= np.pi


def test_what_depth_cannot_tell_is_told_in_the_world():
    told = [
        {"kind": "free motion", "motion": "turn", "axis": [0.0, 0.0, 1.0], "extent": 0.2},
        {"kind": "free motion", "motion": "turn", "axis": [0.0, 0.0, 1.0], "extent": 3.0},
        {"kind": "other mode", "motion": "shift", "axis": [1.0, 0.0, 0.0], "extent": 0.03},
    ]
    turn, any_turn, shift = uncertainty_of(
        Told(np.eye(6).tolist(), told), T_WORLD_CAMERA, CENTRE, SIDES
    ).unknown
    rotation = (T_WORLD_CAMERA @ T_CAMERA_OBJECT)[:3, :3]
    assert turn.axis == pytest.approx(rotation[:, 2])
    assert turn.extent == pytest.approx(1.96 * 0.2, rel=1e-3)  # from a standard deviation to 95 %
    assert any_turn.extent == np.pi
    assert (turn.axis_name, shift.axis_name) == ("the long axis", "the short axis")
    assert (shift.kind, shift.extent) == ("other mode", 0.03)


def test_older_estimates_name_no_ambiguity():
    assert uncertainty_of(Told(np.eye(6).tolist(), None), T_WORLD_CAMERA, CENTRE, SIDES).unknown == ()
