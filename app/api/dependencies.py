"""What routes ask for: the services, who is asking, and a page of a list."""

from collections.abc import Callable, Sequence
from typing import Annotated, Any, Generic, TypeVar
from urllib.parse import urlsplit

import numpy as np
from fastapi import Depends, HTTPException, Path, Query
from numpy.typing import NDArray
from pydantic import BaseModel
from sqlalchemy import ColumnElement, Select
from sqlalchemy.orm import Session
from sqlalchemy.orm.interfaces import ORMOption
from starlette.requests import HTTPConnection

from app.access.auth import Identity
from app.api.problems import InputError
from app.labeling.live.live_session import LiveSession
from app.services import Services
from app.storage.roles import Role
from app.storage.tables import Pose
from app.study.participation import sees
from registration_core.geometry import pose

SESSION_COOKIE = "snap6d_session"
SAFE_METHODS = frozenset({"GET", "HEAD", "OPTIONS"})
LARGEST_PAGE = 500
EXAMPLE_POSE = [[1, 0, 0, 0.1], [0, 1, 0, 0], [0, 0, 1, 0.8], [0, 0, 0, 1]]
"""For the interface's description."""

Row = TypeVar("Row")
Item = TypeVar("Item")


def get_services(connection: HTTPConnection) -> Services:
    """The application's parts."""
    services: Services = connection.app.state.services
    return services


def identify(connection: HTTPConnection) -> Identity | None:
    """Who is asking, by API token or by login cookie."""
    auth = get_services(connection).auth
    authorization = connection.headers.get("authorization", "")
    if authorization.lower().startswith("bearer "):
        return auth.identify_token(authorization[7:].strip())
    cookie = connection.cookies.get(SESSION_COOKIE)
    return auth.identify_session(cookie) if cookie else None


def is_same_origin(connection: HTTPConnection, *, required: bool) -> bool:
    """Whether the page that asks is ours. `required`: a request that does not say is refused."""
    origin = connection.headers.get("origin")
    if origin is None:
        return not required
    public = get_services(connection).settings.public_url
    own_host = urlsplit(public).netloc if public else connection.headers.get("host")
    return urlsplit(origin).netloc == own_host


def signed_in(connection: HTTPConnection) -> Identity:
    """Whoever is asking; 401 for nobody, 403 for a foreign page."""
    identity = identify(connection)
    if identity is None:
        raise HTTPException(401, "Please sign in first.")
    method = connection.scope.get("method", "GET")
    if method not in SAFE_METHODS and not is_same_origin(connection, required=False):
        raise HTTPException(403, "This request came from a foreign page and was refused.")
    return identity


def at_least(role: Role) -> Callable[[Identity], Identity]:
    """A dependency that lets only this role and those above it pass."""

    def check(identity: Annotated[Identity, Depends(signed_in)]) -> Identity:
        if not identity.role.includes(role):
            raise HTTPException(403, f"This needs the role {role}; yours is {identity.role}.")
        return identity

    return check


ServicesDep = Annotated[Services, Depends(get_services)]
AnyoneDep = Annotated[Identity, Depends(signed_in)]
"""Participants of studies as well: the route looks after what is theirs."""
IdentityDep = Annotated[Identity, Depends(at_least(Role.OPERATOR))]
ReviewerDep = Annotated[Identity, Depends(at_least(Role.REVIEWER))]
AdminDep = Annotated[Identity, Depends(at_least(Role.ADMIN))]
LimitDep = Annotated[int, Query(ge=1, le=LARGEST_PAGE, description="Most items to return.")]
AfterDep = Annotated[int, Query(ge=0, le=2**31 - 1, description="`next` of the page before.")]


class Page(BaseModel, Generic[Item]):
    """Part of a list; `next` is handed in as `after` for the part that follows, null at the end."""

    items: list[Item]
    next: int | None


def page_of(
    session: Session,
    query: Select[Row],
    key: Any,
    after: int,
    limit: int,
    to_json: Callable[[Row], Item],
) -> Page[Item]:
    """One page of a query's rows in the order of `key`, an integer column."""
    ordered = query.where(key > after).order_by(key).limit(limit + 1)
    rows: Sequence[Row] = session.scalars(ordered).unique().all()
    shown = rows[:limit]
    more = len(rows) > limit
    return Page(items=[to_json(row) for row in shown], next=getattr(shown[-1], key.key) if more else None)


def row_or_404(session: Session, table: type[Row], row_id: int, *options: ORMOption) -> Row:
    """The row with this id; 404 where there is none."""
    row = session.get(table, row_id, options=options)
    if row is None:
        raise HTTPException(404, f"There is no {table.__name__.lower()} {row_id}.")
    return row


def rigid_pose(value: Pose, name: str) -> NDArray[np.float64]:
    """A pose from a request as (4, 4).

    Raises:
        InputError: naming the field, where it is no rigid transform or farther away than any place on earth.
    """
    try:
        T = pose.checked(value, name)
    except ValueError as error:
        raise InputError(f"{error}.") from error
    if not pose.is_within_reach(T):
        farthest = float(np.abs(T[:3, 3]).max())
        raise InputError(f"{name} puts the object {farthest:.3g} metres away; positions are in metres.")
    return T


Id = Annotated[int, Path(ge=1, le=2**31 - 1)]
"""Of a row, in a path."""
QueryId = Annotated[int | None, Query(ge=1, le=2**31 - 1)]
"""Of a row, as a filter of a list."""
Choice = Annotated[str | None, Query(max_length=500)]
"""A name that something has to have; all where it is left out."""


def my_live_session(registration_id: Id, services: ServicesDep, identity: AnyoneDep) -> LiveSession:
    """The caller's own live session."""
    return services.live_sessions.open(registration_id, identity)


LiveSessionDep = Annotated[LiveSession, Depends(my_live_session)]


def check_sees(services: Services, identity: Identity, what: ColumnElement[bool], name: str) -> None:
    """404 for a participant none of whose tasks meets a condition on `Task`; others may see everything."""
    if identity.role is Role.PARTICIPANT and not sees(services.database, identity.user_id, what):
        raise HTTPException(404, f"There is no {name} of yours.")
