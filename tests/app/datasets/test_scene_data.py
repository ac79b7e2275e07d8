"""Pictures, depth, clouds and models out of the store."""

import logging

import numpy as np
import pytest
from PIL import Image
from sqlalchemy import select
from sqlalchemy.orm import joinedload

import app.datasets.scene_data
from app.datasets.importing import import_dataset
from app.datasets.scene_data import (
    PLAIN_COLOR,
    SceneData,
    camera_of,
    symmetries_from_json,
    symmetries_to_json,
)
from app.storage.tables import Frame, Object
from registration_core import Symmetries
from registration_core.bop.writer import write_depth_png
from registration_core.geometry import pose
from registration_core.geometry.camera import project
from registration_core.geometry.object_model import ContinuousSymmetry, discrete
from tests.app.export.site import observed_depth
from tests.app.small_dataset import CAMERA, NEAR_VIEW, SIDE_VIEW, TOOL


@pytest.fixture
def frames(database, files, demo) -> list[Frame]:
    import_dataset(database, files, demo)
    with database.read() as session:
        return list(session.scalars(select(Frame).options(joinedload(Frame.scene)).order_by(Frame.id)))


@pytest.fixture
def data(files) -> SceneData:
    return SceneData(files)


def test_depth_is_in_metres_and_cannot_be_written_to(data, frames):
    depth = data.depth(frames[0])
    assert depth == pytest.approx(observed_depth(NEAR_VIEW), abs=6e-5)
    assert data.depth(frames[0]) is depth
    with pytest.raises(ValueError, match="read-only"):
        depth[0, 0] = 1.0


def test_colour_is_handed_out_where_it_lies_on_the_depth(data, frames, files, tmp_path):
    frame = frames[0]
    color = data.aligned_color(frame)
    assert np.array_equal(color, data.color(frame)) and data.aligned_color(frame) is color
    with pytest.raises(ValueError, match="read-only"):
        color[0, 0] = 1
    for number, other in enumerate((np.roll(color, (30, 40), axis=(0, 1)), color[:-1])):
        path = tmp_path / f"{number}.png"
        Image.fromarray(other).save(path)
        frame.color_hash = files.put_file(path)
        assert data.aligned_color(frame) is None
    frame.color_hash = None
    assert data.aligned_color(frame) is None


def test_a_colour_image_that_cannot_be_read_is_gone_without(data, frames, files, tmp_path, caplog):
    damaged = tmp_path / "damaged.png"
    damaged.write_bytes(files.read(frames[0].color_hash)[:200])
    frames[0].color_hash = files.put_file(damaged)
    with caplog.at_level(logging.WARNING):
        assert data.aligned_color(frames[0]) is None
        assert data.aligned_color(frames[0]) is None
    (warning,) = caplog.messages  # one for however many snaps
    assert "is used without its colours" in warning and "replace the file" in warning
    assert data.depth(frames[0]).any()


def test_the_camera_is_the_frames(frames):
    assert camera_of(frames[0]) == CAMERA


def test_every_measured_pixel_is_a_point_of_the_cloud_at_its_place(data, frames):
    for frame, view in ((frames[0], NEAR_VIEW), (frames[1], SIDE_VIEW)):
        cloud = data.cloud(frame)
        depth, color = data.depth(frame), data.color(frame)
        rows, columns = np.nonzero(depth)
        assert len(cloud.points) == len(rows) > 10_000
        in_camera = pose.apply(pose.inverse(view), cloud.points)
        assert in_camera[:, 2] == pytest.approx(depth[rows, columns], abs=1e-5)
        assert project(in_camera, CAMERA) == pytest.approx(np.stack([columns, rows], axis=1), abs=0.02)
        assert np.array_equal(cloud.colors, color[rows, columns])
        assert cloud.points.dtype == np.float32


def test_too_many_points_are_thinned_out_evenly(data, frames, monkeypatch):
    whole = data.cloud(frames[0])
    monkeypatch.setattr(app.datasets.scene_data, "CLOUD_POINTS", 1000)
    thin = data.cloud(frames[0])
    assert len(thin.points) == len(thin.colors) == 1000
    assert np.array_equal(thin.points[[0, -1]], whole.points[[0, -1]])
    assert np.allclose(thin.points.mean(axis=0), whole.points.mean(axis=0), atol=0.02)


def test_without_colour_points_are_plain(data, frames):
    frame = frames[0]
    frame.color_hash = None
    assert data.color(frame) is None
    assert (data.cloud(frame).colors == PLAIN_COLOR).all()


def test_an_image_without_measurements_has_an_empty_cloud(data, files, frames, tmp_path):
    write_depth_png(tmp_path / "empty.png", np.zeros((240, 320)), 0.1)
    frame = frames[0]
    frame.depth_hash = files.put_file(tmp_path / "empty.png")
    cloud = data.cloud(frame)
    assert cloud.points.shape == (0, 3) and cloud.colors.shape == (0, 3)


def test_models_are_in_metres_and_kept(data, database, frames):
    with database.read() as session:
        row = session.scalars(select(Object).where(Object.obj_id == TOOL)).one()
    model = data.model(row)
    assert model.diameter == pytest.approx(row.diameter) and 0.05 < model.diameter < 0.2
    assert model.content_hash == row.model_hash
    assert data.model(row) is model


def test_symmetries_go_to_json_and_back():
    half_turn = pose.exp([0.01, 0.0, 0.0, 0.0, 0.0, np.pi])
    symmetries = Symmetries(
        discrete([half_turn]).discrete, (ContinuousSymmetry((0.0, 0.0, 1.0), (0.1, 0.2, 0.3)),)
    )
    assert symmetries_from_json(symmetries_to_json(symmetries)) == symmetries
    assert symmetries_from_json({}) == Symmetries()
