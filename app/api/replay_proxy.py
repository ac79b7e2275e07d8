"""The same-origin door to the views of replays: for those who may read the registration."""

import asyncio

from fastapi import APIRouter, Request, Response, WebSocket

from app.api.dependencies import Id, get_services, identify, is_same_origin
from app.api.replay import ReplayDep
from app.api.view_proxy import REFUSED, fetched, join
from app.labeling.live.sessions import NotFoundError
from app.replay.replays import Replay

router = APIRouter(include_in_schema=False)


@router.get("/view/replay/{registration_id}/{path:path}")
async def replay_view_page(path: str, request: Request, replay: ReplayDep) -> Response:
    """A file of the view's page."""
    return await fetched(request, replay.view.socket_path, path)


@router.websocket("/view/replay/{registration_id}/")
@router.websocket("/view/replay/{registration_id}")
async def replay_view_socket(socket: WebSocket, registration_id: Id) -> None:
    """The view's messages, both ways, unread."""
    replay = await asyncio.to_thread(_allowed_replay, socket, registration_id)
    if replay is None:
        await socket.close(REFUSED)
        return
    leave = get_services(socket).replays.watch(replay)
    try:
        await join(socket, replay.view.socket_path)
    finally:
        leave()


def _allowed_replay(socket: WebSocket, registration_id: int) -> Replay | None:
    identity = identify(socket) if is_same_origin(socket, required=True) else None
    if identity is None:
        return None
    services = get_services(socket)
    try:
        services.live_sessions.check_readable(registration_id, identity)
        return services.replays.get(registration_id, identity.user_id)
    except NotFoundError:
        return None
