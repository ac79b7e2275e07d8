"""The gate's checks of one object instance in one image: its masks, its numbers, and how well it fits."""

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image

from app.export.bop.coco import mask_from_run_lengths
from app.export.gate.raycasting import RayCaster
from registration_core import Intrinsics

Mask = NDArray[np.bool_]
Depth = NDArray[np.float32]
Array = NDArray[np.float64]

LEAST_OVERLAP = 0.98
"""Intersection over union of a mask and its new rendering."""
TINY_DIFFERENCE = 12
"""Pixels by which they may always differ: on a small mask the overlap says little."""

VISIBILITY_TOLERANCE = 0.015
"""Metres that a visible surface may lie behind the observed one."""

UNDECIDED = 0.0005
"""Metres about that tolerance within which renderers may judge differently."""

BOX_TOLERANCE = 2
"""Pixels."""
NO_BOX = [-1, -1, -1, -1]

LARGEST_RESIDUAL = 0.020
"""Metres; an operator's pose may be a few millimetres off."""
LEAST_VISIBLE = 0.1
"""Share of an instance that must be visible before its depth is judged: less is mostly its rim."""
LEAST_PIXELS = 50
"""Measured pixels that must be visible before its depth is judged."""


class GateError(Exception):
    """An export is wrong; the message is one sentence that names scene, image and object."""


class MisplacedError(GateError):
    """The object is not where the depth image shows it; `reason` says so without its place."""

    def __init__(self, where: str, reason: str) -> None:
        super().__init__(f"{where}: {reason}")
        self.reason = reason


@dataclass(frozen=True, eq=False)
class Instance:
    """What the files say of one object instance in one image."""

    where: str
    """Scene, image and object, for messages."""
    obj_id: int
    mask: Mask
    mask_visib: Mask
    info: dict[str, Any]
    """Its entry in `scene_gt_info.json`."""
    coco: dict[str, Any] | None
    """Its entry in `scene_gt_coco.json`, which it has if it is visible."""


def check_instance(
    instance: Instance, caster: RayCaster, camera: Intrinsics, T_camera_object: Array, observed: Depth
) -> None:
    """Compare an instance with a rendering of its pose and with the observed depth (H, W), metres."""
    rendered = caster.depth(instance.obj_id, camera, T_camera_object)
    check_overlap(instance.mask, rendered > 0, f"{instance.where}: mask")
    if (instance.mask_visib & ~instance.mask).any():
        raise GateError(f"{instance.where}: mask_visib reaches outside of mask")
    check_overlap(
        instance.mask_visib,
        visible_surface(instance, rendered, observed, camera),
        f"{instance.where}: mask_visib",
    )
    check_info(instance, observed)
    check_whole_silhouette(instance, whole_silhouette(instance, caster, camera, T_camera_object))
    check_coco(instance)
    check_residual(instance, rendered, observed)


def visible_surface(instance: Instance, rendered: Depth, observed: Depth, camera: Intrinsics) -> Mask:
    """Where the rendered surface is visible; a pixel too near to the tolerance to tell is left as it is."""
    x = (np.arange(camera.width) - camera.cx) / camera.fx
    y = (np.arange(camera.height) - camera.cy) / camera.fy
    behind = (rendered - observed) * np.sqrt(1.0 + x**2 + y[:, None] ** 2)
    visible = (observed == 0) | (behind <= VISIBILITY_TOLERANCE)
    undecided = (observed > 0) & (np.abs(behind - VISIBILITY_TOLERANCE) < UNDECIDED)
    return (rendered > 0) & np.where(undecided, instance.mask_visib, visible)


def whole_silhouette(
    instance: Instance, caster: RayCaster, camera: Intrinsics, T_camera_object: Array
) -> Mask:
    """The silhouette (3 H, 3 W) on a canvas with the image in its middle."""
    height, width = instance.mask.shape
    edges = (instance.mask[[0, -1]], instance.mask[:, [0, -1]])
    if instance.mask.any() and not any(edge.any() for edge in edges):
        return np.pad(instance.mask, ((height, height), (width, width)))
    canvas = camera.cropped(-width, -height, 3 * width, 3 * height)
    return caster.depth(instance.obj_id, canvas, T_camera_object) > 0


def check_overlap(mask: Mask, rendered: Mask, what: str) -> None:
    """Raise where a mask is not what the pose renders to."""
    difference = int(np.count_nonzero(mask != rendered))
    union = int(np.count_nonzero(mask | rendered))
    if difference > max(TINY_DIFFERENCE, (1.0 - LEAST_OVERLAP) * union):
        overlap = 1.0 - difference / union
        raise GateError(
            f"{what} is not what the pose in scene_gt.json renders to: they overlap by {overlap:.0%}"
        )


def check_info(instance: Instance, observed: Depth) -> None:
    """Raise where the numbers of `scene_gt_info.json` are not those of the masks."""
    info, mask, visible = instance.info, instance.mask, instance.mask_visib
    count_visible = int(np.count_nonzero(visible))
    count_all = info["px_count_all"]
    wanted = {
        "px_count_visib": count_visible,
        "px_count_valid": int(np.count_nonzero(observed[mask])),
        "visib_fract": count_visible / count_all if count_all else 0.0,
        "bbox_visib": box_of(visible),
    }
    for field, value in wanted.items():
        if not np.allclose(info[field], value):
            raise GateError(
                f"{instance.where}: {field} in scene_gt_info.json is {info[field]}, by the masks {value}"
            )


def check_whole_silhouette(instance: Instance, whole: Mask) -> None:
    """Raise where the numbers about the whole silhouette leave out what lies outside of the image."""
    count, told = int(np.count_nonzero(whole)), instance.info["px_count_all"]
    if abs(told - count) > max(TINY_DIFFERENCE, (1.0 - LEAST_OVERLAP) * count):
        raise GateError(
            f"{instance.where}: px_count_all in scene_gt_info.json is {told}, by the whole silhouette {count}"
        )
    height, width = instance.mask.shape
    box = box_of(whole)
    wanted = [box[0] - width, box[1] - height, *box[2:]] if instance.mask_visib.any() else NO_BOX
    box_told = instance.info["bbox_obj"]
    if np.abs(np.subtract(box_told, wanted)).max() > BOX_TOLERANCE:
        raise GateError(
            f"{instance.where}: bbox_obj in scene_gt_info.json is {box_told}, by the silhouette {wanted}"
        )


def check_coco(instance: Instance) -> None:
    """Raise where `scene_gt_coco.json` does not hold the visible mask."""
    if not instance.mask_visib.any():
        return
    coco = instance.coco
    if coco is None:
        raise GateError(f"{instance.where}: scene_gt_coco.json has no entry for it")
    if coco["category_id"] != instance.obj_id:
        raise GateError(f"{instance.where}: category_id in scene_gt_coco.json is {coco['category_id']}")
    if not np.array_equal(mask_from_run_lengths(coco["segmentation"]), instance.mask_visib):
        raise GateError(f"{instance.where}: its mask in scene_gt_coco.json differs from mask_visib")


def check_residual(instance: Instance, rendered: Depth, observed: Depth) -> None:
    """Raise where the visible surface does not lie at the measured depth."""
    measured = instance.mask_visib & (observed > 0) & (rendered > 0)
    if instance.info["visib_fract"] < LEAST_VISIBLE or np.count_nonzero(measured) < LEAST_PIXELS:
        return
    residual = float(np.median(np.abs(rendered[measured] - observed[measured])))
    if residual > LARGEST_RESIDUAL:
        raise MisplacedError(
            instance.where,
            f"the surface in this pose is {1000 * residual:.0f} mm off the measured depth"
            f" (median; at most {1000 * LARGEST_RESIDUAL:.0f} mm); register the object again",
        )


def box_of(mask: Mask) -> list[int]:
    """Box x, y, width, height, as last minus first pixel; -1 for an empty mask."""
    rows, columns = np.nonzero(mask)
    if not len(rows):
        return NO_BOX
    return [
        int(columns.min()),
        int(rows.min()),
        int(columns.max() - columns.min()),
        int(rows.max() - rows.min()),
    ]


def read_mask(path: Path, shape: tuple[int, ...], where: str) -> Mask:
    """A mask file (H, W) of the wanted shape.

    Raises:
        GateError: where it is missing, broken, or of another size.
    """
    name = f"{path.parent.name}/{path.name}"
    try:
        with Image.open(path) as image:
            values = np.asarray(image)
    except FileNotFoundError as error:
        raise GateError(f"{where}: {name} is missing") from error
    except (OSError, SyntaxError, ValueError) as error:  # what Pillow raises for broken files
        raise GateError(f"{where}: {name} cannot be decoded") from error
    if values.shape != shape:
        raise GateError(f"{where}: {name} has shape {values.shape}, the depth image {shape}")
    return values > 0
