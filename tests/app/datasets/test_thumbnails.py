"""Small pictures of tasks."""

import io

import numpy as np
from PIL import Image

from app.datasets.thumbnails import INSET, INSET_BACKGROUND, PLAIN_SCENE, SIZE, object_picture, task_thumbnail
from tests.app.export.site import BLOCK, TOOL, mesh_of, model_of

TOOL_MODEL, BLOCK_MODEL = (model_of(mesh_of(obj_id)) for obj_id in (TOOL, BLOCK))


def decoded(content: bytes) -> np.ndarray:
    with Image.open(io.BytesIO(content)) as image:
        assert image.format == "JPEG"
        return np.asarray(image.convert("RGB"), dtype=int)


def test_it_shows_the_scene_and_the_object_in_the_corner():
    green = np.full((480, 640, 3), (0, 200, 0), dtype=np.uint8)
    picture = decoded(task_thumbnail(green, TOOL_MODEL))
    assert picture.shape == (SIZE[1], SIZE[0], 3)
    assert np.abs(picture[:100] - (0, 200, 0)).max() < 30
    corner = picture[-INSET:, -INSET:]
    assert (corner[..., 0] > 120).sum() > 300  # the object is orange
    plain = decoded(task_thumbnail(None, TOOL_MODEL))
    assert np.abs(plain[:100] - PLAIN_SCENE).max() < 10


def test_the_object_fills_its_picture_but_is_not_cut():
    for model in (TOOL_MODEL, BLOCK_MODEL):
        picture = object_picture(model, 96)
        inside = (picture != INSET_BACKGROUND).any(axis=-1)
        rows, columns = np.nonzero(inside)
        assert rows.min() >= 1 and rows.max() <= 94 and columns.min() >= 1 and columns.max() <= 94
        assert max(np.ptp(rows), np.ptp(columns)) > 60
        assert len(np.unique(picture[inside][:, 0])) > 2  # shaded: its faces can be told apart


def test_different_objects_look_different():
    assert not np.array_equal(object_picture(TOOL_MODEL, 96), object_picture(BLOCK_MODEL, 96))
