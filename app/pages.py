"""The pages: static files, and the headers that keep them to themselves."""

from urllib.parse import quote

from fastapi import APIRouter, FastAPI, Request
from fastapi.responses import FileResponse, RedirectResponse, Response
from fastapi.staticfiles import StaticFiles
from starlette.middleware.base import RequestResponseEndpoint

from app.api.dependencies import identify
from app.auth import Role
from app.config import PROJECT

STATIC = PROJECT / "static"
CONTENT_SECURITY_POLICY = (
    "default-src 'self'; img-src 'self' data: blob:; frame-src 'self'; frame-ancestors 'self'; "
    "base-uri 'none'; form-action 'self'"
)

router = APIRouter(include_in_schema=False)


def install(app: FastAPI) -> None:
    """Serve the pages and their files."""
    app.include_router(router)
    app.mount("/static", StaticFiles(directory=STATIC), name="static")
    app.middleware("http")(_add_headers)


@router.get("/participate")
def participate_page() -> FileResponse:
    """A participant's door into a study: their link leads here."""
    return FileResponse(STATIC / "participate.html")


@router.get("/sign-in")
def sign_in_page() -> FileResponse:
    """Signing in, by password or one-time link."""
    return FileResponse(STATIC / "sign-in.html")


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
    name = request.url.path.split("/")[1] or "home"
    if identity.role is Role.PARTICIPANT and name != "label":
        return RedirectResponse("/participate", 303)
    return FileResponse(STATIC / f"{name}.html")


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
