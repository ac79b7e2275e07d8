"""The 3-D view of a labelling page without a browser, for many at once in one thread."""

import asyncio
import time
from collections.abc import Iterable, Mapping
from importlib.metadata import version
from typing import Any

import msgspec
import numpy as np
import websockets
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry import pose
from tests.app.labeling.viser_client import CAMERA, GIZMO, decoded

Array = NDArray[np.float64]

SECONDS_BETWEEN_UPDATES = 0.05
"""A page tells the gizmo's pose no more often than that."""


class ViewClient:
    """One connection to a view; use it as `async with`.

    Compression is offered as browsers offer it, so that what it costs is measured.

    Args:
        url: The view's address, http or ws.
        headers: Of the handshake: cookie and origin.
    """

    def __init__(self, url: str, headers: Mapping[str, str] | None = None) -> None:
        self._url = url.replace("http", "ws", 1)
        self._headers = dict(headers or {})
        self._nodes: dict[str, dict[str, Any]] = {}
        self._loaded = asyncio.Event()
        self.points = 0
        """Of the point cloud that came last."""

    async def __aenter__(self) -> "ViewClient":
        self._socket = await websockets.connect(
            self._url,
            subprotocols=[websockets.Subprotocol(f"viser-v{version('viser')}")],
            additional_headers=self._headers,
            max_size=None,
        )
        self._reading = asyncio.create_task(self._read())
        await self.send(type="ViewerCameraMessage", **CAMERA)  # viser makes the client known when this comes
        return self

    async def __aexit__(self, *_error: object) -> None:
        await self._socket.close()
        await self._reading

    @property
    def nodes(self) -> frozenset[str]:
        """Names of what is in the scene."""
        return frozenset(self._nodes)

    @property
    def T_world_gizmo(self) -> Array:
        """The gizmo's pose (4, 4) as the server told it last."""
        gizmo = self._nodes[GIZMO]
        rotation = Rotation.from_quat(gizmo["wxyz"], scalar_first=True).as_matrix()
        return pose.from_rotation_translation(rotation, gizmo["position"])

    async def wait_until_loaded(self, seconds: float = 30.0) -> None:
        """Return when everything that the scene held at the connection has come."""
        async with asyncio.timeout(seconds):
            await self._loaded.wait()

    async def drag(self, T_world_gizmo: Iterable[Array]) -> list[float]:
        """Take the gizmo, move it through these poses (4, 4) as quickly as a page does, and let go.

        Returns:
            When each pose was sent, by `time.perf_counter()`.
        """
        sent = []
        owner = self._nodes[GIZMO].get("owner", "")
        await self.send(type="TransformControlsDragStartMessage", name=GIZMO, owner=owner)
        for T in T_world_gizmo:
            await asyncio.sleep(SECONDS_BETWEEN_UPDATES)
            sent.append(time.perf_counter())
            await self.send(
                type="TransformControlsUpdateMessage",
                name=GIZMO,
                owner=owner,
                wxyz=Rotation.from_matrix(T[:3, :3]).as_quat(scalar_first=True).tolist(),
                position=T[:3, 3].tolist(),
            )
        await self.send(type="TransformControlsDragEndMessage", name=GIZMO, owner=owner)
        return sent

    async def send(self, **message: object) -> None:
        """Send one message as a page does."""
        await self._socket.send(msgspec.msgpack.encode(message))

    async def _read(self) -> None:
        async for data in self._socket:
            assert isinstance(data, bytes)
            for message in decoded(data):
                self._take(message)

    def _take(self, message: dict[str, Any]) -> None:
        match message["type"]:
            case "ReplayDoneMessage":
                self._loaded.set()
            case "SetPositionMessage":
                self._nodes.setdefault(message["name"], {})["position"] = message["position"]
            case "SetOrientationMessage":
                self._nodes.setdefault(message["name"], {})["wxyz"] = message["wxyz"]
            case "PointCloudMessage":
                self.points = message["props"]["points"].size // 3
                self._nodes.setdefault(message["name"], {})
            case _ if "name" in message and "props" in message:
                self._nodes.setdefault(message["name"], {}).update(message)
