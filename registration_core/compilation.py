"""Compiling the kernels ahead, at installation or when a worker starts, never in an operator's first snap."""

import numpy as np
import trimesh

from registration_core.config import AnywhereConfig, ParticleFilterConfig, RoundConfig, SnapConfig
from registration_core.geometry import pose
from registration_core.geometry.camera import Intrinsics
from registration_core.geometry.kernels import f4
from registration_core.geometry.object_model import ObjectModel, discrete
from registration_core.propose import propose
from registration_core.rendering.rasterizer import render_depth
from registration_core.snap import snap
from registration_core.snap_views import snap_views


def warm_up() -> None:
    """Compile or load every kernel by a few tiny snaps, so that the first real one is fast.

    They meet what any snap may: a start that is off, a supporting plane, a symmetry, a reduced image, colour.
    """
    box = trimesh.creation.box((0.08, 0.05, 0.03))
    half_turn = discrete([np.diag([-1.0, -1.0, 1.0, 1.0])])
    model = ObjectModel(np.asarray(box.vertices), np.asarray(box.faces, dtype=np.int32), half_turn)
    camera = Intrinsics(320, 240, 300.0, 300.0, 159.5, 119.5)
    T = pose.exp([0.0, 0.0, 0.4, 0.5, 0.3, 0.0])
    drawn = render_depth(model, camera, T)
    depth = np.where(drawn > 0.0, drawn, f4(0.45))
    start = pose.perturbed(T, 0.03, 0.4, np.random.default_rng(0))
    short = SnapConfig(method="particle_filter", particle_filter=ParticleFilterConfig(8, 2))
    whole = SnapConfig(rounds=(RoundConfig(share=0.3, widening=1.0, doubt=1.0),))
    color = np.zeros((*depth.shape, 3), np.uint8)
    for config in (whole, short):
        snap(model, depth, camera, start, config, np.random.default_rng(0), color=color)
    snap_views(model, [(depth, camera, np.eye(4))], start, whole, np.random.default_rng(0))
    propose(model, depth, camera, config=SnapConfig(anywhere=AnywhereConfig(2_000, 500)))
