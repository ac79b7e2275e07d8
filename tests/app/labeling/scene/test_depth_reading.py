"""Reading depth for an object in the world: the right camera, and nothing twice."""

from app.labeling.scene.depth_reading import DepthReading, DepthView
from registration_core import Intrinsics
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth
from tests.app.export.site import TOOL, mesh_of, model_of

MODEL = model_of(mesh_of(TOOL))
CAMERA = Intrinsics(160, 120, 200.0, 200.0, 79.5, 59.5)
T_CAMERA_OBJECT = pose.exp([0.0, 0.0, 0.4, 0.3, 0.5, 0.1])
T_WORLD_CAMERAS = {
    3: pose.exp([0.5, -0.2, 0.1, 0.3, 0.2, -0.4]),
    4: pose.exp([0.0, 0.6, 0.3, -0.3, 0.2, 0.1]),
}
DEPTH = render_depth(MODEL, CAMERA, T_CAMERA_OBJECT)


class Frames:
    """Frames that see the same; counts how often they are asked for."""

    def __init__(self) -> None:
        self.asked = 0

    def __call__(self, frame_id: int) -> DepthView:
        self.asked += 1
        return DepthView(DEPTH, CAMERA, T_WORLD_CAMERAS[frame_id])


def test_each_frame_is_read_with_its_own_camera() -> None:
    reading = DepthReading(lambda: MODEL, Frames())
    for frame_id, T_world_camera in T_WORLD_CAMERAS.items():
        assert reading.of(frame_id, T_world_camera @ T_CAMERA_OBJECT).inlier_share == 1.0
    assert reading.of(4, T_WORLD_CAMERAS[3] @ T_CAMERA_OBJECT).inlier_share != 1.0


def test_the_points_lie_on_the_object() -> None:
    points = DepthReading(lambda: MODEL, Frames()).surface(3, T_WORLD_CAMERAS[3] @ T_CAMERA_OBJECT)
    assert len(points) > 500
    assert (points > MODEL.vertices.min(axis=0) - 1e-6).all()
    assert (points < MODEL.vertices.max(axis=0) + 1e-6).all()


def test_the_same_pose_is_compared_once() -> None:
    frames = Frames()
    reading = DepthReading(lambda: MODEL, frames)
    first, second = (reading.of(3, T_WORLD_CAMERAS[3] @ T_CAMERA_OBJECT) for _ in range(2))
    assert first is second
    assert frames.asked == 1
