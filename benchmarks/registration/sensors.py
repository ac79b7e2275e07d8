"""Sensor families beside real sensors: the same statistics of depth at true poses.

For each real set the families measure what its own camera would see of its own objects: distances, sizes and
what hides what are the same. Meshes are a little wrong, as they are in reality.
"""

import time
from collections.abc import Callable, Iterator, Mapping, Sequence
from dataclasses import dataclass
from functools import cached_property
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from rich.console import Console
from rich.table import Table
from scipy.ndimage import binary_dilation, distance_transform_edt, median_filter

from benchmarks.figures import Figure, Target
from benchmarks.registration.objects import DATA, known_objects, read_model
from benchmarks.registration.residuals import HIDDEN, Residuals, residuals
from registration_core import Intrinsics, ObjectModel
from registration_core.bop.dataset import read_dataset, read_depth
from registration_core.rendering.rasterizer import render_depth
from registration_core.synthetic.mesh_error import imprecise
from registration_core.synthetic.scene import make_scene
from registration_core.synthetic.sensor_families import FAMILIES, SensorFamily, draw_sensor, measure
from registration_core.synthetic.tabletop import Layout

TITLE = "Sensors: how much of what real sets show lies within what their kind of sensor draws"

Array = NDArray[np.float64]
DepthImage = NDArray[np.float32]


@dataclass(frozen=True)
class RealSet:
    """Images whose objects have true poses, all of one sensor."""

    every: int
    """How many images further the next one is taken."""
    kind: str
    """Name of the family that stands for this sensor."""


REAL = {
    "ycbv": RealSet(1, "structured light"),
    "bunny": RealSet(6, "structured light"),
    "moro": RealSet(2, "active stereo"),
    "rbt": RealSet(10, "active stereo"),
    "apc": RealSet(1, "line pattern"),
}
SYNTHETIC = "synthetic scenes"
LAYOUT = Layout(distance=(0.4, 1.0))
SCENES, OBJECTS_A_SCENE = 5, 4
OWN, OTHERS, QUICK = 24, 6, 1
"""Images of each set that its own kind of sensor draws, and any other family; in a quick run."""
NEARBY, SMOOTH = 8, 9
"""Pixels around objects where a real background is not trusted, and over which it is smoothed."""
OUTER = (5, 95)
"""Percentiles of a family's instances between which it spans a statistic."""
SHOWN = (10, 50, 90)
"""Percentiles in the tables."""
TABLE_WIDTH = 200
"""Columns, also where the output is no terminal."""
NARROWEST = 17
"""Columns that no cell of it needs more of."""
FAST_ENOUGH = 200.0
"""Milliseconds for one image of 640x480 pixels."""

STATISTICS: Mapping[str, Callable[[Residuals], float]] = {
    "bias, mm": lambda r: 1e3 * r.bias,
    "spread, mm": lambda r: 1e3 * r.spread,
    "95 % within, mm": lambda r: 1e3 * r.p95,
    "correlation length, px": lambda r: r.length,
    "3-6 mm off, %": lambda r: 100.0 * r.off[0],
    "6-12 mm off, %": lambda r: 100.0 * r.off[1],
    "over 12 mm off, %": lambda r: 100.0 * r.off[2],
    "missing inside, %": lambda r: 100.0 * r.missing_inside,
    "missing at rims, %": lambda r: 100.0 * r.missing_rim,
    "step at 1 m, mm": lambda r: 1e3 * r.step,
    "outline pixel off, mm": lambda r: 1e3 * float(r.rim[0, 0]),
    "2 px inside": lambda r: 1e3 * float(r.rim[2, 0]),
    "4 px inside": lambda r: 1e3 * float(r.rim[4, 0]),
    "outline pixel, spread": lambda r: 1e3 * float(r.rim[0, 1]),
    "2 px inside, spread": lambda r: 1e3 * float(r.rim[2, 1]),
    "outline pixel missing, %": lambda r: 100.0 * float(r.rim[0, 3]),
    "2 px inside, missing": lambda r: 100.0 * float(r.rim[2, 3]),
    "4 px inside, missing": lambda r: 100.0 * float(r.rim[4, 3]),
    "1 px beyond claimed, %": lambda r: 100.0 * float(r.beyond[0, 0]),
    "3 px beyond, claimed": lambda r: 100.0 * float(r.beyond[2, 0]),
    "1 px beyond missing, %": lambda r: 100.0 * float(r.beyond[0, 1]),
    "3 px beyond, missing": lambda r: 100.0 * float(r.beyond[2, 1]),
}
"""Of the profile along rims, those at the outline come first."""


@dataclass(frozen=True, eq=False)
class Shot:
    """An image with known objects in it."""

    camera: Intrinsics
    objects: Sequence[tuple[ObjectModel, Array]]
    """Models with `T_camera_object` (4, 4)."""
    depth: DepthImage
    """(H, W), metres: measured in a real image, perfect in a synthetic one."""

    @cached_property
    def truth(self) -> tuple[DepthImage, NDArray[np.int32]]:
        """Perfect depth (H, W) and, for each pixel, the index of the object that is seen there, or -1."""
        return self._with([model for model, _ in self.objects])

    def residuals(self, depth: DepthImage) -> list[Residuals]:
        """Of each object of which enough is seen."""
        perfect, owner = self.truth
        found = [residuals(depth, perfect, owner, index) for index in range(len(self.objects))]
        return [one for one in found if one is not None]

    def measured_by(self, family: SensorFamily, rng: np.random.Generator) -> DepthImage:
        """Depth (H, W) as a sensor sees objects that differ a little from their meshes."""
        perfect, _ = self._with([imprecise(model, rng) for model, _ in self.objects])
        return measure(perfect, self.camera, rng, draw_sensor(family, rng))

    def _with(self, models: Sequence[ObjectModel]) -> tuple[DepthImage, NDArray[np.int32]]:
        """The same as `truth` with other models in place of the objects'."""
        nearest = np.full(self.depth.shape, np.float32(np.inf))
        owner = np.full(self.depth.shape, -1, dtype=np.int32)
        for index, (model, (_, T_camera_object)) in enumerate(zip(models, self.objects, strict=True)):
            drawn = render_depth(model, self.camera, T_camera_object)
            shows = (drawn > 0.0) & (drawn < nearest)
            nearest[shows], owner[shows] = drawn[shows], index
        owner[(self.depth > 0.0) & (self.depth < nearest - HIDDEN)] = -1
        return np.where(owner < 0, self._background, nearest), owner

    @cached_property
    def _background(self) -> DepthImage:
        """Depth (H, W) of what is no known object, smooth, and filled in where objects are."""
        known = np.zeros(self.depth.shape, dtype=bool)
        for model, T_camera_object in self.objects:
            drawn = render_depth(model, self.camera, T_camera_object)
            known |= (drawn > 0.0) & (self.depth >= drawn - HIDDEN)
        trusted = (self.depth > 0.0) & ~binary_dilation(known, iterations=NEARBY)
        if not trusted.any():
            return np.zeros_like(self.depth)
        row, column = distance_transform_edt(~trusted, return_distances=False, return_indices=True)
        return np.asarray(median_filter(self.depth[row, column], SMOOTH), dtype=np.float32)


def run(folder: Path, quick: bool) -> list[Figure]:
    """Statistics of every set beside those of every family; prints the tables."""
    console = Console(highlight=False, width=max(Console().width, TABLE_WIDTH))
    figures = []
    for name, real_set in REAL.items() if DATA.is_dir() else ():
        shots = list(real_shots(name, real_set.every))[: 1 if quick else None]
        real = [one for shot in shots for one in shot.residuals(shot.depth)]
        counts = dict.fromkeys(FAMILIES, QUICK if quick else OTHERS)
        counts[real_set.kind] = QUICK if quick else OWN
        drawn = {family: family_residuals(FAMILIES[family], shots, n) for family, n in counts.items()}
        print_table(console, name, {"real": real, **drawn})
        share = 100.0 * float(np.mean(spanned(real, drawn[real_set.kind])))
        figures.append(Figure(f"{name}: spanned by {real_set.kind}", share, "%"))
    shots = list(synthetic_shots(1 if quick else SCENES))
    drawn = {family.name: family_residuals(family, shots, len(shots)) for family in FAMILIES.values()}
    print_table(console, SYNTHETIC, drawn)
    return [*figures, *(_duration(family, shots[0]) for family in FAMILIES.values())]


def real_shots(name: str, every: int) -> Iterator[Shot]:
    """Images of the first scene of a real set."""
    dataset = read_dataset(DATA / name)
    images = next(scene for scene in dataset.scenes if scene.scene_id == 1).images
    models: dict[int, ObjectModel] = {}
    for image in images[::every]:
        truths = image.ground_truth or ()
        for obj_id in {truth.obj_id for truth in truths} - set(models):
            models[obj_id] = read_model(DATA / name, obj_id)
        objects = [(models[truth.obj_id], truth.T_camera_object) for truth in truths]
        yield Shot(image.camera, objects, read_depth(image.depth.path, image.depth_scale))


def synthetic_shots(scenes: int) -> Iterator[Shot]:
    """Views of objects among unknown things, at distances as those of the real sets."""
    objects = list(known_objects().values())
    for scene_id in range(scenes):
        rng = np.random.default_rng([3, scene_id])
        models = [objects[k] for k in rng.permutation(len(objects))[:OBJECTS_A_SCENE]]
        (view,) = make_scene(rng, models, layout=LAYOUT).views
        placed = zip(models, (instance.T_camera_object for instance in view.instances), strict=True)
        yield Shot(view.camera, list(placed), view.perfect_depth)


def family_residuals(family: SensorFamily, shots: Sequence[Shot], count: int) -> list[Residuals]:
    """What `count` sensors of a family make of the same images, in turn."""
    found = []
    for number in range(count):
        shot = shots[number % len(shots)]
        found += shot.residuals(shot.measured_by(family, np.random.default_rng(number)))
    return found


def spanned(real: Sequence[Residuals], drawn: Sequence[Residuals]) -> list[bool]:
    """Whether the median of the real instances lies where those of a family do, for each known statistic."""
    verdicts = []
    for statistic in STATISTICS.values():
        values, others = _values(real, statistic), _values(drawn, statistic)
        if len(values) and len(others):
            low, high = np.percentile(others, OUTER)
            verdicts.append(bool(low <= np.median(values) <= high))
    return verdicts


def print_table(console: Console, title: str, columns: Mapping[str, Sequence[Residuals]]) -> None:
    """A row a statistic, a column a sensor: median of its instances, and where four fifths lie."""
    table = Table(title=title, title_justify="left")
    table.add_column("", no_wrap=True)
    for sensor in columns:
        table.add_column(sensor, justify="right", min_width=NARROWEST)
    for name, statistic in STATISTICS.items():
        table.add_row(name, *(_span(_values(instances, statistic)) for instances in columns.values()))
    console.print(table)


def _values(instances: Sequence[Residuals], statistic: Callable[[Residuals], float]) -> Array:
    """What is known of the statistic: there may be no rim."""
    values = np.array([statistic(one) for one in instances])
    return values[np.isfinite(values)]


def _span(values: Array) -> str:
    if not len(values):
        return ""
    low, middle, high = np.percentile(values, SHOWN)
    return f"{middle:.1f} ({low:.1f}, {high:.1f})"


def _duration(family: SensorFamily, shot: Shot) -> Figure:
    """Time of the processor for one image; the first one may compile."""
    seconds = []
    for seed in range(4):
        began = time.process_time()
        rng = np.random.default_rng(seed)
        measure(shot.truth[0], shot.camera, rng, draw_sensor(family, rng))
        seconds.append(time.process_time() - began)
    return Figure(f"{family.name}: an image, processor", 1e3 * min(seconds), "ms", Target(FAST_ENOUGH))
