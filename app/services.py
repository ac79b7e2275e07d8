"""The parts of a running application, joined once and handed to the routes."""

from dataclasses import dataclass

from app.access.auth import Auth
from app.analysis.report.report_cache import ReportCache
from app.confidence.standards import Standards
from app.config import Settings
from app.datasets.scene_data import SceneData
from app.export.processes import ExportJobs
from app.labeling.live.sessions import LiveSessions
from app.replay.replays import Replays
from app.storage.database import Database
from app.storage.event_log import EventLog
from app.storage.files import FileStore
from app.study.studies import Studies
from app.workers.pool import Snapper
from app.workers.preparation import Preparation


@dataclass(frozen=True)
class Services:
    """What routes work with."""

    settings: Settings
    database: Database
    files: FileStore
    auth: Auth
    log: EventLog
    data: SceneData
    snapper: Snapper
    preparation: Preparation
    standards: Standards
    live_sessions: LiveSessions
    replays: Replays
    export_jobs: ExportJobs
    kept: ReportCache
    studies: Studies
