"""What is asked of an estimate before the machine may take over: the risk, and the confidence that bears it
out.
"""

from functools import lru_cache

from app.confidence.assessment import Standard
from app.config import RISK
from app.storage.database import Database
from app.storage.tables import CalibrationRow, Dataset
from registration_core import Recalibration, acceptance, calibration_of
from registration_core.algorithm import ALGORITHM
from registration_core.judge.acceptance import NEVER, fewest, shipped_calibration


class Standards:
    """The standard of each dataset, as it is now.

    Args:
        database: Where risks and calibrations of datasets are kept.
        risk: Where a dataset says nothing else.
    """

    def __init__(self, database: Database, risk: float = RISK) -> None:
        self._database = database
        self.risk = risk

    def of(self, dataset_id: int) -> Standard:
        """The standard of a dataset."""
        with self._database.read() as session:
            return self.of_row(session.get_one(Dataset, dataset_id))

    def of_row(self, row: Dataset, risk: float | None = None) -> Standard:
        """The same of a dataset that was read already; of another risk than its own where one is given."""
        risk = next(one for one in (risk, row.risk, self.risk) if one is not None)
        own = row.calibration
        return _shipped(risk) if own is None or own.algorithm != ALGORITHM else standard_of(own, risk)


def standard_of(row: CalibrationRow, risk: float) -> Standard:
    """The standard that a dataset's own calibration sets.

    Where it is too small to bear the risk out, even if all were right, the threshold is the shipped one.
    """
    corrected = Recalibration(row.stretch, row.shift)
    own = calibration_of(row.confidences, row.right, "the dataset's own registrations")
    if len(own) >= fewest(risk, own.delta):
        return Standard(risk, acceptance(risk, own), corrected, is_own=True, rests_on=len(own))
    shipped = acceptance(risk)
    threshold = float(corrected(shipped)) if shipped <= 1.0 else NEVER
    return Standard(risk, threshold, corrected, rests_on=len(shipped_calibration()))


@lru_cache
def _shipped(risk: float) -> Standard:
    return Standard(risk, acceptance(risk), rests_on=len(shipped_calibration()))
