"""The 3-D view of one labelling session: point cloud, mesh and gizmo in viser."""

import asyncio
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from pathlib import Path

import numpy as np
import trimesh
import viser
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from viser import _messages

from app.datasets.textured_mesh import as_glb
from app.labeling.layers import Layers
from app.labeling.moves.camera_watch import Camera, CameraWatch
from app.labeling.moves.degrees_of_freedom import GizmoAxes
from app.labeling.moves.viewpoint import Viewpoint
from app.views3d.cloud_view import CloudView
from app.views3d.marks import draw_marks
from app.views3d.neighbour_view import NeighbourView
from app.views3d.uncertainty_view import UncertaintyView
from app.views3d.view_socket import ViewSocket
from registration_core import ObjectModel
from registration_core.geometry import pose

Array = NDArray[np.float64]

HUMAN_COLOR = (255, 149, 64)
"""Of what the operator holds; the same in the pages' style sheet."""
MACHINE_COLOR = (108, 192, 255)
"""Of what the machine shows; the same in the pages' style sheet."""
MESH_OPACITY = 0.55
GHOST_OPACITY = 0.6
GHOST_SIZE = 1.03
"""Times the object's own, since measured points would hide what lies where it should."""
SURFACE_POINT = 0.008
"""Size of such a point as a share of the object's diameter."""
GIZMO_SIZE = 0.75
"""Length of the gizmo's arms as a share of the object's diameter."""
MARK_SIZE = 0.02
"""Radius of a mark as a share of the object's diameter."""
STEP_BACK = 1.15
"""How much further from the object than the sensor the first view is."""
FIELD_OF_VIEW_LIMITS = (0.5, 1.3)
"""Radians, vertical."""
BACKGROUND = (24, 27, 33)


@dataclass(frozen=True)
class DragHandlers:
    """What happens when the operator takes, moves and lets go of the gizmo; poses are T_world_object."""

    on_start: Callable[[], None]
    on_move: Callable[[Array], None]
    on_end: Callable[[bool], None]
    """Handed whether the connection broke while the gizmo was held."""


@dataclass(frozen=True)
class FirstView:
    """Where the camera stands when a page opens."""

    T_world_camera: Array
    """The sensor's pose (4, 4)."""
    field_of_view: float
    """The sensor's, vertical, radians."""
    distance: float
    """From the sensor to what there is to see, metres."""


class SceneView:
    """One viser server of its own, for one session; what it shows survives a reload of the page.

    Args:
        model: The object.
        T_world_object: Where it is at first, (4, 4), metres.
        first_view: Where the camera stands at first.
        drag: Told of drags.
        drawable: Gives an object's mesh as it is to be drawn, in few enough faces.
        textured: The object's mesh in its own colours, metres, where it has any.
    """

    def __init__(
        self,
        model: ObjectModel,
        T_world_object: Array,
        first_view: FirstView,
        drag: DragHandlers,
        drawable: Callable[[ObjectModel], ObjectModel],
        textured: trimesh.Trimesh | None = None,
    ) -> None:
        self._T_gizmo_object = pose.from_rotation_translation(np.eye(3), -model.centre)
        self._socket = ViewSocket()
        self._server = self._socket.server()
        _refuse_sharing(self._server)
        self._server.gui.configure_theme(
            show_logo=False, show_share_button=False, dark_mode=True, control_layout="floating"
        )
        self._server.scene.set_background_image(np.full((1, 1, 3), BACKGROUND, dtype=np.uint8))
        self._place_camera(first_view)
        self._model = model
        self._drawn = drawable(model)
        self._ghost: viser.MeshHandle | None = None
        self.uncertainty = UncertaintyView(self._server, MACHINE_COLOR, model.diameter)
        self._cloud = CloudView(self._server, model.diameter)
        self._cloud.follow(pose.apply(T_world_object, model.centre))
        self._on_object: viser.PointCloudHandle | None = None
        self._watch: CameraWatch | None = None
        self._gizmo, self._mesh = self._add_object(T_world_object)
        self._textured = None if textured is None else self._add_textured(textured)
        self.show_layers(Layers())
        self.neighbours = NeighbourView(self._server, drawable)
        self._follow_drags(drag)

    @property
    def socket_path(self) -> Path:
        """The socket file that the view is served on."""
        return self._socket.path

    def show_cloud(self, points: NDArray[np.float32], colors: NDArray[np.uint8], point_size: float) -> None:
        """Show a point cloud (N, 3) in the world, metres, in place of the one before."""
        self._cloud.show(points, colors, point_size)

    def show_layers(self, layers: Layers) -> None:
        """Show or hide cloud and mesh, and what lies on the mesh with it; the gizmo stays.

        Where the object's own colours are shown, how depth agrees is not: two looks would hide each other.
        """
        is_textured = self._textured is not None and layers.texture and not layers.agreement
        with self._server.atomic():
            self._mesh.visible = layers.mesh and not is_textured
            if self._textured is not None:
                self._textured.visible = layers.mesh and is_textured
        self._cloud.show_as(layers.cloud, layers.fine)

    def show_on_object(self, points: Array, colors: NDArray[np.uint8]) -> None:
        """Show points (N, 3) in the object's frame, metres, in place of those before; the mesh has them."""
        on_mesh = (GHOST_SIZE * (points - self._model.centre)).astype(np.float16)
        if self._on_object is None:
            self._on_object = self._server.scene.add_point_cloud(
                "/object/mesh/surface",
                on_mesh,
                colors,
                point_size=SURFACE_POINT * self._model.diameter,
                point_shape="circle",
                point_shading="flat",
            )
        with self._server.atomic():
            self._on_object.points, self._on_object.colors = on_mesh, colors

    def move_object(self, T_world_object: Array, gizmo_axes: GizmoAxes = "object") -> None:
        """Put object and gizmo at a pose. Not while a drag goes on: the page would overwrite it.

        The page turns the gizmo with what it drags; a gizmo in the world's axes gets its rotation back here,
        and the mesh, which hangs on it, the rotation that the gizmo had gathered.
        """
        rotation = T_world_object[:3, :3]
        of_gizmo, of_mesh = (rotation, np.eye(3)) if gizmo_axes == "object" else (np.eye(3), rotation)
        centre = self._model.centre
        self._cloud.follow(pose.apply(T_world_object, centre))
        T_world_gizmo = pose.from_rotation_translation(of_gizmo, pose.apply(T_world_object, centre))
        # Not by the inverse of the one times the other: what rounding leaves would double with every drag.
        self._T_gizmo_object = pose.from_rotation_translation(of_mesh, -of_mesh @ centre)
        with self._server.atomic():
            self._gizmo.position, self._gizmo.wxyz = _to_viser(T_world_gizmo)
            _, self._mesh.wxyz = _to_viser(self._T_gizmo_object)
            if self._textured is not None:
                self._textured.wxyz = self._mesh.wxyz

    @property
    def viewpoint(self) -> Viewpoint | None:
        """From where the operator looks; None while no page shows the view."""
        clients = self._server.get_clients()
        if not clients:
            return None
        camera = clients[max(clients)].camera
        return Viewpoint(
            T_world_camera=_from_viser(camera.position, camera.wxyz),
            distance=float(np.linalg.norm(camera.look_at - camera.position)),
            up=camera.up_direction / np.linalg.norm(camera.up_direction),
            field_of_view=camera.fov,
            aspect=camera.aspect,
        )

    def look(self, viewpoint: Viewpoint) -> None:
        """Let every page that shows the view look from there."""
        for client in self._server.get_clients().values():
            with client.atomic():
                client.camera.up_direction = viewpoint.up
                client.camera.position = viewpoint.position
                client.camera.look_at = viewpoint.target
            self._note_camera(client.camera)  # the page tells only of what its user moves

    def watch_camera(self, watch: CameraWatch) -> None:
        """Let `watch` follow from where the operator looks, from the moment that a page shows the view."""
        self._watch = watch

        @self._server.on_client_connect
        async def _(client: viser.ClientHandle) -> None:
            @client.camera.on_update
            async def _(camera: viser.CameraHandle) -> None:
                self._note_camera(camera)

    def show_ghost(self, T_world_object: Array | None) -> None:
        """Show where the machine would put the object; None shows nothing."""
        if T_world_object is None:
            if self._ghost is not None:
                self._ghost.visible = False
            return
        if self._ghost is None:
            self._ghost = self._add_mesh("/ghost", MACHINE_COLOR, GHOST_OPACITY, GHOST_SIZE)
        centre = pose.apply(T_world_object, self._model.centre)
        position, wxyz = _to_viser(pose.from_rotation_translation(T_world_object[:3, :3], centre))
        with self._server.atomic():
            self._ghost.position = position
            self._ghost.wxyz = wxyz
            self._ghost.visible = True

    def mark(self, points: Sequence[Array]) -> None:
        """Number points (3,) of the world, metres, in every page that shows the view now, and no others."""
        for client in self._server.get_clients().values():
            draw_marks(client.scene, points, MARK_SIZE * self._model.diameter)

    def lock_object(self, locked: bool) -> None:
        """Take the gizmo's handles away, or give them back; the object stays in view."""
        with self._server.atomic():
            self._gizmo.disable_axes = locked
            self._gizmo.disable_sliders = locked
            self._gizmo.disable_rotations = locked

    def close(self) -> None:
        """Stop serving."""
        if self._watch is not None:
            self._watch.close()
        self._server.stop()
        self._socket.close()

    def _note_camera(self, camera: viser.CameraHandle) -> None:
        now = _logged(camera)
        if now is not None and self._watch is not None:
            self._watch.moved(now)

    def _place_camera(self, view: FirstView) -> None:
        look_at = pose.apply(view.T_world_camera, [0.0, 0.0, view.distance])
        position = pose.apply(view.T_world_camera, [0.0, 0.0, view.distance * (1.0 - STEP_BACK)])
        up = -view.T_world_camera[:3, 1]
        self._server.scene.set_up_direction(up)
        camera = self._server.initial_camera
        camera.position = position
        camera.look_at = look_at
        camera.up = up
        camera.fov = float(np.clip(view.field_of_view, *FIELD_OF_VIEW_LIMITS))

    def _add_object(self, T_world_object: Array) -> tuple[viser.TransformControlsHandle, viser.MeshHandle]:
        position, wxyz = _to_viser(T_world_object @ pose.inverse(self._T_gizmo_object))
        gizmo = self._server.scene.add_transform_controls(
            "/object",
            scale=GIZMO_SIZE * self._model.diameter,
            line_width=3.0,
            depth_test=False,
            position=position,
            wxyz=wxyz,
        )
        return gizmo, self._add_mesh("/object/mesh", HUMAN_COLOR, MESH_OPACITY)

    def _add_textured(self, mesh: trimesh.Trimesh) -> viser.GlbHandle:
        return self._server.scene.add_glb(
            "/object/textured",
            as_glb(mesh, self._model.centre),
            cast_shadow=False,
            receive_shadow=False,
        )

    def _add_mesh(
        self, name: str, color: tuple[int, int, int], opacity: float, size: float = 1.0
    ) -> viser.MeshHandle:
        return self._server.scene.add_mesh_simple(
            name,
            vertices=(size * (self._drawn.vertices - self._model.centre)).astype(np.float32),
            faces=self._drawn.faces,
            color=color,
            opacity=opacity,
            side="double",
            cast_shadow=False,
            receive_shadow=False,
        )

    def _follow_drags(self, drag: DragHandlers) -> None:
        @self._gizmo.on_update
        async def _(event: viser.TransformControlsEvent) -> None:
            # Called in order on the view's own event loop. A drag's end blocks it until the drag is on the
            # disk, so that the next drag cannot begin before.
            if event.phase == "start":
                drag.on_start()
                return
            gizmo = event.target
            if np.isfinite([*gizmo.position, *gizmo.wxyz]).all() and gizmo.wxyz.any():
                T_world_gizmo = _from_viser(gizmo.position, gizmo.wxyz)
                drag.on_move(T_world_gizmo @ self._T_gizmo_object)
            if event.phase == "end":
                drag.on_end(event.client_id not in self._server.get_clients())
                await asyncio.sleep(0)


def _refuse_sharing(server: viser.ViserServer) -> None:
    # Any client may ask viser for a public tunnel to this server; hiding the button would not stop that.
    websocket = server._websock_server  # noqa: SLF001 - viser has no public way
    websocket.unregister_handler(_messages.ShareUrlRequest)
    websocket.unregister_handler(_messages.ShareUrlDisconnect)


def _logged(camera: viser.CameraHandle) -> Camera | None:
    """Where viser's camera is, to a tenth of a millimetre; None where a page sent nonsense."""
    numbers = np.concatenate([camera.position, camera.look_at, camera.up_direction, [camera.fov]]).round(4)
    across = np.cross(numbers[3:6] - numbers[:3], numbers[6:9])
    if not np.isfinite(numbers).all() or not across.any():
        return None
    rounded = numbers.tolist()
    return {"position": rounded[:3], "look_at": rounded[3:6], "up": rounded[6:9], "fov": rounded[9]}


def _to_viser(T: Array) -> tuple[Array, Array]:
    return T[:3, 3], Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True)


def _from_viser(position: Array, wxyz: Array) -> Array:
    rotation = Rotation.from_quat(wxyz, scalar_first=True)
    return pose.from_rotation_translation(rotation.as_matrix(), position)
