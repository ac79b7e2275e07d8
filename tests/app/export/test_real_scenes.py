"""Exports of real scenes, labelled with their official poses."""

from collections.abc import Callable
from functools import cache
from pathlib import Path

import numpy as np
import pytest
from PIL import Image

from registration_core.bop.dataset import read_dataset
from registration_core.geometry import pose
from tests.app.export.labelled import labelled_export


@pytest.fixture(scope="module")
def exported(shared_data: Path, tmp_path_factory: pytest.TempPathFactory) -> Callable[[str], Path]:
    """The export of a scene, done once."""
    return cache(lambda name: labelled_export(shared_data / name, tmp_path_factory.mktemp(name)))


@pytest.mark.parametrize(("name", "tolerance"), [("ycbv", 1e-9), ("bunny", 0.02)])
def test_official_poses_come_back(
    name: str, tolerance: float, shared_data: Path, exported: Callable[[str], Path]
) -> None:
    """The bunny's images are one rigid world: the pose of its first image serves all of them."""
    source = read_dataset(shared_data / name)
    wanted, found = source.scenes[0], read_dataset(exported(name)).scenes[0]
    assert [image.image_id for image in found.images] == [image.image_id for image in wanted.images]
    for there, here in zip(wanted.images, found.images, strict=True):
        assert here.ground_truth is not None and there.ground_truth is not None
        assert [truth.obj_id for truth in here.ground_truth] == [truth.obj_id for truth in there.ground_truth]
        for official, truth in zip(there.ground_truth, here.ground_truth, strict=True):
            distance = pose.distance(official.T_camera_object, truth.T_camera_object)
            assert distance.translation < tolerance
        assert (here.T_world_camera is None) == (there.T_world_camera is None)
        assert here.depth.path.read_bytes() == there.depth.path.read_bytes()


def test_the_mug_is_a_quarter_hidden(exported: Callable[[str], Path]) -> None:
    scene = exported("ycbv") / "test/000001"
    masks = [
        np.asarray(Image.open(scene / kind / "000000_000001.png")) > 0 for kind in ("mask", "mask_visib")
    ]
    assert 0.7 < masks[1].sum() / masks[0].sum() < 0.85
