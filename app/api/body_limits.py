"""What a request may send before anybody reads it: how much, how deeply nested, how slowly, and no NUL."""

import asyncio
import re
from collections.abc import Container

import numpy as np
from starlette.datastructures import Headers
from starlette.exceptions import HTTPException
from starlette.types import ASGIApp, Message, Receive, Scope, Send

from app.api.problems import problem

LARGEST_BODY = 2**20
"""Bytes; uploads have a limit of their own."""
DEEPEST = 32
"""Lists and objects within each other; what reads or writes JSON runs out of stack somewhere further down."""
SECONDS_FOR_A_BODY = 20.0
"""In which a body comes, or the next piece of an upload."""

TOO_LARGE = f"A request may send at most {LARGEST_BODY // 2**20} MB; only uploads of datasets may be larger."
TOO_DEEP = f"The body nests deeper than {DEEPEST} levels; nothing here does."
NO_TEXT = "The request holds the character U+0000, which belongs to no text; leave it out."
TOO_SLOW = "The body of the request did not come in time; send it again."

_STRINGS = re.compile(rb'"(?:[^"\\]|\\.)*+"?', re.DOTALL)
_NUL = re.compile(rb"(?<!\\)(?:\\\\)*\\u0000")
"""As JSON writes it. Databases differ in whether they take it."""
_NOT_BRACKETS = bytes(set(range(256)) - set(b"[]{}"))


class BodyLimits:
    """Refuses bodies that are too large, too deep, too slow or hold a NUL, whoever sends them; a middleware.

    Args:
        app: The application.
        uploads: Paths that take uploads: these limit, and read, what comes by themselves.
    """

    def __init__(self, app: ASGIApp, uploads: Container[str]) -> None:
        self._app = app
        self._uploads = uploads

    async def __call__(self, scope: Scope, receive: Receive, send: Send) -> None:
        """Answer one request."""
        if scope["type"] != "http":
            await self._app(scope, receive, send)
        elif scope["path"] in self._uploads:
            await self._app(scope, _in_time(receive), send)
        else:
            await self._answer_small(scope, receive, send)

    async def _answer_small(self, scope: Scope, receive: Receive, send: Send) -> None:
        try:
            if b"%00" in scope["query_string"]:
                raise HTTPException(422, NO_TEXT)
            body = await _whole_body(Headers(scope=scope), receive)
        except HTTPException as error:
            # whatever else the connection holds belongs to this body
            answer = problem(error.status_code, error.detail, {"connection": "close"})
            await answer(scope, receive, send)
            return
        await self._app(scope, _once_more(body, receive), send)


async def _whole_body(headers: Headers, receive: Receive) -> bytes | None:
    """The body, where the request has one.

    Raises:
        HTTPException: where it is not to be read.
    """
    length = headers.get("content-length")
    if length is None and "transfer-encoding" not in headers:
        return None
    if int(length or 0) > LARGEST_BODY:
        raise HTTPException(413, TOO_LARGE)
    body = bytearray()
    try:
        async with asyncio.timeout(SECONDS_FOR_A_BODY):
            while (message := await receive())["type"] == "http.request":
                body += message.get("body", b"")
                if len(body) > LARGEST_BODY:
                    raise HTTPException(413, TOO_LARGE)
                if not message.get("more_body", False):
                    break
    except TimeoutError:
        raise HTTPException(408, TOO_SLOW) from None
    if depth(body) > DEEPEST:
        raise HTTPException(422, TOO_DEEP)
    if _NUL.search(body):
        raise HTTPException(422, NO_TEXT)
    return bytes(body)


def depth(text: bytes | bytearray) -> int:
    """How deeply lists and objects of a JSON text lie within each other."""
    brackets = _STRINGS.sub(b"", text).translate(None, _NOT_BRACKETS)
    codes = np.frombuffer(brackets, dtype=np.uint8)
    steps = np.where((codes == ord("[")) | (codes == ord("{")), 1, -1)
    return int(np.cumsum(steps).max(initial=0))


def _once_more(body: bytes | None, receive: Receive) -> Receive:
    """Hands a body that was read before to the application, and then what comes after it."""
    if body is None:
        return receive
    rest: list[Message] = [{"type": "http.request", "body": body, "more_body": False}]

    async def again() -> Message:
        return rest.pop() if rest else await receive()

    return again


def _in_time(receive: Receive) -> Receive:
    """Gives up an upload of which nothing comes any more."""
    is_complete = False

    async def patient() -> Message:
        nonlocal is_complete
        if is_complete:  # what comes now tells that the caller has gone, whenever that is
            return await receive()
        try:
            async with asyncio.timeout(SECONDS_FOR_A_BODY):
                message = await receive()
        except TimeoutError:
            raise HTTPException(408, TOO_SLOW, {"connection": "close"}) from None
        is_complete = not message.get("more_body", False)
        return message

    return patient
