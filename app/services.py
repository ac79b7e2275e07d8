"""The parts of a running application, joined once and handed to the routes."""

from dataclasses import dataclass

from app.analysis.kept import Kept
from app.auth import Auth
from app.config import Settings
from app.database import Database
from app.event_log import EventLog
from app.export_jobs import ExportJobs
from app.labeling.desk import Desk
from app.preparation import Preparation
from app.replay.replays import Replays
from app.scene_data import SceneData
from app.snapping import Snapper
from app.standards import Standards
from app.storage import FileStore
from app.study.studies import Studies


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
    desk: Desk
    replays: Replays
    export_jobs: ExportJobs
    kept: Kept
    studies: Studies
