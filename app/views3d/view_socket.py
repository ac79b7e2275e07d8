"""viser on a socket file: only the app's own account reaches it, and no browser can.

viser answers whoever connects, and a page of any site may connect to a TCP port of the machine that its
browser runs on, past the login. A browser opens no socket files, and other accounts get into no folder of
mode 0700.
"""

import contextlib
import os
import tempfile
import threading
from collections.abc import Iterator
from pathlib import Path
from typing import Any

import viser
import websockets.asyncio.server

LONGEST_PATH = 103
"""Bytes of a socket file's path that every system takes."""

_making = threading.Lock()


class ViewSocket:
    """Where one view is served: a socket file in a private folder of its own."""

    def __init__(self) -> None:
        self._folder = tempfile.TemporaryDirectory(prefix="snap6d-view-", ignore_cleanup_errors=True)
        self.path = Path(self._folder.name) / "socket"
        """What to connect to."""
        if len(os.fsencode(self.path)) > LONGEST_PATH:
            self.close()
            raise OSError(f"the path {self.path} is too long for a socket; set TMPDIR to a shorter folder")

    def server(self) -> viser.ViserServer:
        """A viser server that listens here, and nowhere else."""
        with _making, _listening_on(self.path):
            return viser.ViserServer(host=str(self.path), port=0, verbose=False)

    def close(self) -> None:
        """Remove the file and its folder."""
        self._folder.cleanup()


@contextlib.contextmanager
def _listening_on(path: Path) -> Iterator[None]:
    """Let viser, which knows of hosts and ports only, listen on a socket file.

    It looks `serve` up in a thread of its own, and its constructor returns when that thread listens.
    """
    module = websockets.asyncio.server
    serve = module.serve

    def serve_on_file(handler: Any, _host: str, _port: int, **options: Any) -> Any:
        return serve(handler, unix=True, path=str(path), **options)

    module.serve = serve_on_file  # type: ignore[assignment, misc]
    try:
        yield
    finally:
        module.serve = serve  # type: ignore[misc]
