"""Projection and back, crops, and what is refused as a camera."""

import numpy as np
import pytest
from hypothesis import given
from hypothesis import strategies as st

from registration_core import Intrinsics
from registration_core.geometry.camera import depth_to_points, project

CAMERA = Intrinsics(64, 48, 60.0, 58.0, 31.2, 24.9)


def test_points_of_a_depth_image_project_onto_their_pixels() -> None:
    depth = np.random.default_rng(0).uniform(0.3, 2.0, (48, 64)).astype(np.float32)
    pixels = project(depth_to_points(depth, CAMERA), CAMERA)
    columns, rows = np.meshgrid(np.arange(64), np.arange(48))
    np.testing.assert_allclose(pixels, np.stack([columns, rows], axis=-1), atol=1e-4)


def test_unmeasured_pixels_become_the_origin() -> None:
    assert not depth_to_points(np.zeros((48, 64), np.float32), CAMERA).any()


def test_the_optical_axis_meets_the_principal_point() -> None:
    np.testing.assert_allclose(project([0.0, 0.0, 3.0], CAMERA), [31.2, 24.9])


@given(st.integers(-20, 60), st.integers(-20, 40))
def test_a_crop_sees_the_same_points_shifted(left, top) -> None:
    point = np.array([0.1, -0.2, 1.5])
    cropped = CAMERA.cropped(left, top, 10, 12)
    assert (cropped.width, cropped.height) == (10, 12)
    np.testing.assert_allclose(project(point, cropped), project(point, CAMERA) - [left, top], atol=1e-12)


def test_matrix_and_back() -> None:
    assert Intrinsics.from_matrix(CAMERA.matrix, 64, 48) == CAMERA
    assert Intrinsics.from_matrix(CAMERA.matrix.ravel().tolist(), 64, 48) == CAMERA


@pytest.mark.parametrize(
    ("values", "what"),
    [
        ((0, 48, 60.0, 60.0, 32.0, 24.0), "size"),
        ((64, -1, 60.0, 60.0, 32.0, 24.0), "size"),
        ((64, 48, 0.0, 60.0, 32.0, 24.0), "focal"),
        ((64, 48, 60.0, -1.0, 32.0, 24.0), "focal"),
        ((64, 48, np.nan, 60.0, 32.0, 24.0), "finite"),
        ((64, 48, 60.0, 60.0, np.inf, 24.0), "finite"),
    ],
)
def test_impossible_cameras_are_refused(values, what) -> None:
    with pytest.raises(ValueError, match=f"camera.*{what}"):
        Intrinsics(*values)


def test_matrix_of_eight_numbers_is_refused() -> None:
    with pytest.raises(ValueError, match="9 numbers"):
        Intrinsics.from_matrix(np.arange(8.0), 64, 48)


def test_matrix_with_skew_is_refused() -> None:
    K = CAMERA.matrix
    K[0, 1] = 1.0
    with pytest.raises(ValueError, match="skew"):
        Intrinsics.from_matrix(K, 64, 48)
