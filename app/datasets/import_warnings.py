"""What looks odd in a dataset whose format is sound: units, cameras and poses that deny each other.

All of it may be right, so it is taken in and said.
"""

from collections import defaultdict
from collections.abc import Iterator
from dataclasses import dataclass, replace
from functools import cached_property

import numpy as np
from numpy.typing import NDArray

from app.datasets.import_plan import copies_by_image, or_identity, world_pose
from registration_core import ObjectModel
from registration_core.bop.dataset import BopDataset, BopGroundTruth, BopImage, BopScene, read_depth
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth

Array = NDArray[np.float64]
Depth = NDArray[np.float32]

PLAUSIBLE_DEPTH = (0.03, 30.0)
"""Metres, of an image's median: nearer than any depth camera sees, and farther than any table is."""
USUAL_DEPTH = 1.0
"""Metres; of several plausible units the one is suggested that brings the median nearest to this."""
UNITS = 10.0 ** np.arange(-4, 5)
"""By which a depth scale is off where somebody mixed units up."""

MOST_IMAGES = 12
"""Of a scene whose poses are compared with the depth, evenly spread."""
FEWEST_PIXELS = 60
"""Measured pixels under an object's silhouette that tell anything."""
TOLERANCE = (0.02, 0.02)
"""Metres, and share of the distance, by which depth may lie beside an object's surface."""
MOST_SEEN_THROUGH = 0.5
"""Share of its pixels through which the camera may see what lies behind an object that is there."""
MOST_HIDDEN = 0.9
"""Share of its pixels before which something else may lie; many objects of a dataset are hidden less."""

FOCAL_SHARES = (0.2, 20.0)
"""Focal length beside the image's width."""
SQUARENESS = 2.0
"""Largest ratio of the focal lengths."""
MOVED_SHARE = 0.3
"""Share of the measured pixels that change by more than `MOVED_BY` where a camera moves."""
MOVED_BY = 0.05
"""Share of the distance."""

MOST_NAMED = 8
"""Images that a warning names."""


@dataclass(frozen=True)
class DatasetWarning:
    """One thing that looks odd, and where."""

    text: str
    """A sentence: what, and what to look at."""
    images: tuple[str, ...]
    """Those that show it, as "test/000001, image 3"; the first `MOST_NAMED`."""


def dataset_warnings(source: BopDataset) -> list[DatasetWarning]:
    """Everything that looks odd in a dataset."""
    models = {item.obj_id: item.model for item in source.objects}
    found: dict[str, list[str]] = defaultdict(list)
    for item in source.objects:
        if item.missing_texture is not None:
            found[
                f"models/{item.mesh_path.name} names a texture that is not in models"
                f" ({item.missing_texture!r}); the mesh is shown and exported without it"
            ] = []
    for scene in source.scenes:
        for text, image in _SceneCheck(scene, models).all():
            found[text].append(f"{scene.split}/{scene.scene_id:06d}, image {image.image_id}")
    return [
        DatasetWarning(f"{text}{_counted(images)}", tuple(images[:MOST_NAMED]))
        for text, images in found.items()
    ]


def suggested_depth_scale(source: BopDataset) -> float | None:
    """The depth scale that would make a dataset's depth plausible; None where it is.

    Raises:
        ValueError: where none would.
    """
    images = [image for scene in source.scenes for image in _spread(scene.images)]
    medians = [depth for depth in map(median_depth, images) if depth > 0]
    if not medians or _is_plausible(float(np.median(medians))):
        return None
    median, scales = float(np.median(medians)), {image.depth_scale for image in images}
    factors = [factor for factor in UNITS if _is_plausible(median * factor)]
    if len(scales) > 1 or not factors:
        raise ValueError(
            f"depth would be at {median:.3g} m; correct depth_scale in scene_camera.json: raw depth times it"
            " is millimetres"
        )
    best = min(factors, key=lambda factor: abs(np.log(median * factor / USUAL_DEPTH)))
    return float(f"{scales.pop() * best:.6g}")


def median_depth(image: BopImage) -> float:
    """Metres; 0 where nothing was measured."""
    depth = read_depth(image.depth.path, image.depth_scale)
    return float(np.median(depth[depth > 0])) if (depth > 0).any() else 0.0


def _is_plausible(depth: float) -> bool:
    return PLAUSIBLE_DEPTH[0] <= depth <= PLAUSIBLE_DEPTH[1]


def _counted(images: list[str]) -> str:
    return f" ({len(images)} images)" if len(images) > 1 else ""


def _spread(images: tuple[BopImage, ...]) -> list[BopImage]:
    if len(images) <= MOST_IMAGES:
        return list(images)
    return [images[index] for index in np.linspace(0, len(images) - 1, MOST_IMAGES).astype(int)]


Oddity = tuple[str, BopImage]


class _SceneCheck:
    """Looks at one scene."""

    def __init__(self, scene: BopScene, models: dict[int, ObjectModel]) -> None:
        self._scene = scene
        self._models = models
        self._looked_at = [_Look(image) for image in _spread(scene.images)]

    def all(self) -> Iterator[Oddity]:
        """What looks odd, image by image."""
        yield from self._pictures()
        yield from self._cameras()
        yield from self._behind_the_camera()
        yield from self._standing_cameras()
        yield from self._beside_the_depth()
        yield from self._denied_by_other_images()

    def _pictures(self) -> Iterator[Oddity]:
        images = self._scene.images
        if any(image.color for image in images):
            for image in images:
                if image.color is None:
                    yield "has no picture though others of its scene have one", image

    def _cameras(self) -> Iterator[Oddity]:
        for image in self._scene.images:
            camera = image.camera
            if not (0 <= camera.cx <= camera.width and 0 <= camera.cy <= camera.height):
                yield (
                    f"cam_K has its principal point ({camera.cx:.0f}, {camera.cy:.0f}) outside of the picture"
                    f" of {camera.width}x{camera.height} pixels; it may be that of another resolution",
                    image,
                )
            low, high = (share * camera.width for share in FOCAL_SHARES)
            ratio = max(camera.fx / camera.fy, camera.fy / camera.fx)
            if not low <= camera.fx <= high or ratio > SQUARENESS:
                yield (
                    f"cam_K has focal lengths ({camera.fx:.4g}, {camera.fy:.4g} pixels) that no camera of"
                    f" {camera.width}x{camera.height} pixels has; it may be in another unit",
                    image,
                )

    def _behind_the_camera(self) -> Iterator[Oddity]:
        for image in self._scene.images:
            for truth in image.ground_truth or ():
                if self._centre(truth)[2] <= 0.0:
                    yield (
                        f"object {truth.obj_id} lies behind the camera; its pose may be in the axes of"
                        " OpenGL (z backwards) instead of OpenCV (z forwards)",
                        image,
                    )

    def _standing_cameras(self) -> Iterator[Oddity]:
        """Cameras that are said to stand still while their pictures move."""
        posed = [look for look in self._looked_at if look.image.T_world_camera is not None]
        for look in posed:
            stood = next(
                other
                for other in posed
                if np.allclose(
                    or_identity(other.image.T_world_camera), or_identity(look.image.T_world_camera)
                )
            )
            if stood.differs_from(look):
                yield (
                    f"the camera is said to stand where it stood in image {stood.image.image_id}, but the"
                    " picture has moved; the cameras' poses (cam_R_w2c, cam_t_w2c) may be placeholders",
                    look.image,
                )

    def _beside_the_depth(self) -> Iterator[Oddity]:
        seen = [
            (look, truth, look.overlap(self._models[truth.obj_id], truth.T_camera_object))
            for look in self._looked_at
            for truth in look.image.ground_truth or ()
        ]
        told = [(look, truth, overlap) for look, truth, overlap in seen if overlap.pixels >= FEWEST_PIXELS]
        hidden = [(look, truth) for look, truth, overlap in told if overlap.hidden > MOST_HIDDEN]
        if 2 * len(hidden) > len(told):
            for look, truth in hidden:
                yield (
                    f"object {truth.obj_id} lies far behind what the depth image shows; depth_scale or the"
                    " pose may be in another unit",
                    look.image,
                )
        for look, truth, overlap in told:
            if overlap.seen_through > MOST_SEEN_THROUGH:
                yield (
                    f"object {truth.obj_id} hovers where the depth image shows nothing; its pose or"
                    " depth_scale may be wrong",
                    look.image,
                )

    def _denied_by_other_images(self) -> Iterator[Oddity]:
        """Copies that another image, to which they were carried by the cameras' poses, sees through."""
        looks = [look for look in self._looked_at if look.image.T_world_camera is not None]
        annotated = copies_by_image(tuple(look.image for look in looks), self._models)
        first_seen: dict[tuple[int, int], int] = {}
        for index, numbered in enumerate(annotated):
            for truth, copy in numbered:
                first_seen.setdefault((truth.obj_id, copy), index)
        for (obj_id, copy), index in first_seen.items():
            truth = next(t for t, c in annotated[index] if (t.obj_id, c) == (obj_id, copy))
            T_world_object = world_pose(looks[index].image, truth)
            for look, numbered in zip(looks, annotated, strict=True):
                if (obj_id, copy) in [(t.obj_id, c) for t, c in numbered]:
                    continue
                T = pose.inverse(or_identity(look.image.T_world_camera)) @ T_world_object
                overlap = look.overlap(self._models[obj_id], T)
                if overlap.pixels >= FEWEST_PIXELS and overlap.seen_through > MOST_SEEN_THROUGH:
                    yield (
                        f"object {obj_id} is annotated in image {looks[index].image.image_id} where this"
                        f" image shows nothing; {self._reason(looks, annotated)}",
                        look.image,
                    )

    def _reason(self, looks: list["_Look"], annotated: list[list[tuple[BopGroundTruth, int]]]) -> str:
        """What may be wrong where images deny each other's poses."""
        as_given = max((copy for numbered in annotated for _, copy in numbered), default=0)
        turned = [
            replace(look.image, T_world_camera=pose.inverse(or_identity(look.image.T_world_camera)))
            for look in looks
        ]
        other_way = copies_by_image(tuple(turned), self._models)
        if max((copy for numbered in other_way for _, copy in numbered), default=0) < as_given:
            return "cam_R_w2c and cam_t_w2c hold the inverse, camera to world: they agree when turned round"
        return "one of the poses, or of the cameras' poses, may be wrong, or the object was moved"

    def _centre(self, truth: BopGroundTruth) -> Array:
        return pose.apply(truth.T_camera_object, self._models[truth.obj_id].centre)


@dataclass(frozen=True)
class _Overlap:
    """How an object's rendered surface lies beside the measured one."""

    pixels: int
    seen_through: float
    """Share of the pixels whose depth lies behind the surface."""
    hidden: float
    """Share of the pixels whose depth lies before it."""


@dataclass(frozen=True, eq=False)
class _Look:
    """An image with its depth."""

    image: BopImage

    @cached_property
    def depth(self) -> Depth:
        return read_depth(self.image.depth.path, self.image.depth_scale)

    def differs_from(self, other: "_Look") -> bool:
        """Whether much of what both measured moved."""
        if self.depth.shape != other.depth.shape:
            return True
        both = (self.depth > 0) & (other.depth > 0)
        moved = np.abs(self.depth - other.depth) > MOVED_BY * self.depth
        return bool(both.any()) and float(moved[both].mean()) > MOVED_SHARE

    def overlap(self, model: ObjectModel, T_camera_object: Array) -> _Overlap:
        """Of a model at a pose, where the image shows it."""
        if pose.apply(T_camera_object, model.centre)[2] <= model.radius:
            return _Overlap(0, 0.0, 0.0)
        rendered = render_depth(model, self.image.camera, T_camera_object)
        there = (rendered > 0) & (self.depth > 0)
        count = int(np.count_nonzero(there))
        if not count:
            return _Overlap(0, 0.0, 0.0)
        behind = self.depth[there] - rendered[there]
        allowed = TOLERANCE[0] + TOLERANCE[1] * rendered[there]
        return _Overlap(count, float((behind > allowed).mean()), float((behind < -allowed).mean()))
