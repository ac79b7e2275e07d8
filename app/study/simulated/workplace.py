"""What simulated operators and batches work with."""

from dataclasses import dataclass

from app.datasets.scene_data import SceneData
from app.storage.database import Database
from app.study.studies import Studies
from app.workers.pool import Snapper


@dataclass(frozen=True)
class Workplace:
    """A database, what it stands for, and workers."""

    database: Database
    data: SceneData
    snapper: Snapper

    @property
    def studies(self) -> Studies:
        """The studies of the database."""
        return Studies(self.database, self.data)
