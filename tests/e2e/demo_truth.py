"""Where the objects of the demo scenes really are."""

import json

import numpy as np

from registration_core.geometry import pose
from tests.conftest import REPOSITORY

SCENES = REPOSITORY / "scenes/demo/test"


def true_pose(obj_id: int, scene_id: int = 1) -> np.ndarray:
    """T_world_object of an object in a demo scene, metres."""
    scene = SCENES / f"{scene_id:06d}"
    camera = json.loads((scene / "scene_camera.json").read_text())["0"]
    entries = json.loads((scene / "scene_gt.json").read_text())["0"]
    entry = next(entry for entry in entries if entry["obj_id"] == obj_id)
    T_camera_object = pose.from_rotation_translation(
        np.reshape(entry["cam_R_m2c"], (3, 3)), np.array(entry["cam_t_m2c"]) / 1000
    )
    T_camera_world = pose.from_rotation_translation(
        np.reshape(camera["cam_R_w2c"], (3, 3)), np.array(camera["cam_t_w2c"]) / 1000
    )
    return pose.inverse(T_camera_world) @ T_camera_object
