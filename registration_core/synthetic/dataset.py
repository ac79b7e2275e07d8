"""The demo dataset: tabletop scenes made in code, with pictures and known poses, in BOP's layout.

`python -m registration_core.synthetic.dataset OUT --seed 0` writes it. Scenes for benchmarks come from
`make_scene`.
"""

import argparse
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray
from scipy.ndimage import gaussian_filter
from scipy.spatial import cKDTree

from registration_core.bop import writer as bop_writer
from registration_core.geometry import pose
from registration_core.rendering.opengl import Light, Renderer, Surroundings
from registration_core.synthetic.objects import ProceduralObject, demo_objects
from registration_core.synthetic.scene import CAMERA, TABLE_SIZE, Scene, View, make_scene

Array = NDArray[np.float64]

__all__ = ["make_demo_dataset", "make_scene"]

SCENES, VIEWS, DISTRACTORS = 4, 3, 4

DEPTH_SCALE = 0.1
"""Raw depth times this is millimetres."""

LEAST_VISIBLE, LEAST_VISIBLE_ONCE = 0.15, 0.4
"""Share of an object's silhouette that shows in every view, and in its best one."""

WOOD, WALL = (176, 132, 92), (0.72, 0.75, 0.79)
PLANK, GRAIN = 0.15, 0.004
"""Width of the table's planks and of the cells that carry its pattern, metres."""

SHADE, SHADE_REACH = 0.6, 0.016
"""Share of light lost where a thing touches the table, and the distance in which that fades, metres."""

LIGHTS = (((0.45, 0.35, -0.82), 3.2, (1.0, 0.97, 0.92)), ((-0.6, -0.2, -0.75), 1.0, (0.85, 0.92, 1.0)))
"""Direction in the world, intensity and colour: a warm main lamp and a weak cool one."""


def make_demo_dataset(out: Path, seed: int = 0, scenes: int = SCENES) -> None:
    """Write the demo scenes to `out`; on one machine the same seed gives the same bytes.

    Raises:
        RenderingError: where OpenGL cannot be started.
    """
    objects = demo_objects()
    write_models(out, objects)
    bop_writer.write_json(out / "camera.json", bop_writer.camera_file(CAMERA, DEPTH_SCALE))
    with Renderer(CAMERA) as renderer:
        for scene_id in range(1, scenes + 1):
            rng = np.random.default_rng([seed, scene_id])
            scene = make_demo_scene(rng, objects)
            table = table_top(rng, things_of(scene, objects))
            write_scene(out / "test" / f"{scene_id:06d}", scene)
            for image_id, view in enumerate(scene.views):
                path = out / "test" / f"{scene_id:06d}" / "rgb" / f"{image_id:06d}.png"
                bop_writer.write_color_png(path, picture(renderer, scene, view, objects, table))


def make_demo_scene(rng: np.random.Generator, objects: Sequence[ProceduralObject]) -> Scene:
    """A random scene in which every object shows well enough."""
    while True:
        scene = make_scene(rng, [known.model for known in objects], DISTRACTORS, VIEWS)
        visible = np.array([[instance.visible for instance in view.instances] for view in scene.views])
        if visible.min() >= LEAST_VISIBLE and visible.max(axis=0).min() >= LEAST_VISIBLE_ONCE:
            return scene


def write_models(out: Path, objects: Sequence[ProceduralObject]) -> None:
    """Meshes, sizes with symmetries, and names."""
    numbered = dict(enumerate(objects, start=1))
    for obj_id, known in numbered.items():
        bop_writer.write_mesh(out / "models" / f"obj_{obj_id:06d}.ply", known.mesh)
    infos = {obj_id: bop_writer.model_info(known.model) for obj_id, known in numbered.items()}
    bop_writer.write_json(out / "models" / "models_info.json", infos)
    names = {obj_id: known.name for obj_id, known in numbered.items()}
    bop_writer.write_json(out / "models" / "names.json", names)


def write_scene(folder: Path, scene: Scene) -> None:
    """Depth images, cameras and true poses of one scene."""
    cameras, truths = {}, {}
    for image_id, view in enumerate(scene.views):
        cameras[image_id] = bop_writer.camera_entry(view.camera, DEPTH_SCALE, view.T_world_camera)
        truths[image_id] = [
            bop_writer.gt_entry(obj_id, instance.T_camera_object)
            for obj_id, instance in enumerate(view.instances, start=1)
        ]
        bop_writer.write_depth_png(folder / "depth" / f"{image_id:06d}.png", view.depth, DEPTH_SCALE)
    bop_writer.write_json(folder / "scene_camera.json", cameras)
    bop_writer.write_json(folder / "scene_gt.json", truths)


def picture(
    renderer: Renderer,
    scene: Scene,
    view: View,
    objects: Sequence[ProceduralObject],
    table: trimesh.Trimesh,
) -> NDArray[np.uint8]:
    """The colour image (H, W, 3) of a view."""
    T_camera_world = pose.inverse(view.T_world_camera)
    placed = [
        (mesh, T_camera_world @ T_world_mesh)
        for mesh, T_world_mesh in [(table, np.eye(4)), *things_of(scene, objects)]
    ]
    lights = []
    for direction, intensity, color in LIGHTS:
        x, y, z = T_camera_world[:3, :3] @ direction
        lights.append(Light((x, y, z), intensity, color))
    return renderer.color(placed, lights, Surroundings(ambient=(0.3, 0.3, 0.32), background=WALL))


def things_of(scene: Scene, objects: Sequence[ProceduralObject]) -> list[tuple[trimesh.Trimesh, Array]]:
    """Everything on the table: coloured meshes with `T_world_object`."""
    known = [(shape.mesh, where.T_world_object) for shape, where in zip(objects, scene.objects, strict=True)]
    return known + [(shape.mesh, T_world_object) for shape, T_world_object in scene.distractors]


def table_top(rng: np.random.Generator, things: Sequence[tuple[trimesh.Trimesh, Array]]) -> trimesh.Trimesh:
    """The table's top as a grid whose vertex colours show wooden planks, darker under `things`."""
    cells = round(TABLE_SIZE / GRAIN)
    x, y = np.meshgrid(*2 * [np.linspace(-TABLE_SIZE / 2, TABLE_SIZE / 2, cells + 1)], indexing="ij")
    points = np.stack([x, y, np.zeros_like(x)], axis=-1).reshape(-1, 3)
    index = np.arange(len(points)).reshape(x.shape)
    a, b, c, d = (part.ravel() for part in (index[:-1, :-1], index[1:, :-1], index[1:, 1:], index[:-1, 1:]))
    faces = np.concatenate([np.stack([a, b, c], axis=1), np.stack([a, c, d], axis=1)])
    mesh = trimesh.Trimesh(points, faces, process=False)
    brightness = (wood_brightness(y, rng).ravel() * contact_shade(points, things))[:, None]
    colors = np.clip(np.array(WOOD) * brightness, 0, 255).astype(np.uint8)
    mesh.visual.vertex_colors = np.column_stack([colors, np.full(len(colors), 255, dtype=np.uint8)])
    return mesh


def wood_brightness(y: Array, rng: np.random.Generator) -> Array:
    """Factors about 1 for a grid (N, M) whose planks lie along its first axis; y in metres."""
    grain = gaussian_filter(rng.normal(size=y.shape), (40.0, 1.2))
    cloud = gaussian_filter(rng.normal(size=y.shape), (60.0, 6.0))
    plank = np.floor(y / PLANK).astype(int)
    tint = rng.uniform(-0.06, 0.06, plank.max() - plank.min() + 1)[plank - plank.min()]
    seam = np.abs(y / PLANK - np.rint(y / PLANK)) * PLANK < GRAIN / 2.0
    return 1.0 + tint + 0.04 * grain / grain.std() + 0.03 * cloud / cloud.std() - 0.35 * seam


def contact_shade(points: Array, things: Sequence[tuple[trimesh.Trimesh, Array]]) -> Array:
    """Factors up to 1 for points (N, 3): the light that things close to them leave."""
    samples = [
        pose.apply(T_world_object, trimesh.sample.sample_surface(mesh, 5000, seed=0)[0])
        for mesh, T_world_object in things
    ]
    distances, _ = cKDTree(np.concatenate(samples)).query(points, distance_upper_bound=0.1)
    return 1.0 - SHADE * np.exp(-distances / SHADE_REACH)


def main() -> None:
    """The command line."""
    parser = argparse.ArgumentParser(description="Write Snap6D's demo dataset.")
    parser.add_argument("out", type=Path, help="folder of the new dataset")
    parser.add_argument("--seed", type=int, default=0)
    arguments = parser.parse_args()
    make_demo_dataset(arguments.out, arguments.seed)
    print(f"Wrote {SCENES} scenes of {VIEWS} views each to {arguments.out}")


if __name__ == "__main__":
    main()
