"""The things of a scene that are done, in the 3-D view: meshes in colours of their own, with their names."""

from collections.abc import Callable, Sequence
from dataclasses import dataclass

import numpy as np
import trimesh
import viser
from scipy.spatial.transform import Rotation

from app.labeling.scene.instances import SceneInstance
from registration_core import ObjectModel
from registration_core.geometry import pose

OPACITY = 0.75
SHELL = 0.003
"""Metres by which the mesh is drawn thicker: measured points would hide one that lies where it should."""
LABEL_SCALE = 0.8
"""Of the names."""


@dataclass(frozen=True)
class _Shown:
    """What stands in the view for one thing."""

    thing: SceneInstance
    mesh: viser.MeshHandle
    label: viser.LabelHandle


class NeighbourView:
    """Draws things into a viser server and takes them away again; they have no gizmo.

    Args:
        server: Where to.
        drawable: Gives an object's mesh as it is to be drawn, in few enough faces.
    """

    def __init__(self, server: viser.ViserServer, drawable: Callable[[ObjectModel], ObjectModel]) -> None:
        self._server = server
        self._drawable = drawable
        self._shown: dict[int, _Shown] = {}

    def show(self, things: Sequence[SceneInstance]) -> None:
        """Show these things, which are known, and no others."""
        wanted = {thing.task_id: thing for thing in things}
        with self._server.atomic():
            for task_id in [
                key for key, one in self._shown.items() if not _is_same(one.thing, wanted.get(key))
            ]:
                gone = self._shown.pop(task_id)
                gone.mesh.remove()
                gone.label.remove()
            for task_id in wanted.keys() - self._shown.keys():
                self._shown[task_id] = self._draw(wanted[task_id])

    def _draw(self, thing: SceneInstance) -> _Shown:
        assert thing.known is not None
        model, T = thing.known.model, thing.known.T_world_object
        drawn = self._drawable(model)
        mesh = trimesh.Trimesh(drawn.vertices, drawn.faces)
        handle = self._server.scene.add_mesh_simple(
            f"/neighbours/{thing.task_id}",
            vertices=(mesh.vertices + SHELL * mesh.vertex_normals).astype(np.float32),
            faces=mesh.faces,
            color=_rgb(thing.color),
            opacity=OPACITY,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
            position=T[:3, 3],
            wxyz=Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True),
        )
        label = self._server.scene.add_label(
            f"/neighbour-names/{thing.task_id}",
            thing.name,
            position=pose.apply(T, model.centre),
            font_screen_scale=LABEL_SCALE,
            anchor="center-center",
        )
        return _Shown(thing, handle, label)


def _is_same(drawn: SceneInstance, wanted: SceneInstance | None) -> bool:
    """Whether what is drawn is what is wanted."""
    if wanted is None or drawn.known is None or wanted.known is None:
        return False
    same_place = np.array_equal(drawn.known.T_world_object, wanted.known.T_world_object)
    return same_place and (drawn.name, drawn.color) == (wanted.name, wanted.color)


def _rgb(color: str) -> tuple[int, int, int]:
    red, green, blue = bytes.fromhex(color[1:])
    return red, green, blue
