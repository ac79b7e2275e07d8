"""Joins the parts into one application; the only module that knows them all."""

import asyncio
import contextlib
import logging
from collections.abc import AsyncIterator

from fastapi import FastAPI

from app import __version__, pages
from app.access.auth import Auth
from app.access.throttle import Throttle
from app.analysis.report.report_cache import ReportCache
from app.api import (
    body_limits,
    copies,
    datasets,
    exports,
    health,
    host_names,
    objects,
    participation,
    placement,
    problems,
    registration_stream,
    registrations,
    replay,
    replay_proxy,
    reports,
    scene_things,
    scenes,
    searches,
    sign_in,
    snaps,
    studies,
    symmetries,
    tasks,
    team_reports,
    three_points,
    uncertainty,
    view_proxy,
)
from app.confidence.standards import Standards
from app.config import Settings
from app.datasets.scene_data import SceneData
from app.export.processes import ExportJobs
from app.labeling.live.sessions import LiveSessions
from app.replay.replays import Replays
from app.services import Services
from app.serving.memory import give_back
from app.storage.database import Database
from app.storage.event_log import EventLog
from app.storage.named_files import open_store
from app.storage.unfinished import clear_unfinished
from app.study.studies import Studies
from app.workers.pool import Snapper, create_snapper
from app.workers.preparation import Preparation

logger = logging.getLogger(__name__)

SECONDS_BETWEEN_CLEANINGS = 60.0


def create_services(settings: Settings, snapper: Snapper | None = None) -> Services:
    """Open the database and start the workers, unless they were started before.

    Raises:
        DatabaseError: where the database is not of this version.
    """
    database = Database(settings.resolved_database_url)
    database.check_version()
    files = open_store(settings.files_dir, database)
    log = EventLog(database)
    data = SceneData(files)
    snapper = snapper or create_snapper(settings)
    standards = Standards(database, settings.risk)
    return Services(
        settings=settings,
        database=database,
        files=files,
        auth=Auth(database, Throttle(settings.throttle_file)),
        log=log,
        data=data,
        snapper=snapper,
        preparation=Preparation(database, data, snapper),
        standards=standards,
        live_sessions=LiveSessions(database, log, data, snapper, standards),
        replays=Replays(database, log, data),
        export_jobs=ExportJobs(database, settings),
        kept=ReportCache(database),
        studies=Studies(database, data),
    )


def create_app(services: Services) -> FastAPI:
    """The web application around the services; it closes them when it ends."""

    @contextlib.asynccontextmanager
    async def lifespan(_app: FastAPI) -> AsyncIterator[None]:
        settings = services.settings
        clear_unfinished(settings.state_dir, settings.files_dir, settings.prepared_dir)
        services.export_jobs.fail_interrupted()
        services.preparation.start()
        cleaning = asyncio.create_task(_clean_up(services))
        yield
        cleaning.cancel()
        await asyncio.to_thread(_close, services)

    app = FastAPI(
        title="Snap6D",
        version=__version__,
        description="Human-in-the-loop annotation of 6-DoF object poses. Poses are 4x4 nested lists, metres.",
        openapi_url="/api/openapi.json",
        docs_url=None,
        redoc_url=None,
        lifespan=lifespan,
        responses=problems.PROBLEM_RESPONSES,
    )
    app.state.services = services
    problems.install(app)
    app.add_middleware(body_limits.BodyLimits, uploads={datasets.router.prefix})
    app.add_middleware(host_names.HostNames)
    for module in (
        health,
        sign_in,
        datasets,
        scenes,
        objects,
        symmetries,
        tasks,
        registrations,
        registration_stream,
        scene_things,
        replay,
        placement,
        three_points,
        copies,
        snaps,
        searches,
        uncertainty,
        exports,
        team_reports,
        reports,
        studies,
        participation,
    ):
        app.include_router(module.router)
    app.include_router(replay_proxy.router)
    app.include_router(view_proxy.router)
    pages.install(app)
    return app


async def _clean_up(services: Services) -> None:
    closed_before = 0
    while True:
        await asyncio.sleep(SECONDS_BETWEEN_CLEANINGS)
        closed = 0
        for close_idle in (services.live_sessions.close_idle, services.replays.close_idle):
            try:
                closed += await asyncio.to_thread(close_idle)
            except Exception:  # the next time is soon
                logger.exception("sessions that nobody uses could not be closed")
        if closed_before:  # by now the threads of their views have ended, and hold nothing any more
            await asyncio.to_thread(give_back)
        closed_before = closed
        services.preparation.look()  # another program may have imported something


def _close(services: Services) -> None:
    services.live_sessions.close()
    services.replays.close()
    services.export_jobs.close()
    services.preparation.close()
    services.snapper.close()
    services.preparation.join()
    services.auth.close()
    services.database.close()
