"""The research prototype, where it lies beside the project, answers as every method does."""

import numpy as np
import pytest

from benchmarks.registration import prototype
from benchmarks.registration.instances import HALF, Instance
from benchmarks.registration.judging import Judge
from benchmarks.registration.starts import MIDDLE, starts
from registration_core.geometry import pose
from registration_core.synthetic.objects import demo_objects
from registration_core.synthetic.scene import make_scene

if not prototype.is_there():
    pytest.skip(f"needs the prototype in {prototype.FOLDER}", allow_module_level=True)

DRILL = demo_objects()[0].model


def test_it_finds_an_object_whose_origin_lies_elsewhere() -> None:
    (view,) = make_scene(np.random.default_rng(2), [DRILL], distractors=1).views
    shifted = DRILL.vertices + np.array([0.1, -0.2, 0.3])
    model = type(DRILL)(shifted, DRILL.faces)
    T_drill_model = pose.from_rotation_translation(np.eye(3), np.array([-0.1, 0.2, -0.3]))
    truth = view.instances[0].T_camera_object @ T_drill_model
    instance = Instance(HALF, "one", "drill", model, view.depth, view.camera, truth, 0)
    found = [
        prototype.prototype_snap(instance, T_start, 3)
        for T_start in starts(truth, model, view.camera, MIDDLE, 2, 0)
    ]
    assert all(Judge(model).error(T, truth).is_right for T in found)


def test_nothing_is_written_beside_it() -> None:
    prototype.prepare(DRILL)
    assert not list(prototype.FOLDER.rglob("*.pyc")) and not list(prototype.FOLDER.rglob("*.nb?"))
    assert list(prototype.KERNELS.rglob("*.nbc"))
