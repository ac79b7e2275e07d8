"""Objects of BOP datasets: meshes in millimetres, sizes, symmetries and names."""

from collections.abc import Callable
from dataclasses import dataclass
from pathlib import Path, PureWindowsPath

import numpy as np

from registration_core.bop.fields import (
    LONGEST_NAME,
    METRES_PER_MILLIMETRE,
    BopFormatError,
    Entry,
    is_id,
    is_name,
    name_of,
    optional_json,
    shortened,
)
from registration_core.bop.images import ImageFile, examined_picture
from registration_core.bop.layout import instead_of_models, mesh_files
from registration_core.geometry.mesh_file import read_mesh, texture_name
from registration_core.geometry.object_model import PLAUSIBLE_DIAMETER, ObjectModel, Symmetries

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
    texture: ImageFile | None = None
    """The picture that the mesh file names for its texture, where it is there."""
    missing_texture: str | None = None
    """Its name, where it is not."""


def find_meshes(root: Path) -> dict[int, Path]:
    """Mesh file by object id."""
    meshes: dict[int, Path] = {}
    for path in mesh_files(root):
        number = path.stem.removeprefix("obj_")
        if not is_id(number):
            raise BopFormatError(
                f"models/{path.name[:60]} must be named by a number of at most 9 digits, as obj_000001.ply"
            )
        other = meshes.setdefault(int(number), path)
        if other is not path:
            raise BopFormatError(
                f"models/{other.name} and models/{path.name} are both object {int(number)}; keep one of them"
            )
    if not meshes:
        raise BopFormatError(f"models has no mesh{instead_of_models(root)}")
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
        if not isinstance(name, str) or not is_name(name):
            raise BopFormatError(
                f"models/names.json: the name of object {obj_id} must be text of 1 to {LONGEST_NAME}"
                f" readable characters; it is {shortened(name)}"
            )
        content = path.read_bytes()
        model = read_model(content, name_of(path, root), info.symmetries())
        check_diameter(model, info)
        texture, missing = find_texture(root / "models", content)
        objects.append(BopObject(obj_id, name, path, model, texture, missing))
        report(name_of(path, root))
    return tuple(objects)


def find_texture(folder: Path, mesh: bytes) -> tuple[ImageFile | None, str | None]:
    """The picture beside a mesh file, of this content, that it names for its texture; or the missing one's
    name. A name that leads elsewhere, as on its author's machine, is looked for here.
    """
    named = texture_name(mesh)
    if named is None:
        return None, None
    file_name = PureWindowsPath(named).name  # which also knows "/"
    path = folder / file_name
    if not is_name(file_name) or not path.is_file():
        return None, named
    return examined_picture(path, f"models/{file_name}"), None


def read_model(content: bytes, name: str, symmetries: Symmetries) -> ObjectModel:
    """The model in metres of a mesh file's content, in millimetres."""
    try:
        mesh = read_mesh(content, "ply")
        model = ObjectModel(
            np.asarray(mesh.vertices, dtype=np.float64) * METRES_PER_MILLIMETRE,
            np.asarray(mesh.faces, dtype=np.int32),
            symmetries,
        )
    except ValueError as error:
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
