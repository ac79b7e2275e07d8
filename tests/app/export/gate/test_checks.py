"""The gate passes a sound export and finds each way to spoil one."""

import json
from collections.abc import Callable
from pathlib import Path
from typing import Any

import numpy as np
import pytest
from PIL import Image

from app.export.gate.checks import check_export
from app.export.gate.instance import GateError
from registration_core.geometry import pose
from tests.app.export.site import POSED_VIEWS, ExportedSite, ignore_progress

SCENE = "test/000001"


def edit(path: Path, change: Callable[[Any], object]) -> None:
    """Change a JSON file."""
    content = json.loads(path.read_text())
    change(content)
    path.write_text(json.dumps(content))


def entry(root: Path, image: str, index: int, change: Callable[[dict[str, Any]], None]) -> None:
    """Change an entry of `scene_gt.json`."""
    edit(root / SCENE / "scene_gt.json", lambda content: change(content[image][index]))


def pose_of(entry: dict[str, Any], kind: str) -> np.ndarray:
    """The pose of an entry, millimetres; kind is "m2c" or "w2c"."""
    R = np.reshape(entry[f"cam_R_{kind}"], (3, 3))
    return pose.from_rotation_translation(R, entry[f"cam_t_{kind}"])


def put_pose(entry: dict[str, Any], kind: str, T: np.ndarray) -> None:
    """Write a pose in millimetres into an entry."""
    entry[f"cam_R_{kind}"] = T[:3, :3].ravel().tolist()
    entry[f"cam_t_{kind}"] = T[:3, 3].tolist()


def invert(entry: dict[str, Any], kind: str) -> None:
    put_pose(entry, kind, pose.inverse(pose_of(entry, kind)))


def in_metres(entry: dict[str, Any], kind: str) -> None:
    entry[f"cam_t_{kind}"] = [value / 1000 for value in entry[f"cam_t_{kind}"]]


def move(entry: dict[str, Any], millimetres: float) -> None:
    entry["cam_t_m2c"][0] += millimetres


def swap_masks(root: Path, kind: str) -> None:
    first, second = (root / SCENE / kind / f"000000_00000{index}.png" for index in (0, 1))
    kept = first.read_bytes()
    first.write_bytes(second.read_bytes())
    second.write_bytes(kept)


def blind_visible_mask(root: Path) -> None:
    """Make the visible mask of an occluded object its whole silhouette, and the numbers fit."""
    folder = root / SCENE
    whole = (folder / "mask" / "000000_000000.png").read_bytes()
    (folder / "mask_visib" / "000000_000000.png").write_bytes(whole)


def scene_file(root: Path, name: str) -> Path:
    return root / SCENE / name


def lose_image(root: Path) -> None:
    edit(scene_file(root, "scene_camera.json"), lambda c: c.pop("5"))
    edit(scene_file(root, "scene_gt.json"), lambda c: c.pop("5"))


Sabotage = Callable[[Path], object]

SABOTAGES: dict[str, tuple[Sabotage, str]] = {
    "w2c inverted": (
        lambda root: edit(scene_file(root, "scene_camera.json"), lambda c: invert(c["5"], "w2c")),
        r"^test/000001, image 5: cam_R_w2c and cam_t_w2c .*: they hold the inverse$",
    ),
    "w2c in metres": (
        lambda root: edit(scene_file(root, "scene_camera.json"), lambda c: in_metres(c["5"], "w2c")),
        r"^test/000001, image 5: cam_R_w2c and cam_t_w2c .*: the translation is in metres$",
    ),
    "w2c missing": (
        lambda root: edit(
            scene_file(root, "scene_camera.json"), lambda c: [c["5"].pop(f"cam_{x}_w2c") for x in "Rt"]
        ),
        r"^test/000001, image 5: cam_R_w2c and cam_t_w2c must be written just where",
    ),
    "w2c made up": (
        lambda root: edit(
            root / "test/000002/scene_camera.json", lambda c: put_pose(c["4"], "w2c", np.eye(4))
        ),
        r"^test/000002, image 4: cam_R_w2c and cam_t_w2c must be written just where",
    ),
    "m2c inverted": (
        lambda root: entry(root, "5", 1, lambda e: invert(e, "m2c")),
        r"^test/000001, image 5, object 7 \(entry 1\): cam_R_m2c and cam_t_m2c .*: they hold the inverse$",
    ),
    "m2c in metres": (
        lambda root: entry(root, "5", 1, lambda e: in_metres(e, "m2c")),
        r"^test/000001/scene_gt.json: image 5, entry 1: cam_t_m2c .* write translations in millimetres$",
    ),
    "m2c 1 mm off": (
        lambda root: entry(root, "0", 0, lambda e: move(e, 1.0)),
        r"image 0, object 3 \(entry 0\): .* are 1 mm and .* off the database's pose: they hold another pose",
    ),
    "entries swapped": (
        lambda root: edit(scene_file(root, "scene_gt.json"), lambda c: c["0"].reverse()),
        r"image 0, object 7 \(entry 0\): obj_id is 7, in the database 3",
    ),
    "wrong obj_id": (
        lambda root: entry(root, "5", 0, lambda e: e.update(obj_id=7)),
        r"image 5, object 7 \(entry 0\): obj_id is 7, in the database 3",
    ),
    "obj_id as position in a list": (
        lambda root: entry(root, "5", 0, lambda e: e.update(obj_id=0)),
        r"scene_gt.json: image 5, entry 0: obj_id 0 is unknown",
    ),
    "an entry lost": (
        lambda root: edit(scene_file(root, "scene_gt.json"), lambda c: c["0"].pop()),
        r"image 0: scene_gt.json has 1 objects, the database 2",
    ),
    "an image lost": (
        lose_image,
        r"test/000001, image 5 is missing",
    ),
    "masks swapped": (
        lambda root: swap_masks(root, "mask"),
        r"image 0, object 3 \(entry 0\): mask is not what the pose in scene_gt.json renders to",
    ),
    "visible masks swapped": (
        lambda root: swap_masks(root, "mask_visib"),
        r"image 0, object 3 \(entry 0\): mask_visib reaches outside of mask",
    ),
    "mask missing": (
        lambda root: (root / SCENE / "mask" / "000005_000001.png").unlink(),
        r"image 5, object 7 \(entry 1\): mask/000005_000001.png is missing",
    ),
    "visible mask missing": (
        lambda root: (root / SCENE / "mask_visib" / "000005_000001.png").unlink(),
        r"image 5, object 7 \(entry 1\): mask_visib/000005_000001.png is missing",
    ),
    "a mask too many": (
        lambda root: Image.new("L", (320, 240)).save(root / SCENE / "mask" / "000000_000002.png"),
        r"test/000001/mask/000000_000002.png belongs to no entry",
    ),
    "a mask of another size": (
        lambda root: Image.new("L", (32, 24)).save(root / SCENE / "mask" / "000000_000001.png"),
        r"object 7 \(entry 1\): mask/000000_000001.png has shape \(24, 32\)",
    ),
    "a broken mask": (
        lambda root: (root / SCENE / "mask" / "000000_000001.png").write_bytes(b"no picture"),
        r"object 7 \(entry 1\): mask/000000_000001.png cannot be decoded",
    ),
    "visible mask blind to an occluder": (
        blind_visible_mask,
        r"image 0, object 3 \(entry 0\): mask_visib is not what the pose in scene_gt.json renders to",
    ),
    "info counts": (
        lambda root: edit(
            scene_file(root, "scene_gt_info.json"), lambda c: c["0"][1].update(px_count_visib=3)
        ),
        r"image 0, object 7 \(entry 1\): px_count_visib in scene_gt_info.json is 3",
    ),
    "info order": (
        lambda root: edit(scene_file(root, "scene_gt_info.json"), lambda c: c["0"].reverse()),
        r"image 0, object 3 \(entry 0\): px_count_visib in scene_gt_info.json",
    ),
    "info of the part inside the image only": (
        lambda root: edit(
            scene_file(root, "scene_gt_info.json"),
            lambda c: c["8"][1].update(px_count_all=c["8"][1]["px_count_visib"], visib_fract=1.0),
        ),
        r"image 8, object 7 \(entry 1\): px_count_all in scene_gt_info.json is",
    ),
    "box of the part inside the image only": (
        lambda root: edit(
            scene_file(root, "scene_gt_info.json"),
            lambda c: c["8"][1].update(bbox_obj=c["8"][1]["bbox_visib"]),
        ),
        r"image 8, object 7 \(entry 1\): bbox_obj in scene_gt_info.json is \[0, ",
    ),
    "box of what is not visible": (
        lambda root: edit(
            scene_file(root, "scene_gt_info.json"), lambda c: c["6"][0].update(bbox_obj=[0, 0, 5, 5])
        ),
        r"image 6, object 3 \(entry 0\): bbox_obj in scene_gt_info.json is \[0, 0, 5, 5\]",
    ),
    "info entry lost": (
        lambda root: edit(scene_file(root, "scene_gt_info.json"), lambda c: c["0"].pop()),
        r"image 0: scene_gt_info.json has 1 entries, scene_gt.json 2",
    ),
    "info lost": (
        lambda root: scene_file(root, "scene_gt_info.json").unlink(),
        r"000001/scene_gt_info.json cannot be read",
    ),
    "coco mask": (
        lambda root: edit(
            scene_file(root, "scene_gt_coco.json"),
            lambda c: c["annotations"][0].update(segmentation=c["annotations"][1]["segmentation"]),
        ),
        r"image 0, object 3 \(entry 0\): its mask in scene_gt_coco.json differs from mask_visib",
    ),
    "coco category": (
        lambda root: edit(
            scene_file(root, "scene_gt_coco.json"), lambda c: c["annotations"][0].update(category_id=1)
        ),
        r"image 0, object 3 \(entry 0\): category_id in scene_gt_coco.json is 1",
    ),
    "coco entry lost": (
        lambda root: edit(scene_file(root, "scene_gt_coco.json"), lambda c: c["annotations"].pop(1)),
        r"image 0, object 7 \(entry 1\): scene_gt_coco.json has no entry",
    ),
    "coco entry doubled": (
        lambda root: edit(
            scene_file(root, "scene_gt_coco.json"), lambda c: c["annotations"].append(c["annotations"][0])
        ),
        r"image 0: scene_gt_coco.json has more instances",
    ),
    "object without info": (
        lambda root: edit(root / "models" / "models_info.json", lambda c: c.pop("7")),
        r"models/models_info.json: object 7 is missing",
    ),
    "object without evaluation mesh": (
        lambda root: (root / "models_eval" / "obj_000007.ply").unlink(),
        r"models_eval/obj_000007.ply of object 7 is missing",
    ),
    "target that is not there": (
        lambda root: edit(
            root / "test_targets_bop19.json",
            lambda c: c.append({"scene_id": 1, "im_id": 7, "obj_id": 3, "inst_count": 1}),
        ),
        r"scene 1, image 7, object 3: 1 instances asked for, 0 there",
    ),
    "depth of another scale": (
        lambda root: edit(scene_file(root, "scene_camera.json"), lambda c: c["0"].update(depth_scale=0.11)),
        r"image 0, object 3 \(entry 0\): ",
    ),
}


def test_a_sound_export_passes(exported: ExportedSite) -> None:
    shares: list[float] = []
    check_export(exported.root, exported.expected, lambda share, message: shares.append(share))
    assert shares == sorted(shares) and shares[0] > 0.0 and shares[-1] <= 1.0


@pytest.mark.parametrize("name", SABOTAGES)
def test_sabotage_is_found_and_named(name: str, exported: ExportedSite, export_copy: Path) -> None:
    sabotage, message = SABOTAGES[name]
    sabotage(export_copy)
    with pytest.raises(GateError, match=message):
        check_export(export_copy, exported.expected, ignore_progress)


def test_cameras_and_objects_moved_together_are_found(exported: ExportedSite, export_copy: Path) -> None:
    """Inverted camera poses with object poses that compose to the right world poses."""

    def spoil_truth(content: Any) -> None:
        T = POSED_VIEWS[5].copy()
        T[:3, 3] *= 1000
        for found in content["5"]:
            put_pose(found, "m2c", T @ T @ pose_of(found, "m2c"))

    edit(scene_file(export_copy, "scene_camera.json"), lambda c: invert(c["5"], "w2c"))
    edit(scene_file(export_copy, "scene_gt.json"), spoil_truth)
    with pytest.raises(GateError, match=r"image 5: cam_R_w2c and cam_t_w2c .* they hold the inverse"):
        check_export(export_copy, exported.expected, ignore_progress)
