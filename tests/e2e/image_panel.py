"""The colour image in the panel of a labelling page: what is drawn over it, and how it is shown."""

import base64
import io
from dataclasses import dataclass

import numpy as np
import PIL.Image
from numpy.typing import NDArray

from registration_core import Intrinsics, ObjectModel
from registration_core.rendering.rasterizer import render_depth
from tests.e2e.labelling_page import LabellingPage

PIXELS = "selector => Array.from(document.querySelectorAll(selector), canvas => canvas.toDataURL())"
VIEW = """() => {
  const { a, e, f } = new DOMMatrix(getComputedStyle(document.getElementById("color")).transform);
  return [a, e, f];
}"""
COVERED = 192
"""Alpha from which on a pixel is the object's, not the rim beside it."""


@dataclass(frozen=True)
class View:
    """How the image is shown: pixels of the page to one of its own, and where its corner lies in its box."""

    scale: float
    left: float
    top: float

    def camera(self, frame: dict, width: int, height: int) -> Intrinsics:
        """The frame's camera as it belongs to what is shown."""
        k = frame["intrinsics"]
        return Intrinsics(
            width,
            height,
            self.scale * k["fx"],
            self.scale * k["fy"],
            self.scale * (k["cx"] + 0.5) + self.left - 0.5,
            self.scale * (k["cy"] + 0.5) + self.top - 0.5,
        )


class ImagePanel:
    """The image in the panel of a labelling page."""

    def __init__(self, labelling: LabellingPage) -> None:
        self.labelling = labelling
        self.page = labelling.page
        get = lambda path: self.page.request.get(f"{labelling.root}{path}")  # noqa: E731
        self.frames = get(f"/api/scenes/{labelling.task['scene']['id']}").json()["frames"]
        mesh = get(f"/api/objects/{labelling.task['object']['id']}/mesh.ply").body()
        self.model = ObjectModel.from_bytes(mesh, "ply", "mm")

    @property
    def view(self) -> View:
        return View(*self.page.evaluate(VIEW))

    @property
    def pixels(self) -> NDArray[np.uint8]:
        """What is drawn over the image (H, W, 4)."""
        (drawn,) = self.drawn_on("#outline")
        return drawn

    def drawn_on(self, selector: str) -> list[NDArray[np.uint8]]:
        """What is on the canvases (H, W, 4)."""
        pictures = [base64.b64decode(url.partition(",")[2]) for url in self.page.evaluate(PIXELS, selector)]
        return [np.array(PIL.Image.open(io.BytesIO(png)).convert("RGBA")) for png in pictures]

    @property
    def place(self) -> NDArray[np.float64]:
        """The middle (2,) of what is drawn, pixels; NaN where nothing is."""
        rows, columns = np.nonzero(self.pixels[..., 3] > COVERED)
        return np.array([columns.mean(), rows.mean()]) if len(rows) else np.full(2, np.nan)

    def blend(self, share: float) -> None:
        self.page.locator("#blend").fill(str(share))

    def put(self, T_camera_object: NDArray[np.float64]) -> None:
        """Put the object somewhere in the first frame."""
        T_world_object = np.array(self.frames[0]["T_world_camera"]) @ T_camera_object
        body = {"T_world_object": T_world_object.tolist()}
        assert self.page.request.put(f"{self.labelling.url}/pose", data=body).ok

    def silhouette(self, T_camera_object: NDArray[np.float64]) -> NDArray[np.bool_]:
        """Where the object is in the first frame as it is shown, by the library."""
        height, width, _ = self.pixels.shape
        return render_depth(self.model, self.view.camera(self.frames[0], width, height), T_camera_object) > 0

    def overlap(self, expected: NDArray[np.bool_]) -> float:
        """Intersection over union of what is drawn and what should be."""
        drawn = self.pixels[..., 3] > COVERED
        return float((drawn & expected).sum() / (drawn | expected).sum())
