"""How connections to the one public port are kept: not where nothing is asked, and for whom they speak."""

import asyncio
from typing import Any

import uvicorn
from fastapi import FastAPI
from uvicorn.protocols.http.h11_impl import H11Protocol

from app.config import Settings

SECONDS_FOR_HEADERS = 10.0
"""In which a connection has to ask for something, from its beginning and from each first byte on."""
LARGEST_MESSAGE = 64 * 2**20
"""Bytes of a WebSocket's message."""


def server_config(app: FastAPI, settings: Settings, **options: Any) -> uvicorn.Config:
    """How uvicorn is to serve the application.

    Args:
        app: The application.
        settings: Whose forwarded headers count.
        options: More for uvicorn.
    """
    return uvicorn.Config(
        app,
        http=PatientProtocol,
        ws_max_size=LARGEST_MESSAGE,
        ws_per_message_deflate=False,  # point clouds hardly shrink, and everybody would wait for it
        access_log=False,
        # whoever else says for whom they speak could give each guess of a password another address
        proxy_headers=bool(settings.trusted_proxies),
        forwarded_allow_ips=settings.trusted_proxies,
        **options,
    )


class PatientProtocol(H11Protocol):
    """Closes a connection that does not come to the point: uvicorn itself waits for ever for a request."""

    _deadline: asyncio.TimerHandle | None = None

    def connection_made(self, transport: asyncio.Transport) -> None:  # type: ignore[override]
        """Begin to wait for the first request."""
        super().connection_made(transport)
        self._wait()

    def data_received(self, data: bytes) -> None:
        """Go on waiting where this was no whole request."""
        super().data_received(data)
        is_answering = self.cycle is not None and not self.cycle.response_complete
        is_websocket = self.transport.get_protocol() is not self
        if is_answering or is_websocket or self.transport.is_closing():
            self._stop_waiting()
        else:
            self._wait()

    def connection_lost(self, exc: Exception | None) -> None:
        """Forget it."""
        self._stop_waiting()
        super().connection_lost(exc)

    def _wait(self) -> None:
        if self._deadline is None:
            self._deadline = self.loop.call_later(SECONDS_FOR_HEADERS, self.transport.close)

    def _stop_waiting(self) -> None:
        if self._deadline is not None:
            self._deadline.cancel()
            self._deadline = None
