"""What a 3-D view shows of a frame, and how it is looked at first."""

import numpy as np
from numpy.typing import NDArray

from app.datasets.scene_data import PointCloud
from app.storage.tables import Frame
from app.views3d.view import FirstView, SceneView


def first_view_of(frame: Frame, depth: NDArray[np.float32]) -> FirstView:
    """Where the camera stands when a page opens on a frame with this depth image (H, W), metres."""
    measured = depth[depth > 0]
    return FirstView(
        T_world_camera=np.array(frame.T_world_camera),
        field_of_view=2.0 * float(np.arctan(frame.height / (2.0 * frame.fy))),
        distance=float(np.median(measured)) if measured.size else 1.0,
    )


def show_cloud_of(view: SceneView, frame: Frame, cloud: PointCloud) -> None:
    """Show what a frame measured, its points as large as their pixels."""
    distance = np.linalg.norm(cloud.points - np.array(frame.T_world_camera)[:3, 3], axis=1)
    footprint = float(np.median(distance)) / frame.fx if len(distance) else 0.001
    view.show_cloud(cloud.points, cloud.colors, point_size=footprint)
