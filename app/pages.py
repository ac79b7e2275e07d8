"""The pages: templates, their static files, and the headers that keep them to themselves."""

from functools import cache
from importlib.resources import files
from pathlib import Path
from urllib.parse import quote

from fastapi import APIRouter, FastAPI, HTTPException, Request
from fastapi.responses import HTMLResponse, RedirectResponse, Response
from fastapi.staticfiles import StaticFiles
from starlette.middleware.base import RequestResponseEndpoint

from app.api.dependencies import get_services, identify
from app.api.problems import http_error
from app.resources import STATIC
from app.storage.roles import Role
from app.storage.tables import Base, Object, Registration, Study, Task
from app.templating import templates_in

TEMPLATES = Path(__file__).parent / "templates"
"""A file a page; what pages share, and parts of large ones, lie in folders."""
SWAGGER = Path(str(files("fastapi_swagger") / "resources"))
"""Script and style of Swagger UI; the package's own code is not used."""
CONTENT_SECURITY_POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; frame-src 'self'; frame-ancestors 'self'; "
    "base-uri 'none'; form-action 'self'"
)

ABOUT: dict[str, type[Base]] = {
    "label": Task,
    "objects": Object,
    "replay": Registration,
    "report": Study,
}
"""What a page is about that has an id in its address."""
LARGEST_ID = 2**31 - 1
NOT_FOR_PEOPLE = ("/api/", "/static/", "/view/")

router = APIRouter(include_in_schema=False)


def install(app: FastAPI) -> None:
    """Serve the pages and their files."""
    app.include_router(router)
    app.mount("/static/swagger", StaticFiles(directory=SWAGGER), name="swagger")
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    app.add_exception_handler(404, _missing)
    app.middleware("http")(_add_headers)


@cache
def html_of(page: str) -> str:
    """A page of the name of its template: nothing in it depends on who asks."""
    return templates_in(TEMPLATES).get_template(f"{page}.html").render()


@router.get("/participate")
def participate_page() -> HTMLResponse:
    """A participant's door into a study: their link leads here."""
    return HTMLResponse(html_of("participate"))


@router.get("/sign-in")
def sign_in_page() -> HTMLResponse:
    """Signing in, by password or one-time link."""
    return HTMLResponse(html_of("sign-in"))


@router.get("/api/docs")
def rest_page() -> HTMLResponse:
    """REST, to read and to try out; like the description that it shows, it is open to all."""
    return HTMLResponse(html_of("rest"))


@router.get("/")
@router.get("/export")
@router.get("/studies")
@router.get("/objects")
@router.get("/objects/{object_id}")
@router.get("/label/{task_id}")
@router.get("/replay/{registration_id}")
@router.get("/report/{study_id}")
def page(request: Request) -> Response:
    """Every other page: for those who are signed in."""
    identity = identify(request)
    if identity is None:
        wanted = f"{request.url.path}?{request.url.query}" if request.url.query else request.url.path
        return RedirectResponse(f"/sign-in?next={quote(wanted, safe='')}", 303)
    name, *about = request.url.path.removeprefix("/").split("/")
    if identity.role is Role.PARTICIPANT and name != "label":
        return RedirectResponse("/participate", 303)
    if about and not _exists(request, name, about[0]):
        raise HTTPException(404, f"There is nothing at {request.url.path}: no {name} page is about it.")
    return HTMLResponse(html_of(name or "home"))


def _exists(request: Request, name: str, about: str) -> bool:
    if (name, about) == ("report", "team"):
        return True
    if not (about.isascii() and about.isdigit()) or int(about) > LARGEST_ID:
        return False
    with get_services(request).database.read() as session:
        return session.get(ABOUT[name], int(about)) is not None


def _missing(request: Request, error: Exception) -> Response:
    """For a browser a page that leads home, for programs the problem."""
    asks_for_page = "text/html" in request.headers.get("accept", "")
    if asks_for_page and not request.url.path.startswith(NOT_FOR_PEOPLE):
        return HTMLResponse(html_of("missing"), 404)
    return http_error(request, error)


async def _add_headers(request: Request, call_next: RequestResponseEndpoint) -> Response:
    response = await call_next(request)
    response.headers.setdefault("x-content-type-options", "nosniff")
    response.headers.setdefault("referrer-policy", "same-origin")
    if request.url.path.startswith("/static"):
        response.headers["cache-control"] = "no-cache"
    elif not request.url.path.startswith("/view/"):
        response.headers.setdefault("content-security-policy", CONTENT_SECURITY_POLICY)
        response.headers.setdefault("cache-control", "no-store")
    return response
