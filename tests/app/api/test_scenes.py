"""Scenes and frames are handed out as they were imported."""

import io
from pathlib import Path

import httpx
import numpy as np
import pytest
from PIL import Image

from app.datasets.importing import import_dataset
from registration_core.bop.dataset import read_color
from tests.app.live import LiveServer
from tests.app.rest import sentence
from tests.app.small_dataset import CAMERA, NEAR_VIEW, POSED_SCENE, SIDE_VIEW


@pytest.fixture
def scenes(operator: httpx.Client) -> list[dict]:
    return operator.get("/api/scenes?dataset_id=1").json()["items"]


def test_a_scene_tells_its_frames_and_cameras(scenes: list[dict], operator: httpx.Client) -> None:
    posed, unposed = scenes
    assert (posed["split"], posed["bop_scene_id"], posed["label"]) == ("test", 1, "scene 1")
    assert unposed["label"] == "scene 2 › frame 0"
    assert [frame["image_id"] for frame in posed["frames"]] == [0, 5]
    for frame, T_world_camera in zip(posed["frames"], (NEAR_VIEW, SIDE_VIEW), strict=True):
        assert (frame["width"], frame["height"]) == (CAMERA.width, CAMERA.height)
        assert frame["intrinsics"] == {"fx": CAMERA.fx, "fy": CAMERA.fy, "cx": CAMERA.cx, "cy": CAMERA.cy}
        assert np.allclose(frame["T_world_camera"], T_world_camera, atol=1e-6)
    assert unposed["frames"][0]["T_world_camera"] == np.eye(4).tolist()
    assert operator.get(f"/api/scenes/{posed['id']}").json() == posed


def test_pictures_are_the_bytes_that_were_imported(
    scenes: list[dict], operator: httpx.Client, demo: Path
) -> None:
    for frame in scenes[0]["frames"]:
        for url, folder in ((frame["color_url"], "rgb"), (frame["depth_url"], "depth")):
            answer = operator.get(url)
            assert answer.headers["content-type"] == "image/png"
            assert "private" in answer.headers["cache-control"]
            assert (
                answer.content == (demo / POSED_SCENE / folder / f"{frame['image_id']:06d}.png").read_bytes()
            )


def test_depth_is_16_bit_in_millimetres_when_scaled_and_judged_in_metres(
    scenes: list[dict], operator: httpx.Client
) -> None:
    frame = scenes[0]["frames"][0]
    with Image.open(io.BytesIO(operator.get(frame["depth_url"]).content)) as image:
        assert image.mode.startswith("I;16")
        raw = np.asarray(image)
    assert 300 < np.median(raw[raw > 0]) * frame["depth_scale"] < 1000
    assert frame["depth_tolerance"] == 0.005


def test_raw_depth_is_the_picture_for_those_who_cannot_read_16_bit(
    scenes: list[dict], operator: httpx.Client
) -> None:
    frame = scenes[0]["frames"][0]
    answer = operator.get(frame["raw_depth_url"])
    assert "private" in answer.headers["cache-control"]
    with Image.open(io.BytesIO(operator.get(frame["depth_url"]).content)) as image:
        raw = np.frombuffer(answer.content, "<u2").reshape(frame["height"], frame["width"])
        assert np.array_equal(raw, np.asarray(image))


def test_a_jpeg_comes_as_png_and_a_missing_picture_is_said(
    server: LiveServer, operator: httpx.Client, demo_copy: Path
) -> None:
    rgb = demo_copy / POSED_SCENE / "rgb"
    with Image.open(rgb / "000000.png") as image:
        image.convert("RGB").save(rgb / "000000.jpg")
    (rgb / "000000.png").unlink()
    (rgb / "000005.png").unlink()
    summary = import_dataset(server.services.database, server.services.files, demo_copy, "other pictures")
    scene = operator.get(f"/api/scenes?dataset_id={summary.dataset_id}").json()["items"][0]
    jpeg, none = scene["frames"]
    answer = operator.get(jpeg["color_url"])
    assert answer.headers["content-type"] == "image/png"
    with Image.open(io.BytesIO(answer.content)) as image:
        assert image.format == "PNG"
        assert np.array_equal(np.asarray(image), read_color(rgb / "000000.jpg"))
    assert none["color_url"] is None
    assert "no colour image" in sentence(operator.get(f"/api/frames/{none['id']}/color.png"), 404)


def test_lists_come_in_pages(operator: httpx.Client) -> None:
    everything = operator.get("/api/scenes?dataset_id=1").json()
    assert everything["next"] is None
    first = operator.get("/api/scenes?dataset_id=1&limit=1").json()
    assert first["items"] == everything["items"][:1]
    second = operator.get(f"/api/scenes?dataset_id=1&limit=1&after={first['next']}").json()
    assert second == {"items": everything["items"][1:], "next": None}
    assert operator.get("/api/scenes?dataset_id=999").json() == {"items": [], "next": None}


@pytest.mark.parametrize("url", ["scenes/999", "frames/999/color.png", "frames/999/depth.png"])
def test_what_does_not_exist_is_said(operator: httpx.Client, url: str) -> None:
    assert "999" in sentence(operator.get(f"/api/{url}"), 404)


def test_a_damaged_picture_is_said_by_its_name_and_not_handed_out(
    server: LiveServer, scenes: list[dict], operator: httpx.Client, demo: Path
) -> None:
    frame = scenes[0]["frames"][1]
    digest = server.services.files.put_file(demo / POSED_SCENE / "depth/000005.png")
    path = server.services.files.path(digest)
    whole = path.read_bytes()
    path.write_bytes(whole[:-5] + b"wrong")
    try:
        for url in (frame["depth_url"], frame["raw_depth_url"]):
            message = sentence(operator.get(url), 500)
            assert message.startswith("the depth image of image 5 in scene 1 of dataset 'tools' is damaged")
            assert message.endswith("import dataset 'tools' again, which puts it back.")
    finally:
        path.write_bytes(whole)
    assert operator.get(frame["depth_url"]).content == whole
