"""A viser client without a browser: it speaks the wire protocol of the pinned viser version.

To the client: 8 bytes size of the msgpack, 8 bytes size of it compressed, the compressed msgpack, then the
arrays that its messages refer to, each aligned to 8 bytes. To the server: one msgpack dictionary a message.
"""

import time
from collections.abc import Callable, Iterable, Mapping
from pathlib import Path
from types import TracebackType
from typing import Any, Self

import msgspec
import numpy as np
import viser
import zstandard
from numpy.typing import NDArray
from scipy.spatial.transform import Rotation
from websockets.sync.client import connect, unix_connect
from websockets.typing import Origin, Subprotocol

from tests.app.waiting import LONGEST

Message = dict[str, Any]

GIZMO = "/object"
CAMERA: Message = {
    "wxyz": [1.0, 0.0, 0.0, 0.0],
    "position": [1.0, 1.0, 1.0],
    "image_height": 600,
    "image_width": 800,
    "fov": 1.3,
    "near": 0.01,
    "far": 1000.0,
    "look_at": [0.0, 0.0, 0.0],
    "up_direction": [0.0, 0.0, 1.0],
}


class ViserClient:
    """One connection to a view, by its address or its socket file; what arrives is kept in `messages`."""

    def __init__(
        self, view: str | Path, headers: Mapping[str, str] | None = None, origin: str | None = None
    ) -> None:
        open_socket = connect if isinstance(view, str) else unix_connect
        self._socket = open_socket(
            str(view),
            origin=None if origin is None else Origin(origin),
            subprotocols=[Subprotocol(f"viser-v{viser.__version__}")],
            additional_headers=dict(headers or {}),
            max_size=None,
            compression=None,
        )
        self.messages: list[Message] = []
        self.send("ViewerCameraMessage", **CAMERA)  # without it a client does not count as connected

    def __enter__(self) -> Self:
        return self

    def __exit__(
        self, kind: type[BaseException] | None, error: BaseException | None, trace: TracebackType | None
    ) -> None:
        self.close()

    @property
    def subprotocol(self) -> str | None:
        """What was agreed on."""
        return self._socket.subprotocol

    def close(self) -> None:
        """End the connection."""
        self._socket.close()

    def send(self, kind: str, **fields: Any) -> None:
        """Send one message."""
        self._socket.send(msgspec.msgpack.encode({"type": kind, **fields}))

    def send_text(self, text: str) -> None:
        """Send what viser never sends."""
        self._socket.send(text)

    def wait_for(self, kind: str, matches: Callable[[Message], bool] = lambda _: True) -> Message:
        """The first message of a kind that matches, received already or to come."""
        deadline = time.monotonic() + LONGEST
        seen = 0
        while True:
            for message in self.messages[seen:]:
                if message["type"] == kind and matches(message):
                    return message
            seen = len(self.messages)
            self.messages += decoded(self._socket.recv(timeout=max(0.0, deadline - time.monotonic())))

    def node(self, kind: str, name: str) -> Message:
        """The message that makes a node of the scene."""
        return self.wait_for(kind, lambda message: message["name"] == name)

    def take(self) -> None:
        """Take hold of the gizmo."""
        self.send("TransformControlsDragStartMessage", name=GIZMO, owner=self._owner())

    def move(self, T_world_gizmo: NDArray[np.float64]) -> None:
        """Move the gizmo."""
        self.send(
            "TransformControlsUpdateMessage",
            name=GIZMO,
            owner=self._owner(),
            wxyz=Rotation.from_matrix(T_world_gizmo[:3, :3]).as_quat(scalar_first=True).tolist(),
            position=T_world_gizmo[:3, 3].tolist(),
        )

    def let_go(self) -> None:
        """Let go of the gizmo."""
        self.send("TransformControlsDragEndMessage", name=GIZMO, owner=self._owner())

    def drag(self, way: Iterable[NDArray[np.float64]]) -> None:
        """Take the gizmo, move it along poses, and let go."""
        self.take()
        for T_world_gizmo in way:
            self.move(T_world_gizmo)
        self.let_go()

    def _owner(self) -> str:
        return self.node("TransformControlsMessage", GIZMO).get("owner", "")


def decoded(packet: str | bytes) -> list[Message]:
    assert isinstance(packet, bytes)
    size, packed = (int.from_bytes(packet[at : at + 8], "little") for at in (0, 8))
    end = 16 + packed
    text = zstandard.ZstdDecompressor().decompress(packet[16:end], max_output_size=size)
    content = msgspec.msgpack.decode(text)
    arrays = []
    for length in content["binaryBufferLengths"]:
        end += -end % 8
        arrays.append(packet[end : end + length])
        end += length
    return [_with_arrays(message, arrays) for message in content["messages"]]


def _with_arrays(value: Any, arrays: list[bytes]) -> Any:
    if isinstance(value, dict):
        if "__binary_index" in value:
            return np.frombuffer(arrays[value["__binary_index"]], dtype=value["dtype"])
        return {key: _with_arrays(item, arrays) for key, item in value.items()}
    return [_with_arrays(item, arrays) for item in value] if isinstance(value, list) else value
