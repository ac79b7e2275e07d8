"""People at work, without a browser: REST, the stream of changes and the 3-D view, through the one port."""

import asyncio
import json
from collections.abc import AsyncIterator, Callable, Sequence
from contextlib import AsyncExitStack, asynccontextmanager
from typing import Any

import httpx
import numpy as np

from benchmarks.server import RunningServer, sign_in_secrets
from benchmarks.viser_client import Array, ViewClient

ENDED = frozenset({"done", "cancelled", "failed"})
"""States in which a snap stays."""
SECONDS_TO_ANSWER = 60.0


class Operator:
    """One signed-in person."""

    def __init__(self, http: httpx.AsyncClient) -> None:
        self._http = http

    @property
    def cookies(self) -> list[tuple[str, str]]:
        """Names and values, the login's among them."""
        return list(self._http.cookies.items())

    async def call(self, method: str, path: str, body: object = None) -> Any:
        """What a REST call answers.

        Raises:
            httpx.HTTPStatusError: where it refuses.
        """
        answer = await self._http.request(method, path, json=body)
        answer.raise_for_status()
        return answer.json() if answer.content else None

    async def sign_in(self, secret: str) -> None:
        """Use a one-time link."""
        await self.call("POST", "/api/sign-in/link", {"token": secret})

    async def start(self, task_id: int) -> int:
        """Take up a task; returns the registration's id."""
        registration = await self.call("POST", f"/api/tasks/{task_id}/registration")
        return int(registration["id"])

    async def set_pose(self, registration_id: int, T_world_object: Array) -> None:
        """Put the object at a pose (4, 4)."""
        body = {"T_world_object": T_world_object.tolist()}
        await self.call("PUT", f"/api/registrations/{registration_id}/pose", body)

    async def request_snap(
        self, registration_id: int, config: dict[str, Any] | None = None, seed: int | None = None
    ) -> str:
        """Press Snap; returns the snap's id."""
        body = {"config": config or {}, "seed": seed}
        snap = await self.call("POST", f"/api/registrations/{registration_id}/snaps", body)
        return str(snap["id"])

    def stream(self, registration_id: int) -> "Stream":
        """The registration's changes."""
        return Stream(self._http, f"/api/registrations/{registration_id}/stream")

    @asynccontextmanager
    async def view(self, registration_id: int) -> AsyncIterator[ViewClient]:
        """The registration's view as a page opens it: its files, a connection, and the whole scene."""
        path = f"/view/{registration_id}/"
        page = await self._http.get(path)
        page.raise_for_status()
        cookies = "; ".join(f"{name}={value}" for name, value in self.cookies)
        origin = str(self._http.base_url).rstrip("/")
        async with ViewClient(origin + path, {"cookie": cookies, "origin": origin}) as view:
            await view.wait_until_loaded()
            yield view


class Stream:
    """A registration as its server-sent events tell it; use it as `async with`."""

    def __init__(self, http: httpx.AsyncClient, path: str) -> None:
        self._http = http
        self._path = path
        self._changed = asyncio.Condition()
        self._latest: dict[str, Any] | None = None
        self._ended = False

    async def __aenter__(self) -> "Stream":
        self._reading = asyncio.create_task(self._read())
        await self.until(lambda _registration: True)
        return self

    async def __aexit__(self, *_error: object) -> None:
        self._reading.cancel()
        await asyncio.gather(self._reading, return_exceptions=True)

    async def until(
        self, is_wanted: Callable[[dict[str, Any]], bool], seconds: float = SECONDS_TO_ANSWER
    ) -> dict[str, Any]:
        """The registration, as soon as it is as wanted.

        Raises:
            ConnectionError: where the stream has ended.
            TimeoutError: where it does not become so in time.
        """
        async with asyncio.timeout(seconds), self._changed:
            while self._latest is None or not is_wanted(self._latest):
                if self._ended:
                    raise ConnectionError(f"the stream {self._path} has ended")
                await self._changed.wait()
            return self._latest

    async def until_snap_ended(self, snap_id: str) -> dict[str, Any]:
        """The registration, as soon as this snap has brought a result or came to nothing."""

        def is_wanted(registration: dict[str, Any]) -> bool:
            snap = registration["snap"]
            return snap is not None and snap["id"] == snap_id and snap["state"] in ENDED

        return await self.until(is_wanted)

    async def until_snap_runs(self, snap_id: str) -> dict[str, Any]:
        """The registration, as soon as a worker is at this snap."""

        def is_wanted(registration: dict[str, Any]) -> bool:
            snap = registration["snap"]
            return snap is not None and snap["id"] == snap_id and snap["progress"] > 0

        return await self.until(is_wanted)

    async def until_at(self, T_world_object: Array) -> dict[str, Any]:
        """The registration, as soon as nobody drags the object and it is saved at this pose (4, 4)."""

        def is_wanted(registration: dict[str, Any]) -> bool:
            return registration["saved"] and np.allclose(
                registration["T_world_object"], T_world_object, rtol=0.0, atol=1e-9
            )

        return await self.until(is_wanted)

    async def _read(self) -> None:
        try:
            async with self._http.stream("GET", self._path, timeout=None) as answer:
                answer.raise_for_status()
                async for line in answer.aiter_lines():
                    if line.startswith("data:"):
                        await self._tell(json.loads(line.removeprefix("data:")))
        finally:
            self._ended = True
            await self._tell(self._latest)

    async def _tell(self, registration: dict[str, Any] | None) -> None:
        async with self._changed:
            self._latest = registration
            self._changed.notify_all()


@asynccontextmanager
async def signed_in_operators(server: RunningServer, count: int) -> AsyncIterator[Sequence[Operator]]:
    """As many new people, each with a login of their own."""
    async with AsyncExitStack() as stack:
        operators = []
        for secret in sign_in_secrets(server.state_dir, count):
            http = httpx.AsyncClient(
                base_url=server.url, headers={"origin": server.url}, timeout=SECONDS_TO_ANSWER
            )
            operators.append(Operator(await stack.enter_async_context(http)))
            await operators[-1].sign_in(secret)
        yield operators
