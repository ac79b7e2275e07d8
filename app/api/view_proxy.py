"""The same-origin door to the views: HTTP and WebSocket, for the session's owner only."""

import asyncio
import contextlib
from collections.abc import Awaitable, Callable
from pathlib import Path
from typing import Annotated
from urllib.parse import quote

import httpx
import websockets
from fastapi import APIRouter, Depends, Request, Response, WebSocket
from starlette.websockets import WebSocketDisconnect

from app.api.dependencies import Id, LiveSessionDep, get_services, identify, is_same_origin
from app.labeling.live.live_session import LiveSession
from app.labeling.live.sessions import NotFoundError
from app.services import Services

router = APIRouter(include_in_schema=False)

SUBPROTOCOL_PREFIX = "viser-v"
REFUSED = 4403
"""Close code of a WebSocket that may not be opened."""
PATIENCE = 60.0
"""Seconds for a file of the view's page, which is a large one: a machine may be busy with others."""
SECONDS_BETWEEN_LOGIN_CHECKS = 2.0
"""A view that is open closes no later than that after its login has ended."""


@router.get("/view/{registration_id}/{path:path}")
async def view_page(
    path: str,
    request: Request,
    live_session: LiveSessionDep,
    services: Annotated[Services, Depends(get_services)],
) -> Response:
    """A file of the view's page."""
    return await fetched(
        request, await asyncio.to_thread(services.live_sessions.view_socket, live_session), path
    )


async def fetched(request: Request, view: Path, path: str) -> Response:
    """A file of the page of the view on a socket file."""
    # verify=False: there is no TLS on a socket file, and reading all certificates takes 26 ms
    transport = httpx.AsyncHTTPTransport(uds=str(view), verify=False)
    async with httpx.AsyncClient(transport=transport, timeout=PATIENCE) as client:
        answer = await client.get(f"http://view/{quote(path)}")
    return Response(
        answer.content,
        answer.status_code,
        media_type=answer.headers.get("content-type"),
        headers={"cache-control": "private, max-age=600"},
    )


@router.websocket("/view/{registration_id}/")
@router.websocket("/view/{registration_id}")
async def view_socket(socket: WebSocket, registration_id: Id) -> None:
    """The view's messages, both ways, unread."""
    services = get_services(socket)
    live_session = await asyncio.to_thread(_allowed_session, socket, registration_id)
    if live_session is None:
        await socket.close(REFUSED)
        return
    view = await asyncio.to_thread(services.live_sessions.view_socket, live_session)
    leave = services.live_sessions.watch(live_session)
    try:
        await join(socket, view, lambda change: _count(live_session, change))
    finally:
        leave()


def _allowed_session(socket: WebSocket, registration_id: int) -> LiveSession | None:
    if not is_same_origin(socket, required=True):
        return None
    identity = identify(socket)
    if identity is None:
        return None
    try:
        return get_services(socket).live_sessions.open(registration_id, identity)
    except NotFoundError:
        return None


async def _nobody_counts(_change: int) -> None:
    pass


async def join(
    socket: WebSocket, path: Path, count: Callable[[int], Awaitable[None]] = _nobody_counts
) -> None:
    """Hand messages to and fro between a page and the view on a socket file.

    That goes on until either leaves, or the login that the page came with ends.

    Args:
        socket: Of the page, not accepted yet.
        path: Of the view's socket file.
        count: Told +1 when the two are joined, -1 when they are not any more.
    """
    protocols = [
        websockets.Subprotocol(name)
        for name in socket.scope["subprotocols"]
        if name.startswith(SUBPROTOCOL_PREFIX)
    ]
    async with websockets.unix_connect(
        str(path), subprotocols=protocols, max_size=None, compression=None
    ) as view:
        await socket.accept(subprotocol=view.subprotocol)
        await count(+1)
        ways = (_to_page(socket, view), _to_view(socket, view), _until_login_ends(socket))
        tasks = {asyncio.create_task(way) for way in ways}
        try:
            _, unfinished = await asyncio.wait(tasks, return_when=asyncio.FIRST_COMPLETED)
        finally:
            await count(-1)
        for task in unfinished:
            task.cancel()
        await asyncio.gather(*tasks, return_exceptions=True)
        with contextlib.suppress(RuntimeError, WebSocketDisconnect):  # the page may have closed first
            await socket.close()


async def _count(live_session: LiveSession, change: int) -> None:
    """The page learns from its stream that its 3-D view came or went: a view cannot tell that itself."""
    live_session.viewers += change
    await asyncio.to_thread(live_session.session.tell)


async def _to_page(socket: WebSocket, view: websockets.ClientConnection) -> None:
    # A message gets no name here: the last one, often a whole scene, would be kept until the next one comes.
    with contextlib.suppress(websockets.ConnectionClosed):
        while True:
            await socket.send_bytes(await view.recv(decode=False))


async def _to_view(socket: WebSocket, view: websockets.ClientConnection) -> None:
    with contextlib.suppress(WebSocketDisconnect):
        while True:
            await view.send(await socket.receive_bytes())


async def _until_login_ends(socket: WebSocket) -> None:
    while await asyncio.to_thread(identify, socket) is not None:
        await asyncio.sleep(SECONDS_BETWEEN_LOGIN_CHECKS)
