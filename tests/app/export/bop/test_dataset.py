"""What an export holds, read back by the BOP reader and by hand."""

import json

import numpy as np
import pytest
from PIL import Image

from app.export.bop.coco import mask_from_run_lengths
from app.export.gate.raycasting import RayCaster
from app.storage.tables import Frame, Object
from registration_core.bop.dataset import BopDataset, BopImage, read_dataset, read_depth
from registration_core.geometry import pose
from tests.app.export.site import (
    BLOCK,
    HALF_TURN,
    POSED,
    POSED_VIEWS,
    TOOL,
    UNPOSED,
    UNPOSED_VIEWS,
    ExportedSite,
    true_pose,
)


@pytest.fixture(scope="module")
def dataset(exported: ExportedSite) -> BopDataset:
    return read_dataset(exported.root)


def load(exported: ExportedSite, name: str) -> dict:
    return json.loads((exported.root / name).read_text())


def labelled_images(dataset: BopDataset) -> list[tuple[str, np.ndarray, BopImage]]:
    """Each image with the label of its world in the database and its camera's pose there."""
    first, second = dataset.scenes
    images = [(POSED, POSED_VIEWS[image.image_id], image) for image in first.images]
    return images + [(UNPOSED[image.image_id], np.eye(4), image) for image in second.images]


def test_ground_truth_is_what_was_submitted(dataset: BopDataset) -> None:
    for label, T_world_camera, image in labelled_images(dataset):
        assert image.ground_truth is not None
        for truth in image.ground_truth:
            wanted = pose.inverse(T_world_camera) @ true_pose(label, truth.obj_id)
            np.testing.assert_allclose(truth.T_camera_object, wanted, atol=1e-12)


def test_translations_are_millimetres_from_model_to_camera(exported: ExportedSite) -> None:
    entry = load(exported, "test/000001/scene_gt.json")["0"][0]
    T = pose.inverse(POSED_VIEWS[0]) @ true_pose(POSED, TOOL)
    np.testing.assert_allclose(entry["cam_t_m2c"], 1000 * T[:3, 3])
    np.testing.assert_allclose(entry["cam_R_m2c"], T[:3, :3].ravel())
    assert 400 < np.linalg.norm(entry["cam_t_m2c"]) < 600


def test_camera_poses_are_world_to_camera_and_only_where_they_are_known(exported: ExportedSite) -> None:
    for image_id, entry in load(exported, "test/000001/scene_camera.json").items():
        T_camera_world = pose.inverse(POSED_VIEWS[int(image_id)])
        np.testing.assert_allclose(np.reshape(entry["cam_R_w2c"], (3, 3)), T_camera_world[:3, :3])
        np.testing.assert_allclose(entry["cam_t_w2c"], 1000 * T_camera_world[:3, 3])
    unposed = load(exported, "test/000002/scene_camera.json")
    assert set(unposed) == {"0", "4"} == {str(image_id) for image_id in UNPOSED_VIEWS}
    assert all("cam_R_w2c" not in entry and "cam_t_w2c" not in entry for entry in unposed.values())


def test_objects_behind_the_camera_have_no_entry_and_those_beside_the_image_have(
    exported: ExportedSite,
) -> None:
    truths = load(exported, "test/000001/scene_gt.json")
    assert truths["7"] == []
    assert [truth["obj_id"] for truth in truths["6"]] == [TOOL, BLOCK]
    for info in load(exported, "test/000001/scene_gt_info.json")["6"]:
        assert info["px_count_visib"] == 0
        assert info["bbox_visib"] == info["bbox_obj"] == [-1, -1, -1, -1]


def test_masks_are_what_another_renderer_draws(exported: ExportedSite, dataset: BopDataset) -> None:
    caster = RayCaster(dataset.objects)
    for _, _, image in labelled_images(dataset):
        folder = image.depth.path.parents[1]
        observed = read_depth(image.depth.path, image.depth_scale)
        assert image.ground_truth is not None
        for index, truth in enumerate(image.ground_truth):
            name = f"{image.image_id:06d}_{index:06d}.png"
            rendered = caster.depth(truth.obj_id, image.camera, truth.T_camera_object)
            mask = np.asarray(Image.open(folder / "mask" / name))
            assert mask.dtype == np.uint8 and set(np.unique(mask)) <= {0, 255}
            assert np.count_nonzero((mask > 0) != (rendered > 0)) <= 4
            visible = np.asarray(Image.open(folder / "mask_visib" / name)) > 0
            wanted = (rendered > 0) & ((observed == 0) | (rendered <= observed + 0.015))
            assert np.count_nonzero(visible != wanted) <= 6


def test_an_occluder_without_a_model_hides(exported: ExportedSite) -> None:
    tool, block = load(exported, "test/000001/scene_gt_info.json")["0"]
    assert 0.3 < tool["visib_fract"] < 0.9
    assert block["visib_fract"] > 0.95
    assert tool["px_count_valid"] < tool["px_count_all"]  # the sensor's hole lies on it


def test_masks_are_there_for_each_entry_and_nothing_else(exported: ExportedSite) -> None:
    for scene in ("test/000001", "test/000002"):
        truths = load(exported, f"{scene}/scene_gt.json")
        names = {f"{int(i):06d}_{k:06d}.png" for i, entries in truths.items() for k in range(len(entries))}
        for kind in ("mask", "mask_visib"):
            assert {path.name for path in (exported.root / scene / kind).iterdir()} == names


def test_images_and_meshes_are_the_stored_bytes(exported: ExportedSite, dataset: BopDataset) -> None:
    site = exported.site
    with site.database.read() as session:
        meshes = {row.obj_id: row.mesh_hash for row in session.query(Object)}
        depths = {row.depth_hash for row in session.query(Frame)}
    for found in dataset.objects:
        assert found.mesh_path.read_bytes() == site.files.read(meshes[found.obj_id])
    for _, _, image in labelled_images(dataset):
        assert site.files.put_file(image.depth.path) in depths


def test_the_pictures_of_a_scene_lie_together(exported: ExportedSite) -> None:
    pictures = {
        path.relative_to(exported.root).as_posix()
        for path in exported.root.rglob("*")
        if path.parent.name in {"rgb", "gray"}
    }
    assert pictures == {
        "test/000001/rgb/000000.png",
        "test/000001/rgb/000005.png",
        "test/000002/rgb/000000.png",
        "test/000002/rgb/000004.jpg",
    }


def test_models_info_has_millimetres_and_the_authored_symmetries(
    exported: ExportedSite, dataset: BopDataset
) -> None:
    infos = load(exported, "models/models_info.json")
    assert infos == load(exported, "models_eval/models_info.json")
    block = infos[str(BLOCK)]
    np.testing.assert_allclose(block["diameter"], np.sqrt(40**2 + 60**2 + 60**2))
    np.testing.assert_allclose([block["min_x"], block["size_x"]], [-20, 40])
    np.testing.assert_allclose(block["symmetries_discrete"], [HALF_TURN.ravel()], atol=1e-12)
    assert "symmetries_discrete" not in infos[str(TOOL)]
    assert {found.obj_id: found.name for found in dataset.objects} == {TOOL: "angle tool", BLOCK: "block"}
    assert [len(found.model.symmetries.discrete) for found in dataset.objects] == [0, 1]


def test_coco_holds_the_visible_masks(exported: ExportedSite) -> None:
    folder = exported.root / "test/000001"
    coco = load(exported, "test/000001/scene_gt_coco.json")
    assert [image["id"] for image in coco["images"]] == [0, 5, 6, 7, 8]
    assert [(found["image_id"], found["category_id"]) for found in coco["annotations"]] == [
        (0, TOOL), (0, BLOCK), (5, TOOL), (5, BLOCK), (8, TOOL), (8, BLOCK),
    ]  # fmt: skip
    mask = np.asarray(Image.open(folder / "mask_visib" / "000000_000000.png")) > 0
    found = coco["annotations"][0]
    np.testing.assert_array_equal(mask_from_run_lengths(found["segmentation"]), mask)
    assert found["area"] == mask.sum()


def test_targets_are_what_can_be_seen(exported: ExportedSite) -> None:
    targets = json.loads((exported.root / "test_targets_bop19.json").read_text())
    seen = [(target["scene_id"], target["im_id"], target["obj_id"]) for target in targets]
    assert seen == [(1, i, o) for i in (0, 5, 8) for o in (TOOL, BLOCK)] + [
        (2, i, o) for i in (0, 4) for o in (TOOL, BLOCK)
    ]
    assert all(target["inst_count"] == 1 for target in targets)


def test_the_first_camera_stands_for_the_dataset(exported: ExportedSite) -> None:
    camera = load(exported, "camera.json")
    assert (camera["fx"], camera["width"], camera["depth_scale"]) == (300.0, 320, 0.1)


def test_dataset_info_tells_what_is_in_it(exported: ExportedSite) -> None:
    text = (exported.root / "dataset_info.md").read_text()
    assert "# Two boxes / v1" in text
    assert "2 scenes, 7 images, 6 annotated object instances" in text
    assert "| 3 | angle tool | 3 |" in text
    assert "None: every annotation is the only one submitted." in text
