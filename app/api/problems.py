"""Errors as `application/problem+json` (RFC 9457) with one sentence in `detail`."""

import errno
import logging
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from sqlalchemy.exc import OperationalError
from starlette.exceptions import HTTPException

from app.auth import SignInError, TooManyAttemptsError
from app.labeling.desk import NotFoundError
from app.labeling.track import ActionError
from app.study.plan import StudyError
from app.symmetries import OutdatedError

logger = logging.getLogger(__name__)

DISK_FULL = "The disk is full: nothing was saved. Free some space and do it again."


DISK_FULL_WORDS = ("disk is full", "No space left on device")
"""Of SQLite, and of PostgreSQL."""


class InputError(ValueError):
    """The request asks for something that cannot be; the message names field and value."""


PROBLEM_RESPONSES: dict[int | str, dict[str, Any]] = {
    "default": {
        "description": "What went wrong, in one sentence.",
        "content": {
            "application/problem+json": {
                "schema": {
                    "title": "Problem",
                    "type": "object",
                    "required": ["type", "title", "status", "detail"],
                    "properties": {
                        "type": {"type": "string", "const": "about:blank"},
                        "title": {"type": "string"},
                        "status": {"type": "integer"},
                        "detail": {"type": "string"},
                    },
                }
            }
        },
    }
}
"""For the OpenAPI document: what every route may answer instead."""


def problem(status: int, detail: str, headers: Mapping[str, str] | None = None) -> JSONResponse:
    """A response that says what is wrong."""
    content = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
    }
    return JSONResponse(content, status, headers, media_type="application/problem+json")


def install(app: FastAPI) -> None:
    """Turn errors of the application into problems."""
    for error_type, status in (
        (NotFoundError, HTTPStatus.NOT_FOUND),
        (ActionError, HTTPStatus.CONFLICT),
        (InputError, HTTPStatus.UNPROCESSABLE_ENTITY),
        (StudyError, HTTPStatus.CONFLICT),
        (OutdatedError, HTTPStatus.CONFLICT),
        (TooManyAttemptsError, HTTPStatus.TOO_MANY_REQUESTS),
        (SignInError, HTTPStatus.UNAUTHORIZED),
    ):
        app.add_exception_handler(error_type, _say(status))
    app.add_exception_handler(HTTPException, _http_error)
    app.add_exception_handler(RequestValidationError, _invalid_request)
    app.add_exception_handler(OperationalError, _storage_error)
    app.add_exception_handler(OSError, _storage_error)
    app.add_exception_handler(Exception, _unexpected_error)


def is_disk_full(error: BaseException) -> bool:
    """Whether an error of the database or the file system means that the disk is full."""
    return (isinstance(error, OSError) and error.errno in {errno.ENOSPC, errno.EDQUOT}) or (
        isinstance(error, OperationalError) and any(words in str(error.orig) for words in DISK_FULL_WORDS)
    )


def _say(status: HTTPStatus):  # type: ignore[no-untyped-def] # FastAPI wants an exact handler type
    def handler(_request: Request, error: Exception) -> JSONResponse:
        return problem(status, _as_sentence(str(error)))

    return handler


def _as_sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."


def _http_error(request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, HTTPException)
    detail = str(error.detail)
    if detail == HTTPStatus(error.status_code).phrase:  # the router's own: it names no address
        detail = f"{detail}: {request.method} {request.url.path}"
    return problem(error.status_code, _as_sentence(detail), error.headers)


def _invalid_request(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, RequestValidationError)
    first = error.errors()[0]
    place = ".".join(str(part) for part in first["loc"])
    said = first["msg"].removeprefix("Value error, ")  # pydantic's own words before ours
    return problem(HTTPStatus.UNPROCESSABLE_ENTITY, f"{place}: {said}.")


def _storage_error(_request: Request, error: Exception) -> JSONResponse:
    if is_disk_full(error):
        return problem(HTTPStatus.INSUFFICIENT_STORAGE, DISK_FULL)
    logger.error("the database or the file system failed", exc_info=error)
    return problem(
        HTTPStatus.INTERNAL_SERVER_ERROR,
        "The database or the file system failed; the server's log says why. Nothing was saved.",
    )


def _unexpected_error(_request: Request, _error: Exception) -> JSONResponse:
    # uvicorn writes the traceback into the server's log and closes the connection: the caller has to know
    return problem(
        HTTPStatus.INTERNAL_SERVER_ERROR,
        "Something went wrong here; the server's log says what.",
        {"connection": "close"},
    )
