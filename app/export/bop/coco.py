"""`scene_gt_coco.json`: the visible masks of a scene in COCO's format, as bop_toolkit writes them."""

from collections.abc import Iterable
from typing import Any

import numpy as np
from numpy.typing import NDArray

Mask = NDArray[np.bool_]

LEAST_VISIBLE = 0.1
"""Share below which an instance is marked to be ignored in evaluations."""


class CocoScene:
    """Collects the images and instances of one scene."""

    def __init__(self, dataset: str, split: str, date_created: str, categories: Iterable[int]) -> None:
        self._content: dict[str, Any] = {
            "info": {"description": f"{dataset}_{split}", "version": "1.0", "date_created": date_created},
            "licenses": [],
            "categories": [
                {"id": obj_id, "name": str(obj_id), "supercategory": dataset} for obj_id in categories
            ],
            "images": [],
            "annotations": [],
        }

    def add_image(self, image_id: int, file_name: str, width: int, height: int) -> None:
        """Add an image; its file name is relative to the scene's folder."""
        self._content["images"].append(
            {"id": image_id, "file_name": file_name, "width": width, "height": height}
        )

    def add_instance(
        self, image_id: int, obj_id: int, mask: Mask, mask_visib: Mask, visible_share: float
    ) -> None:
        """Add an instance, unless nothing of it is visible; the box is that of the whole silhouette."""
        if not mask_visib.any():
            return
        annotations = self._content["annotations"]
        annotations.append(
            {
                "id": len(annotations) + 1,
                "image_id": image_id,
                "category_id": obj_id,
                "iscrowd": 0,
                "area": int(np.count_nonzero(mask_visib)),
                "bbox": full_box(mask),
                "segmentation": run_lengths(mask_visib),
                "width": mask.shape[1],
                "height": mask.shape[0],
                "ignore": visible_share < LEAST_VISIBLE,
            }
        )

    def content(self) -> dict[str, Any]:
        """What the file holds."""
        return self._content


def full_box(mask: Mask) -> list[int]:
    """Box x, y, width, height of a mask in pixels; a single pixel is one wide and one high."""
    rows, columns = np.flatnonzero(mask.any(axis=1)), np.flatnonzero(mask.any(axis=0))
    x, y = int(columns[0]), int(rows[0])
    return [x, y, int(columns[-1]) - x + 1, int(rows[-1]) - y + 1]


def run_lengths(mask: Mask) -> dict[str, list[int]]:
    """COCO's uncompressed run-length code: lengths of runs down the columns, the first one outside."""
    flat = mask.ravel(order="F")
    ends = np.flatnonzero(flat[1:] != flat[:-1]) + 1
    counts = np.diff(np.concatenate([[0], ends, [flat.size]])).tolist()
    return {"counts": [0, *counts] if flat[0] else counts, "size": list(mask.shape)}


def mask_from_run_lengths(code: dict[str, list[int]]) -> Mask:
    """The mask (H, W) of a run-length code."""
    inside = np.arange(len(code["counts"])) % 2 == 1
    flat = np.repeat(inside, code["counts"])
    return flat.reshape(code["size"], order="F")
