"""Errors as `application/problem+json` (RFC 9457) with one sentence in `detail`."""

import logging
import sqlite3
from collections.abc import Mapping
from http import HTTPStatus
from typing import Any

from fastapi import FastAPI, Request
from fastapi.exceptions import RequestValidationError
from fastapi.responses import JSONResponse
from sqlalchemy.exc import InternalError, OperationalError
from starlette.exceptions import HTTPException

from app.access.auth import SignInError, TooManyAttemptsError
from app.datasets.symmetries import OutdatedError
from app.labeling.live.sessions import NotFoundError
from app.labeling.moves.pose_record import ActionError
from app.storage.event_log import ErasedError
from app.storage.faults import FULL, advice
from app.storage.files import DamagedFileError
from app.study.plan import StudyError

logger = logging.getLogger(__name__)

DISK_FULL = f"Nothing was saved: {FULL}."


class InputError(ValueError):
    """The request asks for something that cannot be; the message names field and value.

    Args:
        message: One sentence.
        suggested: Fields with which it would do.
    """

    def __init__(self, message: str, suggested: Mapping[str, Any] | None = None) -> None:
        super().__init__(message)
        self.suggested = suggested


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
                        "suggested": {
                            "type": "object",
                            "description": "Fields of the request with which it would do.",
                        },
                    },
                }
            }
        },
    }
}
"""For the OpenAPI document: what every route may answer instead."""


def problem(
    status: int,
    detail: str,
    headers: Mapping[str, str] | None = None,
    suggested: Mapping[str, Any] | None = None,
) -> JSONResponse:
    """A response that says what is wrong and, where it is known, with which fields it would do."""
    content: dict[str, Any] = {
        "type": "about:blank",
        "title": HTTPStatus(status).phrase,
        "status": status,
        "detail": detail,
    }
    if suggested:
        content["suggested"] = dict(suggested)
    return JSONResponse(content, status, headers, media_type="application/problem+json")


def install(app: FastAPI) -> None:
    """Turn errors of the application into problems."""
    for error_type, status in (
        (NotFoundError, HTTPStatus.NOT_FOUND),
        (ErasedError, HTTPStatus.NOT_FOUND),
        (ActionError, HTTPStatus.CONFLICT),
        (StudyError, HTTPStatus.CONFLICT),
        (OutdatedError, HTTPStatus.CONFLICT),
        (TooManyAttemptsError, HTTPStatus.TOO_MANY_REQUESTS),
        (SignInError, HTTPStatus.UNAUTHORIZED),
        (DamagedFileError, HTTPStatus.INTERNAL_SERVER_ERROR),
    ):
        app.add_exception_handler(error_type, _say(status))
    app.add_exception_handler(InputError, _wrong_input)
    app.add_exception_handler(HTTPException, http_error)
    app.add_exception_handler(RequestValidationError, _invalid_request)
    for storage_error in (OperationalError, InternalError, sqlite3.Error, OSError):
        app.add_exception_handler(storage_error, _storage_error)
    app.add_exception_handler(Exception, _unexpected_error)


def _say(status: HTTPStatus):  # type: ignore[no-untyped-def] # FastAPI wants an exact handler type
    def handler(_request: Request, error: Exception) -> JSONResponse:
        return problem(status, _as_sentence(str(error)))

    return handler


def _wrong_input(_request: Request, error: Exception) -> JSONResponse:
    assert isinstance(error, InputError)
    return problem(HTTPStatus.UNPROCESSABLE_ENTITY, _as_sentence(str(error)), suggested=error.suggested)


def _as_sentence(text: str) -> str:
    return text if text.endswith(".") else f"{text}."


def http_error(request: Request, error: Exception) -> JSONResponse:
    """An `HTTPException` as a problem."""
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
    known = advice(error)
    if known is not None:
        status = HTTPStatus.INSUFFICIENT_STORAGE if known is FULL else HTTPStatus.SERVICE_UNAVAILABLE
        return problem(status, f"Nothing was saved: {known}.")
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
