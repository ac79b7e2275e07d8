"""Signing in and out."""

from datetime import timedelta
from typing import Annotated
from urllib.parse import urlsplit

from fastapi import APIRouter, Cookie, HTTPException, Request, Response
from pydantic import BaseModel, Field
from sqlalchemy import func, select

from app.access.auth import LOGIN_LIFETIME
from app.api.dependencies import SESSION_COOKIE, AnyoneDep, ServicesDep, is_same_origin
from app.services import Services
from app.storage.tables import Registration

router = APIRouter(prefix="/api", tags=["sign-in"])


class Credentials(BaseModel):
    """Name and password."""

    name: str = Field(max_length=100, examples=["ann"])
    password: str = Field(max_length=1000, examples=["correct horse battery"])


class Link(BaseModel):
    """The secret of a sign-in link."""

    token: str = Field(max_length=200)


class Me(BaseModel):
    """Whoever is signed in."""

    id: int
    name: str
    role: str
    submitted: int
    """How many registrations they have submitted."""


@router.post("/sign-in", status_code=204)
def sign_in(body: Credentials, request: Request, services: ServicesDep) -> Response:
    """Sign in with name and password: sets the login cookie."""
    _refuse_foreign_page(request)
    address = request.client.host if request.client else ""
    secret = services.auth.sign_in(body.name, body.password, address)
    return _with_cookie(request, services, secret, LOGIN_LIFETIME)


@router.post("/sign-in/link", status_code=204)
def sign_in_with_link(body: Link, request: Request, services: ServicesDep) -> Response:
    """Sign in with a one-time link's secret: sets the login cookie and uses the link up."""
    _refuse_foreign_page(request)
    return _with_cookie(request, services, services.auth.sign_in_with_link(body.token), LOGIN_LIFETIME)


@router.post("/sign-in/study", status_code=204)
def sign_in_to_study(body: Link, request: Request, services: ServicesDep) -> Response:
    """Sign in with a participant's link, which can be used again: sets the login cookie."""
    _refuse_foreign_page(request)
    return _with_cookie(request, services, services.auth.sign_in_to_study(body.token), LOGIN_LIFETIME)


@router.post("/sign-out", status_code=204)
def sign_out(
    request: Request,
    services: ServicesDep,
    secret: Annotated[str | None, Cookie(alias=SESSION_COOKIE)] = None,
) -> Response:
    """End the login session."""
    _refuse_foreign_page(request)
    if secret:
        services.auth.sign_out(secret)
    return _with_cookie(request, services, "", timedelta(0))


@router.get("/me")
def me(identity: AnyoneDep, services: ServicesDep) -> Me:
    """Who is signed in."""
    mine = select(func.count(Registration.id)).filter_by(user_id=identity.user_id, state="submitted")
    with services.database.read() as session:
        submitted = session.scalar(mine) or 0
    return Me(id=identity.user_id, name=identity.name, role=identity.role, submitted=submitted)


def _refuse_foreign_page(request: Request) -> None:
    if not is_same_origin(request, required=False):
        raise HTTPException(403, "This request came from a foreign page and was refused.")


def _with_cookie(request: Request, services: Services, secret: str, lifetime: timedelta) -> Response:
    response = Response(status_code=204)
    response.set_cookie(
        SESSION_COOKIE,
        secret,
        max_age=int(lifetime.total_seconds()),
        httponly=True,
        samesite="lax",
        secure="https" in {request.url.scheme, urlsplit(services.settings.public_url).scheme},
    )
    return response
