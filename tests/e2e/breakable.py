"""A way to the server that can be cut, as networks and proxies do."""

import contextlib
import socket
import threading
from collections.abc import Iterator
from dataclasses import dataclass, field


@dataclass
class BreakableWay:
    """Passes bytes on; what it carries can be cut, and refused, by the head of its first request."""

    port: int
    """Of the server."""
    listener: socket.socket = field(default_factory=lambda: socket.create_server(("127.0.0.1", 0)))
    open: list[tuple[bytes, socket.socket, socket.socket]] = field(default_factory=list)
    refused: bytes | None = None
    """Part of the heads of requests that find no way."""

    @property
    def url(self) -> str:
        """Where it listens."""
        return f"http://127.0.0.1:{self.listener.getsockname()[1]}"

    def cut(self, part: bytes) -> int:
        """Close what carries a request with this in its head; returns how many."""
        hit = [way for way in self.open if part in way[0]]
        for _, one, other in hit:
            _shut(one)
            _shut(other)
        return len(hit)

    def serve(self) -> None:
        """Carry connections until the listener is closed."""
        with contextlib.suppress(OSError):
            while True:
                page, _ = self.listener.accept()
                threading.Thread(target=self._carry, args=(page,), daemon=True).start()

    def _carry(self, page: socket.socket) -> None:
        with contextlib.suppress(OSError):
            first = page.recv(65536)
            head = first.split(b"\r\n\r\n", 1)[0].lower()
            if not first or (self.refused is not None and self.refused in head):
                page.close()
                return
            server = socket.create_connection(("127.0.0.1", self.port))
            self.open.append((head, page, server))
            server.sendall(first)
            threading.Thread(target=_pass_on, args=(server, page), daemon=True).start()
            _pass_on(page, server)


@contextlib.contextmanager
def breakable_way(port: int) -> Iterator[BreakableWay]:
    """A way to this port of the machine, until the block ends."""
    way = BreakableWay(port)
    threading.Thread(target=way.serve, daemon=True).start()
    try:
        yield way
    finally:
        _shut(way.listener)
        way.cut(b"")


def _pass_on(source: socket.socket, sink: socket.socket) -> None:
    with contextlib.suppress(OSError):
        while data := source.recv(65536):
            sink.sendall(data)
    _shut(sink)


def _shut(one: socket.socket) -> None:
    with contextlib.suppress(OSError):
        one.shutdown(socket.SHUT_RDWR)
    one.close()
