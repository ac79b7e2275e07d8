"""The stream of a registration's changes, as server-sent events."""

import asyncio
import threading
from collections.abc import AsyncIterator
from typing import Annotated

from fastapi import APIRouter, Query, Request
from fastapi.sse import EventSourceResponse, ServerSentEvent

from app.api.dependencies import LiveSessionDep, ServicesDep, identify
from app.api.registration_state import registration_out
from app.labeling.session_state import SessionState

router = APIRouter(prefix="/api/registrations", tags=["registrations"])

SECONDS_BETWEEN_UPDATES = 0.05
"""A stream tells no more often than that, and always tells the last state."""

SECONDS_BETWEEN_SIGNS_OF_LIFE = 10.0
"""A stream tells no less often than that."""

PageName = Annotated[
    str | None, Query(max_length=40, description="Of an open page, made up by itself; scripts leave it out.")
]


@router.get("/{registration_id}/stream", response_class=EventSourceResponse)
async def stream(
    request: Request, live_session: LiveSessionDep, services: ServicesDep, page: PageName = None
) -> AsyncIterator[ServerSentEvent]:
    """Server-sent events: the registration at once, again whenever it changes, and every ten seconds.

    So a page that hears nothing for longer knows that it has lost the connection. When the login ends, so
    does the stream.

    With the name of a page, another page's stream of this registration ends with the event `taken_over`.
    """
    loop = asyncio.get_running_loop()
    changed = asyncio.Event()
    leave = services.live_sessions.watch(live_session)

    given_way = threading.Event()

    def tell(_state: SessionState) -> None:
        loop.call_soon_threadsafe(changed.set)

    def on_taken_over() -> None:
        given_way.set()
        loop.call_soon_threadsafe(changed.set)

    def tell_others() -> None:
        loop.run_in_executor(None, services.live_sessions.tell_others, live_session)

    unsubscribe = live_session.session.subscribe(tell)
    release = None
    if page:
        release = live_session.page_lease.take(page, on_taken_over)
        tell_others()
    try:
        while True:
            changed.clear()
            if given_way.is_set():
                yield ServerSentEvent(event="taken_over", data={"id": live_session.registration.id})
                return
            out = await asyncio.to_thread(registration_out, live_session)
            yield ServerSentEvent(event="registration", data=out)
            await asyncio.sleep(SECONDS_BETWEEN_UPDATES)
            if not await _in_time(changed) and await asyncio.to_thread(identify, request) is None:
                return
    finally:
        unsubscribe()
        leave()
        if release:
            release()
            tell_others()


async def _in_time(changed: asyncio.Event) -> bool:
    try:
        await asyncio.wait_for(changed.wait(), SECONDS_BETWEEN_SIGNS_OF_LIFE)
    except TimeoutError:
        return False
    return True
