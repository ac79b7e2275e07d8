"""Objects of BOP datasets: meshes in millimetres, sizes, symmetries and names."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path

import numpy as np

from registration_core.bop_fields import (
    METRES_PER_MILLIMETRE,
    BopFormatError,
    Entry,
    name_of,
    optional_json,
    shortened,
)
from registration_core.object_model import PLAUSIBLE_DIAMETER, ObjectModel, Symmetries, read_mesh

DIAMETER_TOLERANCE = 0.05
"""Share by which `models_info.json` may differ from the mesh: a decimated mesh is slightly smaller."""


@dataclass(frozen=True)
class BopObject:
    """A known object of a dataset."""

    obj_id: int
    name: str
    mesh_path: Path
    """The mesh file, millimetres."""
    model: ObjectModel
    """The same, metres, with the symmetries of `models_info.json`."""


def find_meshes(root: Path) -> dict[int, Path]:
    """Mesh file by object id."""
    paths = sorted((root / "models").glob("obj_*.ply"))
    if not paths:
        raise BopFormatError("models has no mesh; put meshes there as obj_000001.ply, in millimetres")
    meshes = {}
    for path in paths:
        number = path.stem.removeprefix("obj_")
        if not number.isdigit():
            raise BopFormatError(f"models/{path.name} must be named by its number, as obj_000001.ply")
        meshes[int(number)] = path
    return meshes


def read_objects(
    root: Path, mesh_paths: dict[int, Path], report: Callable[[str], None]
) -> tuple[BopObject, ...]:
    """All objects, in order of their ids; `report` is told of each."""
    infos = optional_json(root / "models" / "models_info.json", root)
    names = optional_json(root / "models" / "names.json", root)
    objects = []
    for obj_id, path in sorted(mesh_paths.items()):
        info = Entry.of(infos.get(obj_id, {}), f"models/models_info.json: object {obj_id}")
        name = names.get(obj_id, f"object {obj_id}")
        if not isinstance(name, str) or not name.strip():
            raise BopFormatError(
                f"models/names.json: the name of object {obj_id} must be text; it is {shortened(name)}"
            )
        model = read_model(path, name_of(path, root), info.symmetries())
        check_diameter(model, info)
        objects.append(BopObject(obj_id, name, path, model))
        report(name_of(path, root))
    return tuple(objects)


def read_model(path: Path, name: str, symmetries: Symmetries) -> ObjectModel:
    """The model in metres of a mesh file in millimetres."""
    try:
        mesh = read_mesh(path.read_bytes(), "ply")
        model = ObjectModel(
            np.asarray(mesh.vertices, dtype=np.float64) * METRES_PER_MILLIMETRE,
            np.asarray(mesh.faces, dtype=np.int32),
            symmetries,
        )
    except (OSError, ValueError) as error:
        raise BopFormatError(f"{name}: {error}; replace the file") from error
    low, high = PLAUSIBLE_DIAMETER
    if not low <= model.diameter <= high:
        raise BopFormatError(
            f"{name}: mesh measures {model.diameter / METRES_PER_MILLIMETRE:.4g} mm across, which is"
            " implausible; models must be in millimetres"
        )
    return model


def check_diameter(model: ObjectModel, info: Entry) -> None:
    """Raise where `models_info.json` tells another size than the mesh has."""
    if not info.has("diameter"):
        return
    told = info.positive("diameter", "millimetres")
    measured = model.diameter / METRES_PER_MILLIMETRE
    if abs(told - measured) > DIAMETER_TOLERANCE * measured:
        raise BopFormatError(
            f"{info.where}: diameter is {told:.6g} mm but the mesh measures {measured:.6g} mm;"
            " correct it, or the mesh's unit"
        )
