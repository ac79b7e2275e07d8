"""Pictures, depth, point clouds and object models out of the file store, the recent ones kept in memory."""

import logging
from dataclasses import dataclass

import numpy as np
import trimesh
from numpy.typing import NDArray

from app.datasets.outline_mesh import drawable, thinned
from app.datasets.textured_mesh import textured_mesh
from app.recent import Recent
from app.storage.files import DamagedFileError, FileStore
from app.storage.tables import Frame, Object
from registration_core import Intrinsics, ObjectModel, Symmetries, color_is_aligned
from registration_core.bop.dataset import BopFormatError, read_color, read_depth
from registration_core.geometry import pose
from registration_core.geometry.camera import depth_to_points
from registration_core.geometry.object_model import ContinuousSymmetry

logger = logging.getLogger(__name__)

CLOUD_POINTS = 300_000
"""Most points of a cloud that is shown."""
PLAIN_COLOR = (160, 165, 172)
"""Of points in a frame without a colour image."""
KEPT_MODELS = 32
KEPT_FRAMES = 16
KEPT_VERDICTS = 100_000
"""Frames of which it is known whether their colour lies on their depth."""


@dataclass(frozen=True)
class PointCloud:
    """Coloured points in the world's frame."""

    points: NDArray[np.float32]
    """(N, 3), metres."""
    colors: NDArray[np.uint8]
    """(N, 3)."""


class SceneData:
    """Arrays behind the rows of frames and objects."""

    def __init__(self, files: FileStore) -> None:
        self._files = files
        self._model = Recent(KEPT_MODELS, self._load_model)
        self._thinned = Recent(KEPT_MODELS, thinned)
        self._drawable = Recent(KEPT_MODELS, drawable)
        self._textured = Recent(KEPT_MODELS, self._load_textured)
        self._depth = Recent(KEPT_FRAMES, self._load_depth)
        self._color = Recent(KEPT_FRAMES, self._load_color)
        self._is_aligned = Recent(KEPT_VERDICTS, self._find_aligned)

    def model(self, item: Object) -> ObjectModel:
        """The object's mesh, in metres."""
        return self._model(item.mesh_hash, item.mesh_format, symmetries_from_json(item.symmetries))

    def thinned_model(self, item: Object) -> ObjectModel:
        """The same, coarse enough to be drawn many times a second."""
        return self._thinned(self.model(item))

    def drawable(self, model: ObjectModel) -> ObjectModel:
        """An object's mesh as 3-D views draw it: its own, unless that has too many faces."""
        return self._drawable(model)

    def textured(self, item: Object) -> trimesh.Trimesh | None:
        """The object's mesh as 3-D views draw it in its own colours, metres; None where it has none."""
        return self._textured(item.mesh_hash, item.mesh_format, item.texture_hash)

    def depth(self, frame: Frame) -> NDArray[np.float32]:
        """The frame's depth image (H, W), metres, 0 where there is none; not to be written to."""
        return self._depth(frame.depth_hash, frame.depth_scale)

    def color(self, frame: Frame) -> NDArray[np.uint8] | None:
        """The frame's colour image (H, W, 3), where it has one; not to be written to."""
        return self._color(frame.color_hash) if frame.color_hash else None

    def aligned_color(self, frame: Frame) -> NDArray[np.uint8] | None:
        """The same where the images show that it lies on the depth, pixel by pixel; None where it cannot be
        read: depth alone will do.
        """
        if not frame.color_hash or not self._is_aligned(
            frame.color_hash, frame.depth_hash, frame.depth_scale
        ):
            return None
        return self._color(frame.color_hash)

    def cloud(self, frame: Frame) -> PointCloud:
        """The frame's measured points in the world, thinned out evenly where there are too many."""
        depth, color = self.depth(frame), self.color(frame)
        measured = np.flatnonzero(depth)
        if len(measured) > CLOUD_POINTS:
            measured = measured[np.linspace(0, len(measured) - 1, CLOUD_POINTS).astype(np.intp)]
        points = depth_to_points(depth, camera_of(frame)).reshape(-1, 3)[measured]
        world = pose.apply(np.array(frame.T_world_camera), points).astype(np.float32)
        colors = (
            np.full((len(measured), 3), PLAIN_COLOR, dtype=np.uint8)
            if color is None
            else color.reshape(-1, 3)[measured]
        )
        return PointCloud(world, colors)

    def _load_model(self, digest: str, file_format: str, symmetries: Symmetries) -> ObjectModel:
        return ObjectModel.from_bytes(self._files.read(digest), file_format, "mm", symmetries)

    def _load_textured(
        self, digest: str, file_format: str, texture_digest: str | None
    ) -> trimesh.Trimesh | None:
        try:
            texture = self._files.read(texture_digest) if texture_digest else None
        except DamagedFileError as error:
            logger.warning("an object is shown without its texture: %s", error)
            return None
        model = self._model(digest, file_format, Symmetries())
        return textured_mesh(self._files.read(digest), file_format, texture, model)

    def _load_depth(self, digest: str, depth_scale: float) -> NDArray[np.float32]:
        depth = read_depth(self._files.path(digest), depth_scale)
        depth.setflags(write=False)
        return depth

    def _load_color(self, digest: str) -> NDArray[np.uint8]:
        color = read_color(self._files.path(digest))
        color.setflags(write=False)
        return color

    def _find_aligned(self, digest: str, depth_digest: str, depth_scale: float) -> bool:
        depth = self._depth(depth_digest, depth_scale)
        try:
            color = self._color(digest)
        except (BopFormatError, DamagedFileError) as error:
            logger.warning("a frame is used without its colours: %s", error)
            return False
        return color.shape[:2] == depth.shape and color_is_aligned(color, depth)


def camera_of(frame: Frame) -> Intrinsics:
    """The frame's pinhole camera."""
    return Intrinsics(frame.width, frame.height, frame.fx, frame.fy, frame.cx, frame.cy)


def symmetries_to_json(symmetries: Symmetries) -> dict[str, list[object]]:
    """Symmetries as they are kept in the database: metres, in the mesh's frame."""
    return {
        "discrete": [[list(row) for row in T] for T in symmetries.discrete],
        "continuous": [{"axis": list(s.axis), "offset": list(s.offset)} for s in symmetries.continuous],
    }


def symmetries_from_json(content: dict[str, list[object]]) -> Symmetries:
    """The inverse of `symmetries_to_json`."""
    discrete: list[list[list[float]]] = content.get("discrete", [])  # type: ignore[assignment]
    continuous: list[dict[str, list[float]]] = content.get("continuous", [])  # type: ignore[assignment]
    return Symmetries(
        discrete=tuple(tuple(tuple(row) for row in T) for T in discrete),
        continuous=tuple(
            ContinuousSymmetry(_triple(entry["axis"]), _triple(entry["offset"])) for entry in continuous
        ),
    )


def _triple(values: list[float]) -> tuple[float, float, float]:
    x, y, z = values
    return x, y, z
