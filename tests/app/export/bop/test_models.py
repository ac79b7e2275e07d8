"""Exported meshes."""

from pathlib import Path

import numpy as np
import trimesh

from app.export.bop.models import evenly_sampled, write_models
from app.export.content.selection import ExportObject
from app.storage.files import FileStore
from registration_core import ObjectModel, Symmetries
from tests.app.export.site import TOOL, mesh_of, model_of


def test_vertices_of_an_evaluation_mesh_lie_on_the_surface_and_are_spread_evenly() -> None:
    model = model_of(trimesh.creation.box((0.08, 0.06, 0.04)))
    sampled = evenly_sampled(model)
    on_a_side = np.isclose(np.abs(sampled.vertices), np.array([0.04, 0.03, 0.02]), atol=1e-6).any(axis=1)
    assert on_a_side.all()
    area_of_each = model_of(sampled).diameter ** 2 / 40**2
    assert 0.5 < len(sampled.vertices) * area_of_each / sampled.area < 2.0
    assert abs(model_of(sampled).diameter - model.diameter) < 0.03 * model.diameter


def test_a_mesh_of_another_format_is_converted_and_keeps_its_size(tmp_path: Path) -> None:
    files = FileStore(tmp_path / "files")
    mesh = mesh_of(TOOL)
    mesh.apply_scale(1000.0)
    digest = files.put_bytes(mesh.export(file_type="stl"))
    write_models(tmp_path, [ExportObject(2, "tool", digest, "stl", Symmetries())], files)
    model = ObjectModel.load(tmp_path / "models" / "obj_000002.ply", unit="mm")
    np.testing.assert_allclose(model.diameter, model_of(mesh_of(TOOL)).diameter, rtol=1e-6)
