"""Poses as one CSV file, a row for each object in each image, as pose estimators hand in results."""

import csv
import json
from pathlib import Path
from typing import Any

from app.export.formats.registry import ExportFormat

COLUMNS = ("scene_id", "im_id", "obj_id", "score", "R", "t", "time")
"""Of the BOP challenge's result files."""
SCORE = 1.0
TIME = -1
"""Seconds; -1 says that none was taken."""


def write_poses(dataset: Path, target: Path) -> None:
    """Write the poses of a checked BOP dataset into a new folder: R row by row, t in mm, model to camera."""
    target.mkdir()
    with (target / f"{target.name}-poses.csv").open("w", newline="", encoding="utf-8") as stream:
        writer = csv.writer(stream)
        writer.writerow(COLUMNS)
        for path in sorted(dataset.glob("*/*/scene_gt.json")):
            images: dict[str, list[dict[str, Any]]] = json.loads(path.read_text(encoding="utf-8"))
            for image_id, truths in images.items():
                for truth in truths:
                    R, t = (" ".join(map(repr, truth[key])) for key in ("cam_R_m2c", "cam_t_m2c"))
                    writer.writerow((int(path.parent.name), image_id, truth["obj_id"], SCORE, R, t, TIME))


FORMAT = ExportFormat("csv", "Poses alone, CSV", write_poses)
