"""Pictures for people who look at failures: outlines on colour, and how far depth is off."""

from collections.abc import Sequence
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageDraw, ImageFont
from scipy.ndimage import binary_dilation

from benchmarks.registration.instances import Instance
from benchmarks.registration.methods import DEFAULT, Opinion, opinion
from benchmarks.registration.trials import Trial
from registration_core.bop.dataset import read_color
from registration_core.rendering.rasterizer import render_depth

Array = NDArray[np.float64]
Picture = NDArray[np.uint8]
Mask = NDArray[np.bool_]

GREEN, GREY, RED = (60, 220, 60), (175, 175, 175), (255, 40, 40)
"""Truth, start, result."""
BEHIND, FITS, BEFORE = np.array([255, 70, 30]), np.array([245, 245, 235]), np.array([40, 90, 255])
"""Where depth was measured behind the claimed surface, on it, and before it."""
UNMEASURED = np.array([225, 190, 40])
FULLY_OFF = 0.012
"""Metres from which on a residual has its full colour."""
MARGIN = 30
"""Pixels around truth and result that are shown."""
PANEL_WIDTH, PANEL_HEIGHT = 360, 270
"""Of each of the three pictures of a failure."""
LINE, FONT_SIZE = 17, 13
"""Height of a line of the caption and of its letters, pixels."""
A_MONTAGE, COLUMNS = 10, 2


def write_overlays(folder: Path, instances: Sequence[Instance], trials: Sequence[Trial]) -> None:
    """A PNG for each failure of the default, and montages of ten of a set, the most confident ones first."""
    folder.mkdir(parents=True, exist_ok=True)
    failures = [trial for trial in trials if trial.method == DEFAULT and not trial.error.is_right]
    failures.sort(key=lambda trial: -trial.claim)
    for set_name in dict.fromkeys(trial.set_name for trial in failures):
        pictures = []
        for trial in (trial for trial in failures if trial.set_name == set_name):
            pictures.append(overlay(instances[trial.instance], trial))
            pictures[-1].save(folder / f"{_name(trial)}.png")
        for first in range(0, len(pictures), A_MONTAGE):
            name = f"montage_{_plain(set_name)}_{1 + first // A_MONTAGE:02d}.png"
            montage(pictures[first : first + A_MONTAGE]).save(folder / name)


def montage(pictures: Sequence[Image.Image]) -> Image.Image:
    """Pictures of one size in two columns, row by row."""
    width, height = pictures[0].size
    rows = -(-len(pictures) // COLUMNS)
    sheet = Image.new("RGB", (COLUMNS * width, rows * height))
    for n, picture in enumerate(pictures):
        sheet.paste(picture, (n % COLUMNS * width, n // COLUMNS * height))
    return sheet


def overlay(instance: Instance, trial: Trial) -> Image.Image:
    """Outlines on the colour image, or on depth without one; residuals at the result, and at the truth."""
    poses = (trial.T_start, *instance.truths, trial.T_result)
    start, true, *alike, result = (render_depth(instance.model, instance.camera, T) for T in poses)
    part = _around((true > 0) | (result > 0))
    depth = instance.depth[part]
    seen = shaded(depth) if instance.color_path is None else read_color(instance.color_path)[part]
    outlined = _fitted(seen)
    for drawn, color in ((start, GREY), *((other, GREEN) for other in (true, *alike)), (result, RED)):
        outlined[outline(_fitted(drawn[part] > 0))] = color
    panels = [outlined, *(_fitted(residuals(depth, drawn[part])) for drawn in (result, true))]
    caption = _caption(instance, trial)
    image = Image.new("RGB", (len(panels) * PANEL_WIDTH, PANEL_HEIGHT + len(caption) * LINE + 4))
    image.paste(Image.fromarray(np.hstack(panels)), (0, 0))
    pen, font = ImageDraw.Draw(image), ImageFont.load_default(FONT_SIZE)
    for n, text in enumerate(
        ("truth green, start grey, result red", "residual at the result", "at the truth")
    ):
        pen.text((n * PANEL_WIDTH + 4, 2), text, "white", font, stroke_width=2, stroke_fill="black")
    for n, text in enumerate(caption):
        pen.text((4, PANEL_HEIGHT + n * LINE), text, "white", font)
    return image


def _caption(instance: Instance, trial: Trial) -> list[str]:
    error = trial.error
    result, truth = (opinion(instance, trial.T_start, T) for T in (trial.T_result, instance.truth))
    return [
        f"{trial.scene}, {instance.object_name}, from {trial.shell}, start {trial.start}:"
        f" confidence {trial.confidence:.2f}, {1000 * trial.seconds:.0f} ms",
        f"ADD(-S) {100 * error.add:.0f} %, MSSD {100 * error.mssd:.0f} % of the diameter,"
        f" {1000 * error.translation:.0f} mm, {np.degrees(error.rotation):.0f}°"
        + ("; depth fits as well as at the truth" if trial.fits_elsewhere else ""),
        f"result: {_words(result)}   truth: {_words(truth)}",
    ]


def _words(found: Opinion) -> str:
    return f"score {found.score:.1f}, match {found.match:.2f}, shown {found.shown:.2f}"


def residuals(depth: NDArray[np.float32], drawn: NDArray[np.float32]) -> Picture:
    """Depth (H, W) in dark grey; on the surface that is claimed, `drawn` (H, W), in colours how far behind it
    depth was measured.
    """
    off = np.clip((depth - drawn) / FULLY_OFF, -1.0, 1.0)[..., None]
    colors = FITS + np.abs(off) * (np.where(off > 0, BEHIND, BEFORE) - FITS)
    colors = np.where(depth[..., None] > 0, colors, UNMEASURED)
    return np.where(drawn[..., None] > 0, colors, 0.6 * shaded(depth)).astype(np.uint8)


def shaded(depth: NDArray[np.float32]) -> Picture:
    """Depth (H, W) as grey (H, W, 3), near things brighter; black where nothing was measured."""
    measured = depth > 0
    low, high = np.percentile(depth[measured], [1, 99]) if measured.any() else (0.0, 1.0)
    brightness = np.clip(1.0 - 0.8 * (depth - low) / max(high - low, 1e-6), 0.2, 1.0) * measured
    return np.repeat((255 * brightness).astype(np.uint8)[..., None], 3, axis=2)


def outline(silhouette: Mask) -> Mask:
    """The two pixels just outside a silhouette (H, W)."""
    return binary_dilation(silhouette, iterations=2) & ~silhouette


def _around(mask: Mask) -> tuple[slice, slice]:
    rows, columns = np.nonzero(mask)
    return (
        slice(max(0, rows.min() - MARGIN), rows.max() + MARGIN),
        slice(max(0, columns.min() - MARGIN), columns.max() + MARGIN),
    )


def _fitted(picture: NDArray[Any]) -> NDArray[Any]:
    """A picture or mask (H, W, ...) as large as a panel allows, in its middle."""
    height, width = picture.shape[:2]
    scale = min(PANEL_WIDTH / width, PANEL_HEIGHT / height)
    rows, columns = (np.arange(int(scale * size)) / scale for size in (height, width))
    panel = np.zeros((PANEL_HEIGHT, PANEL_WIDTH, *picture.shape[2:]), picture.dtype)
    top, left = (PANEL_HEIGHT - len(rows)) // 2, (PANEL_WIDTH - len(columns)) // 2
    resized = picture[rows.astype(int)[:, None], columns.astype(int)]
    panel[top : top + len(rows), left : left + len(columns)] = resized
    return panel


def _name(trial: Trial) -> str:
    shell = f"{1000 * trial.shell.translation:.0f}mm"
    return f"{_plain(trial.scene)}_{trial.instance}_{shell}_{trial.start}"


def _plain(name: str) -> str:
    return "_".join("".join(letter if letter.isalnum() or letter == "-" else " " for letter in name).split())
