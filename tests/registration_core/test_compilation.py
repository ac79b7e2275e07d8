"""After `warm_up()` nothing is left to compile."""

import subprocess
import sys
from pathlib import Path

CODE = """
import sys
import numpy as np
import trimesh
from numba.core.dispatcher import Dispatcher
from registration_core import SnapConfig, propose, region_of_interest, snap, snap_steps, snap_views
from registration_core import color_is_aligned, warm_up
from registration_core.geometry import pose
from registration_core.synthetic.objects import demo_objects
from registration_core.rendering.rasterizer import render_depth
from tests.registration_core.simple_scene import standing_tool

def compiled():
    modules = [module for name, module in sys.modules.items() if name.startswith("registration_core")]
    kernels = {id(item): item for module in modules for item in vars(module).values()
               if isinstance(item, Dispatcher)}
    return {f"{kernel.__name__}{signature}" for kernel in kernels.values() for signature in kernel.signatures}

assert not compiled(), "something is compiled at import"
warm_up()
warm = compiled()
scene = standing_tool()
for model in [scene.model, *(known.model for known in demo_objects())]:
    truth = scene.truth @ pose.from_rotation_translation(np.eye(3), scene.model.centre - model.centre)
    depth = render_depth(model, scene.camera, truth)
    depth = np.where((scene.depth == 0) | ((depth > 0) & (depth < scene.depth)), depth, scene.depth)
    left, top, width, height = region_of_interest(model, scene.camera, truth, SnapConfig())
    part, seen_by = depth[top:top + height, left:left + width], scene.camera.cropped(left, top, width, height)
    start = pose.perturbed(truth, 0.05, 0.5, np.random.default_rng(0))
    for given in (part, part.copy()):
        snap(model, given, seen_by, start, None, np.random.default_rng(0))
    for given in (depth, depth.astype(np.float64), depth.tolist(), np.asfortranarray(depth)):
        snap(model, given, scene.camera, start, None, np.random.default_rng(0), (0.02, 0.2))
    color = np.random.default_rng(1).integers(0, 256, (*depth.shape, 3)).astype(np.uint8)
    color.setflags(write=False)
    assert not color_is_aligned(color, depth)
    snap(model, depth, scene.camera, start, None, np.random.default_rng(0), color=color)
    crop = color[top:top + height, left:left + width]
    snap(model, part, seen_by, start, None, np.random.default_rng(0), color=crop)
    snap_views(model, [(depth, scene.camera, np.eye(4))], start, rng=np.random.default_rng(0))
    propose(model, depth, scene.camera, (left, top, width, height), rng=np.random.default_rng(0))
    steps = snap_steps(model, depth, scene.camera, truth, SnapConfig.paper(), np.random.default_rng(0))
    for _ in range(3):
        next(steps)
print(len(warm), sorted(compiled() - warm))
"""


def test_nothing_is_compiled_after_warm_up() -> None:
    root = Path(__file__).resolve().parents[2]
    done = subprocess.run([sys.executable, "-c", CODE], cwd=root, capture_output=True, text=True, check=False)
    assert done.returncode == 0, done.stderr
    count, late = done.stdout.strip().split(" ", 1)
    assert int(count) >= 10
    assert late == "[]"
