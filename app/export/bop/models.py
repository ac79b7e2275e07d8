"""The folders `models` and `models_eval` of a BOP dataset, from the stored meshes."""

import io
from collections.abc import Sequence
from pathlib import Path

import numpy as np
import open3d as o3d
import trimesh
from numpy.typing import NDArray
from PIL import Image

from app.export.content.selection import ExportObject
from app.storage.files import FileStore
from registration_core import ObjectModel
from registration_core.bop.images import JPEG_FORMATS
from registration_core.bop.writer import model_info, write_json, write_mesh
from registration_core.geometry.mesh_file import plain_ply, read_mesh

Array = NDArray[np.float64]

MESH_UNIT = "mm"
"""The unit of stored meshes."""

SPACING = 1 / 40
"""Distance of neighbouring vertices in `models_eval`, as a share of the diameter."""


def load_model(files: FileStore, export_object: ExportObject) -> ObjectModel:
    """The model in metres of a stored mesh."""
    content = files.read(export_object.mesh_hash)
    return ObjectModel.from_bytes(content, export_object.mesh_format, MESH_UNIT, export_object.symmetries)


def write_models(folder: Path, objects: Sequence[ExportObject], files: FileStore) -> None:
    """Write meshes and `models_info.json` into `models` and `models_eval`, names into `models/names.json`."""
    infos = {}
    for export_object in objects:
        file_name = f"obj_{export_object.obj_id:06d}.ply"
        model = load_model(files, export_object)
        write_full_mesh(folder / "models" / file_name, export_object, files)
        write_mesh(folder / "models_eval" / file_name, evenly_sampled(model))
        infos[export_object.obj_id] = model_info(model)
    write_json(folder / "models" / "models_info.json", infos)
    write_json(folder / "models_eval" / "models_info.json", infos)
    write_json(folder / "models" / "names.json", {found.obj_id: found.name for found in objects})


def write_full_mesh(path: Path, export_object: ExportObject, files: FileStore) -> None:
    """Write the whole mesh as every tool reads it, with its texture's picture beside it."""
    content = files.read(export_object.mesh_hash)
    texture = files.read(export_object.texture_hash) if export_object.texture_hash else None
    mesh = read_mesh(content, export_object.mesh_format, texture)
    path.parent.mkdir(parents=True, exist_ok=True)
    if texture is None or mesh.visual.kind != "texture":
        path.write_bytes(plain_ply(mesh))
        return
    picture = path.with_suffix(picture_suffix(texture))
    picture.write_bytes(texture)
    path.write_bytes(plain_ply(mesh, picture.name))


def picture_suffix(content: bytes) -> str:
    """The ending of a stored picture's name."""
    with Image.open(io.BytesIO(content)) as picture:
        return ".jpg" if picture.format in JPEG_FORMATS else ".png"


def evenly_sampled(model: ObjectModel) -> trimesh.Trimesh:
    """A smaller mesh, metres, with vertices spread evenly over the surface, as pose errors want them."""
    step = SPACING * model.diameter
    vertices, faces = trimesh.remesh.subdivide_to_size(model.vertices, model.faces, step, max_iter=20)
    mesh = o3d.geometry.TriangleMesh(
        o3d.utility.Vector3dVector(vertices), o3d.utility.Vector3iVector(faces.astype(np.int32))
    )
    clustered = mesh.simplify_vertex_clustering(step, o3d.geometry.SimplificationContraction.Quadric)
    clustered.remove_unreferenced_vertices()
    on_surface = closest_points(model, np.asarray(clustered.vertices))
    return trimesh.Trimesh(on_surface, np.asarray(clustered.triangles), process=False)


def closest_points(model: ObjectModel, points: Array) -> Array:
    """The points (N, 3) of the model's surface that are nearest to the given ones."""
    surface = o3d.t.geometry.RaycastingScene()
    surface.add_triangles(
        o3d.core.Tensor.from_numpy(model.vertices.astype(np.float32)),
        o3d.core.Tensor.from_numpy(model.faces.astype(np.uint32)),
    )
    queries = o3d.core.Tensor.from_numpy(points.astype(np.float32))
    return surface.compute_closest_points(queries)["points"].numpy().astype(np.float64)
