"""Colour and depth images by OpenGL without a display; the only module that imports pyrender, and lazily."""

import os
import warnings
from collections.abc import Sequence
from dataclasses import dataclass
from types import ModuleType, TracebackType
from typing import Any, Protocol, Self

import numpy as np
import trimesh
from numpy.typing import NDArray

from registration_core.geometry.camera import Intrinsics

Array = NDArray[np.float64]

NEAR, FAR = 0.01, 20.0
"""Clipping planes, metres."""

T_OPENCV_OPENGL = np.diag([1.0, -1.0, -1.0, 1.0])
"""OpenGL's camera looks along -z with y up."""

PIXEL_CENTRE = 0.5
"""OpenGL puts (0, 0) on the image's corner, we put it on the centre of the first pixel."""


class RenderingError(RuntimeError):
    """OpenGL cannot be started; the message says what to install."""


class Mesh(Protocol):
    """What depth is drawn of: an `ObjectModel` or a `trimesh.Trimesh`, in metres."""

    @property
    def vertices(self) -> Any:
        """(V, 3), metres."""

    @property
    def faces(self) -> Any:
        """(F, 3), indices of vertices."""


@dataclass(frozen=True)
class Light:
    """Light from a far lamp, which casts shadows."""

    direction: tuple[float, float, float]
    """Where its rays go, camera axes."""
    intensity: float = 3.0
    color: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Red, green and blue, 0 to 1."""


@dataclass(frozen=True)
class Surroundings:
    """What lights a picture apart from lamps."""

    ambient: tuple[float, float, float] = (0.35, 0.35, 0.35)
    """Light from everywhere, 0 to 1."""
    background: tuple[float, float, float] = (1.0, 1.0, 1.0)
    """Colour where no mesh is, 0 to 1."""


GAMMA = 2.2
"""pyrender takes linear colours and writes them with this gamma."""

HEADLIGHT = (Light((0.3, 0.5, 1.0)),)
"""A lamp above the camera's left shoulder."""


class Renderer:
    """Draws meshes as one camera sees them; close it, or use it in a `with` statement.

    Raises:
        RenderingError: where OpenGL cannot be started.
    """

    def __init__(self, camera: Intrinsics) -> None:
        self.camera = camera
        self._pyrender = load_pyrender()
        try:
            self._offscreen = self._pyrender.OffscreenRenderer(camera.width, camera.height)
        except Exception as error:  # each layer of OpenGL has its own kinds, and pyrender asserts
            raise RenderingError(MISSING_OPENGL) from error

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    def close(self) -> None:
        """Free what the graphics driver holds."""
        self._offscreen.delete()

    def depth(self, placed: Sequence[tuple[Mesh, Array]]) -> NDArray[np.float32]:
        """Depth (H, W) in metres, 0 where nothing is, of meshes and their poses `T_camera_object`.

        Both sides of a triangle are drawn. A pixel holds the depth at its centre.
        """
        scene = self._scene(np.zeros(3), np.ones(3))
        nodes = {}
        for mesh, T_camera_object in placed:
            faces = np.asarray(mesh.faces, dtype=np.uint32)
            shape = self._pyrender.Primitive(
                positions=np.asarray(mesh.vertices, dtype=np.float32),
                indices=np.concatenate([faces, faces[:, ::-1]]),  # pyrender culls the backs in this mode
            )
            nodes[scene.add(self._pyrender.Mesh([shape]), pose=T_camera_object)] = 255
        # Segmentation is the one mode without multisampling, which would sample depth beside the centre.
        flags = self._pyrender.RenderFlags
        _, depth = self._offscreen.render(scene, flags.SEG, seg_node_map=nodes)
        return np.array(depth, dtype=np.float32)

    def color(
        self,
        placed: Sequence[tuple[trimesh.Trimesh, Array]],
        lights: Sequence[Light] = HEADLIGHT,
        surroundings: Surroundings = Surroundings(),
    ) -> NDArray[np.uint8]:
        """Picture (H, W, 3) of meshes with their vertex colours and poses `T_camera_object`.

        Shading is smooth across shared vertices: an edge stays sharp where its vertices are doubled.
        """
        scene = self._scene(np.array(surroundings.ambient), np.array(surroundings.background))
        for mesh, T_camera_object in placed:
            scene.add(self._coloured(mesh), pose=T_camera_object)
        for light in lights if placed else ():  # a lamp without anything to shine on stops pyrender
            lamp = self._pyrender.DirectionalLight(color=light.color, intensity=light.intensity)
            scene.add(lamp, pose=looking_along(np.array(light.direction)))
        flags = self._pyrender.RenderFlags
        color, _ = self._offscreen.render(scene, flags.SHADOWS_DIRECTIONAL | flags.SKIP_CULL_FACES)
        return np.array(color, dtype=np.uint8)

    def _scene(self, ambient: Array, background: Array) -> Any:
        """An empty scene with the camera in it."""
        scene = self._pyrender.Scene(bg_color=[*background, 1.0], ambient_light=ambient)
        lens = self._pyrender.IntrinsicsCamera(
            fx=self.camera.fx,
            fy=self.camera.fy,
            cx=self.camera.cx + PIXEL_CENTRE,
            cy=self.camera.cy + PIXEL_CENTRE,
            znear=NEAR,
            zfar=FAR,
        )
        scene.add(lens, pose=T_OPENCV_OPENGL)
        return scene

    def _coloured(self, mesh: trimesh.Trimesh) -> Any:
        """A matt mesh in its vertex colours."""
        shape = self._pyrender.Primitive(
            positions=np.asarray(mesh.vertices, dtype=np.float32),
            normals=np.asarray(mesh.vertex_normals, dtype=np.float32),
            indices=np.asarray(mesh.faces, dtype=np.uint32),
            color_0=(np.asarray(mesh.visual.vertex_colors, dtype=np.float32) / 255.0) ** GAMMA,
            material=self._pyrender.MetallicRoughnessMaterial(
                baseColorFactor=np.ones(4), metallicFactor=0.0, roughnessFactor=0.6
            ),
        )
        return self._pyrender.Mesh([shape])


MISSING_OPENGL = (
    "OpenGL cannot be started without a display; install the system libraries libegl1 and libgl1"
    " (Debian, Ubuntu: apt-get install libegl1 libgl1)"
)


def load_pyrender() -> ModuleType:
    """pyrender, told to draw through EGL and kept working with numpy 2.

    Raises:
        RenderingError: where the OpenGL libraries are missing.
    """
    os.environ.setdefault("PYOPENGL_PLATFORM", "egl")
    if not hasattr(np, "infty"):
        np.infty = np.inf  # type: ignore[attr-defined]  # gone in numpy 2; pyrender asks for it
    try:
        with warnings.catch_warnings():
            warnings.simplefilter("ignore")  # its dependencies use deprecated names as they load
            import pyrender
    except Exception as error:  # PyOpenGL raises AttributeError where a library is missing
        raise RenderingError(MISSING_OPENGL) from error
    return pyrender


def looking_along(direction: Array) -> Array:
    """A pose (4, 4) whose -z axis is `direction`, as OpenGL's lamps shine."""
    z = -direction / np.linalg.norm(direction)
    helper = np.eye(3)[np.argmin(np.abs(z))]
    x = np.cross(helper, z)
    x /= np.linalg.norm(x)
    pose = np.eye(4)
    pose[:3, :3] = np.stack([x, np.cross(z, x), z], axis=1)
    return pose
