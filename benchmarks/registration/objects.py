"""Known objects with their symmetries: the demo's own, and those of the YCB set where it is there."""

from dataclasses import dataclass, replace
from pathlib import Path

import numpy as np
import trimesh
from numpy.typing import NDArray

from benchmarks import PROJECT
from registration_core import ObjectModel, Symmetries
from registration_core.geometry import pose
from registration_core.geometry.object_model import ContinuousSymmetry, discrete
from registration_core.synthetic.objects import demo_objects

Array = NDArray[np.float64]

DATA = PROJECT.parent / "shared" / "data"
"""Real scenes, which are no part of the project."""


@dataclass(frozen=True)
class BoxSymmetries:
    """Turns about the axes of the oriented bounding box, 0 its shortest and 2 its longest."""

    half_turns: tuple[int, ...] = ()
    quarter_turns: tuple[int, ...] = ()
    revolution: int | None = None


SHORT, MIDDLE, LONG = 0, 1, 2
CUBOID = BoxSymmetries(half_turns=(SHORT, MIDDLE, LONG))

YCB_SYMMETRIES = {
    3: CUBOID,  # sugar box
    5: BoxSymmetries(half_turns=(LONG,)),  # mustard bottle
    8: CUBOID,  # gelatin box
    13: BoxSymmetries(revolution=SHORT),  # bowl
    19: BoxSymmetries(half_turns=(LONG,)),  # large clamp
    # foam brick: three shallow holes in one side, which the real frames do not show, break it
    21: BoxSymmetries(half_turns=(SHORT, MIDDLE, LONG), quarter_turns=(LONG,)),
}
"""What depth cannot tell apart, by object id; the meshes are scans, true to it within 2 mm on average."""

APC_BOX = BoxSymmetries(half_turns=(SHORT, MIDDLE, LONG), quarter_turns=(LONG,))
"""A tissue box of 112 x 110 x 128 mm, whose true poses are good to 5 mm."""

SYNTHETIC_YCB = (3, 5, 8, 10, 11, 13, 14, 15, 19)
"""Those without doubtful symmetries that differ most: also banana, pitcher, mug and drill."""


def known_objects() -> dict[str, ObjectModel]:
    """The objects of the synthetic scenes by name."""
    objects = {known.name: known.model for known in demo_objects()}
    if DATA.is_dir():
        objects |= {f"ycb {obj_id}": ycb_object(obj_id) for obj_id in SYNTHETIC_YCB}
    return objects


def ycb_object(obj_id: int) -> ObjectModel:
    """A YCB object in metres, in the frame of its mesh, with the symmetries that depth leaves it."""
    return with_symmetries(read_model(DATA / "ycbv", obj_id), YCB_SYMMETRIES.get(obj_id, BoxSymmetries()))


def read_model(dataset: Path, obj_id: int) -> ObjectModel:
    """An object of a BOP dataset, without symmetries."""
    return ObjectModel.load(dataset / "models" / f"obj_{obj_id:06d}.ply", "mm")


def with_symmetries(model: ObjectModel, symmetries: BoxSymmetries) -> ObjectModel:
    """The model with all products of the given turns."""
    T_box_mesh, _ = trimesh.bounds.oriented_bounds(
        trimesh.Trimesh(model.vertices, model.faces, process=False)
    )
    T_mesh_box = pose.inverse(T_box_mesh)
    if symmetries.revolution is not None:
        axis, middle = T_mesh_box[:3, symmetries.revolution], T_mesh_box[:3, 3]
        around = ContinuousSymmetry(tuple(axis.tolist()), tuple(middle.tolist()))
        return replace(model, symmetries=Symmetries(continuous=(around,)))
    turns = [(axis, np.pi) for axis in symmetries.half_turns]
    turns += [(axis, np.pi / 2) for axis in symmetries.quarter_turns]
    generators = [pose.exp([0.0, 0.0, 0.0, *angle * np.eye(3)[axis]]) for axis, angle in turns]
    return replace(model, symmetries=discrete([T_mesh_box @ T @ T_box_mesh for T in _group(generators)[1:]]))


def _group(generators: list[Array]) -> list[Array]:
    """All products of transforms (4, 4) that generate a finite group, the identity first."""
    members = [np.eye(4)]
    for member in members:  # grows while it is walked
        for generator in generators:
            product = member @ generator
            if not any(np.allclose(product, other, atol=1e-9) for other in members):
                members.append(product)
    return members
