"""Whether the application is ready."""

from typing import Annotated

from fastapi import APIRouter, Depends
from fastapi.responses import JSONResponse
from pydantic import BaseModel
from sqlalchemy import text
from sqlalchemy.exc import DBAPIError

from app import __version__
from app.api.dependencies import ServicesDep, get_services
from app.services import Services

router = APIRouter(prefix="/api", tags=["health"])


class Health(BaseModel):
    """What is running."""

    status: str
    """"ready", or what is missing."""
    version: str
    database: bool
    workers: int
    waiting: int
    """Snaps that wait for a worker."""


def current_health(services: Annotated[Services, Depends(get_services)]) -> Health:
    """How the database and the workers are."""
    try:
        with services.database.read() as session:
            session.execute(text("SELECT 1"))
        database = True
    except DBAPIError:
        database = False
    workers = services.snapper.worker_count()
    missing = [name for name, there in (("database", database), ("workers", workers > 0)) if not there]
    status = f"waiting for {' and '.join(missing)}" if missing else "ready"
    return Health(
        status=status,
        version=__version__,
        database=database,
        workers=workers,
        waiting=services.snapper.waiting_count(),
    )


@router.get("/health", response_model=Health, responses={503: {"model": Health}})
def health(services: ServicesDep) -> JSONResponse:
    """200 when database and workers are there, 503 until then."""
    found = current_health(services)
    return JSONResponse(found.model_dump(), 200 if found.status == "ready" else 503)
