"""Pictures for people who look at results one by one: outlines of the truth, the start and the result."""

from collections.abc import Sequence
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw
from scipy.ndimage import binary_dilation

from benchmarks.registration.instances import Instance
from benchmarks.registration.methods import DEFAULT
from benchmarks.registration.trials import Trial
from registration_core.bop import read_color
from registration_core.rasterizer import render_depth

Picture = NDArray[np.uint8]

GREEN, YELLOW, MAGENTA = (60, 220, 60), (255, 210, 0), (255, 0, 255)
"""Truth, start, result."""
SUCCESSES = 2
"""Of each instance, beside all failures."""
MARGIN = 60
"""Pixels around the truth that are shown."""
ZOOM = 2


def write_overlays(folder: Path, instances: Sequence[Instance], trials: Sequence[Trial]) -> None:
    """A PNG for each failure of the default and for a few successes: outlines on colour and depth."""
    folder.mkdir(parents=True, exist_ok=True)
    shown: dict[int, int] = {}
    for trial in trials:
        if trial.method != DEFAULT:
            continue
        right = trial.error.is_right
        shown[trial.instance] = shown.get(trial.instance, 0) + right
        if not right or shown[trial.instance] <= SUCCESSES:
            overlay(instances[trial.instance], trial).save(
                folder / f"{_name(instances[trial.instance], trial)}.png"
            )


def overlay(instance: Instance, trial: Trial) -> Image.Image:
    """Depth, and colour where there is any, side by side, about the true and the found place."""
    poses = ((instance.truth, GREEN), (trial.T_start, YELLOW), (trial.T_result, MAGENTA))
    silhouettes = [render_depth(instance.model, instance.camera, T) > 0 for T, _ in poses]
    pictures = [shaded(instance.depth)]
    if instance.color_path is not None:
        pictures.append(read_color(instance.color_path).copy())
    for picture in pictures:
        for silhouette, (_, color) in zip(silhouettes, poses, strict=True):
            picture[outline(silhouette)] = color
    part = _around(silhouettes[0] | silhouettes[2])
    image = Image.fromarray(np.hstack([picture[part] for picture in pictures]))
    image = image.resize((ZOOM * image.width, ZOOM * image.height), Image.Resampling.NEAREST)
    text = (
        f"{instance.object_name} from {trial.shell}: ADD(-S) {100 * trial.error.add:.1f} %,"
        f" MSSD {100 * trial.error.mssd:.1f} % of the diameter, confidence {trial.confidence:.2f}"
    )
    ImageDraw.Draw(image).text((4, 4), text, fill="white", stroke_width=2, stroke_fill="black")
    return image


def shaded(depth: NDArray[np.float32]) -> Picture:
    """Depth (H, W) as grey (H, W, 3), near things brighter; black where nothing was measured."""
    measured = depth > 0
    low, high = np.percentile(depth[measured], [1, 99])
    brightness = np.clip(1.0 - 0.8 * (depth - low) / max(high - low, 1e-6), 0.2, 1.0) * measured
    return np.repeat((255 * brightness).astype(np.uint8)[..., None], 3, axis=2)


def outline(silhouette: NDArray[np.bool_]) -> NDArray[np.bool_]:
    """The pixels just outside a silhouette (H, W)."""
    return binary_dilation(silhouette) & ~silhouette


def _around(mask: NDArray[np.bool_]) -> tuple[slice, slice]:
    rows, columns = np.nonzero(mask)
    return (
        slice(max(0, rows.min() - MARGIN), rows.max() + MARGIN),
        slice(max(0, columns.min() - MARGIN), columns.max() + MARGIN),
    )


def _name(instance: Instance, trial: Trial) -> str:
    verdict = "right" if trial.error.is_right else "wrong"
    scene = instance.scene.replace("/", "-").replace(" ", "_").replace("%", "")
    shell = f"{1000 * trial.shell.translation:.0f}mm"
    return f"{verdict}_{scene}_{instance.object_name.replace(' ', '_')}_{shell}_{trial.start}"
