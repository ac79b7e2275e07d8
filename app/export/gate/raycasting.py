"""Depth images by casting rays: another way of rendering than the one that exports are written with."""

from collections.abc import Iterable

import numpy as np
import open3d as o3d
from numpy.typing import NDArray

from registration_core import Intrinsics
from registration_core.bop.dataset import BopObject
from registration_core.geometry import pose

ROWS_AT_ONCE = 128
"""Image rows whose rays are held in memory."""


class RayCaster:
    """Renders the objects of a dataset, each prepared when it is first asked for."""

    def __init__(self, objects: Iterable[BopObject]) -> None:
        self._models = {found.obj_id: found.model for found in objects}
        self._scenes: dict[int, o3d.t.geometry.RaycastingScene] = {}

    def depth(
        self, obj_id: int, camera: Intrinsics, T_camera_object: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        """Depth image (H, W) of an object, metres, 0 where there is none."""
        bands = [
            camera.cropped(0, top, camera.width, min(ROWS_AT_ONCE, camera.height - top))
            for top in range(0, camera.height, ROWS_AT_ONCE)
        ]
        return np.concatenate([self._band(obj_id, band, T_camera_object) for band in bands])

    def _band(
        self, obj_id: int, camera: Intrinsics, T_camera_object: NDArray[np.float64]
    ) -> NDArray[np.float32]:
        columns, rows = np.meshgrid(np.arange(camera.width), np.arange(camera.height))
        x, y = (columns - camera.cx) / camera.fx, (rows - camera.cy) / camera.fy
        directions = np.stack([x, y, np.ones_like(x)], axis=-1)  # z is 1: a ray's parameter is its depth
        T_object_camera = pose.inverse(T_camera_object)
        rays = np.empty((camera.height, camera.width, 6), dtype=np.float32)
        rays[..., :3] = T_object_camera[:3, 3]
        rays[..., 3:] = directions @ T_object_camera[:3, :3].T
        hits = self._scene(obj_id).cast_rays(o3d.core.Tensor.from_numpy(rays))["t_hit"].numpy()
        return np.where(np.isfinite(hits), hits, np.float32(0.0))

    def nearest_and_farthest(self, obj_id: int, T_camera_object: NDArray[np.float64]) -> tuple[float, float]:
        """Smallest and largest depth of an object's vertices, metres; negative behind the camera."""
        depths = pose.apply(T_camera_object, self._models[obj_id].vertices)[:, 2]
        return float(depths.min()), float(depths.max())

    def _scene(self, obj_id: int) -> o3d.t.geometry.RaycastingScene:
        if obj_id not in self._scenes:
            model = self._models[obj_id]
            scene = o3d.t.geometry.RaycastingScene()
            scene.add_triangles(
                o3d.core.Tensor.from_numpy(model.vertices.astype(np.float32)),
                o3d.core.Tensor.from_numpy(model.faces.astype(np.uint32)),
            )
            self._scenes[obj_id] = scene
        return self._scenes[obj_id]
