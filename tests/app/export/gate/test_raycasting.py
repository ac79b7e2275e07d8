"""The gate's renderer against arithmetic and against the z-buffer."""

from pathlib import Path

import numpy as np

from app.export.gate.raycasting import RayCaster
from registration_core.bop.dataset import BopObject
from registration_core.geometry import pose
from registration_core.rendering.rasterizer import render_depth
from tests.app.export.content.test_visibility import CAMERA as PLATE_CAMERA
from tests.app.export.content.test_visibility import PLATE, at
from tests.app.export.site import CAMERA, NEAR_VIEW, T_WORLD_TOOL, TOOL, mesh_of, model_of


def test_a_plate_covers_the_pixels_it_should() -> None:
    caster = RayCaster([BopObject(1, "plate", Path(), PLATE)])
    depth = caster.depth(1, PLATE_CAMERA, at())
    np.testing.assert_allclose(depth[35:45, 40:60], 1.0, rtol=1e-6)
    assert np.count_nonzero(depth) == 200
    assert caster.nearest_and_farthest(1, at(z=-2.0)) == (-2.0, -2.0)


def test_it_agrees_with_the_z_buffer() -> None:
    model = model_of(mesh_of(TOOL))
    T = pose.inverse(NEAR_VIEW) @ T_WORLD_TOOL
    cast = RayCaster([BopObject(TOOL, "tool", Path(), model)]).depth(TOOL, CAMERA, T)
    drawn = render_depth(model, CAMERA, T)
    both = (cast > 0) & (drawn > 0)
    assert np.count_nonzero(both) > 500
    assert np.count_nonzero((cast > 0) != (drawn > 0)) <= 3
    np.testing.assert_allclose(cast[both], drawn[both], atol=1e-5)
