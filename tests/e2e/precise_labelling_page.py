"""A labelling page on the bottle of the first demo scene, with what is needed to say where things are."""

import json
from collections.abc import Callable

import numpy as np

from registration_core import ObjectModel
from registration_core.geometry import pose
from tests.conftest import REPOSITORY
from tests.e2e.gizmo import wait_for_camera
from tests.e2e.labelling_page import LabellingPage

DEMO = REPOSITORY / "scenes" / "demo"
BOTTLE = 3
MODEL = ObjectModel.load(DEMO / f"models/obj_{BOTTLE:06d}.ply", unit="mm")
CAMERA = """() => {
  const camera = window.__viserMutable.camera;
  camera.updateMatrixWorld();
  return camera.matrixWorld.elements;
}"""


class PreciseLabellingPage(LabellingPage):
    """A labelling page, with what is needed to say where things are."""

    @property
    def frame_info(self) -> dict:
        scene = self.page.request.get(f"{self.root}/api/scenes/{self.task['scene']['id']}").json()
        return next(frame for frame in scene["frames"] if frame["id"] == self.state["frame_id"])

    @property
    def T_world_camera(self) -> np.ndarray:
        return np.array(self.frame_info["T_world_camera"])

    @property
    def camera(self) -> np.ndarray:
        """Pose of the 3-D view's camera in the browser, in three.js' world."""
        return np.array(self.frame.evaluate(CAMERA)).reshape(4, 4).T

    def pixel_of(self, point: np.ndarray) -> tuple[float, float]:
        """Column and row of a point (3,) of the world in the frame's image."""
        camera = self.frame_info["intrinsics"]
        x, y, z = pose.apply(pose.inverse(self.T_world_camera), point)
        return camera["fx"] * x / z + camera["cx"], camera["fy"] * y / z + camera["cy"]

    def image_place(self, point: np.ndarray) -> tuple[float, float]:
        """The page's pixel of a point (3,) of the world in the colour image."""
        box = self.page.locator("#color").bounding_box()
        assert box is not None
        column, row = self.pixel_of(point)
        width, height = self.frame_info["width"], self.frame_info["height"]
        scale = min(box["width"] / width, box["height"] / height)
        left, top = (box["width"] - scale * width) / 2, (box["height"] - scale * height) / 2
        return box["x"] + left + scale * (column + 0.5), box["y"] + top + scale * (row + 0.5)

    def moves(self) -> int:
        items = self.page.request.get(f"{self.url}/events?limit=500").json()["items"]
        return sum(event["kind"] == "set_pose" for event in items)

    def change(self, act: Callable[[], object]) -> dict:
        """The change of pose that an action brings."""
        before = self.moves()
        act()
        return self.events("set_pose", before + 1)[-1]

    def press(self, key: str) -> dict:
        return self.change(lambda: self.page.keyboard.press(key))

    def wait_for_camera(self, before: np.ndarray) -> np.ndarray:
        """Where the camera stands still after it has left a place."""
        self.frame.wait_for_function(
            "before => window.__viserMutable.camera.matrixWorld.elements"
            ".some((x, i) => Math.abs(x - before[i]) > 1e-3)",
            arg=before.T.ravel().tolist(),
        )
        wait_for_camera(self.frame)
        return self.camera


def true_pose(labelling: PreciseLabellingPage) -> np.ndarray:
    """Where the bottle really is: T_world_object (4, 4)."""
    entries = json.loads((DEMO / "test/000001/scene_gt.json").read_text())[
        str(labelling.frame_info["image_id"])
    ]
    truth = next(entry for entry in entries if entry["obj_id"] == BOTTLE)
    T_camera_object = pose.from_rotation_translation(
        np.reshape(truth["cam_R_m2c"], (3, 3)), np.array(truth["cam_t_m2c"]) / 1000
    )
    return labelling.T_world_camera @ T_camera_object
