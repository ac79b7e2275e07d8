"""What is asked of an estimate: the risk of the settings or the dataset, and a calibration of its own."""

import numpy as np
import pytest

from app.confidence.standards import Standards, standard_of
from app.config import RISK
from app.storage.database import Database
from app.storage.tables import CalibrationRow, Dataset
from registration_core import ALGORITHM, acceptance
from registration_core.judge.acceptance import NEVER, shipped_calibration


@pytest.fixture
def dataset_id(database: Database) -> int:
    with database.write() as session:
        row = Dataset(name="tools")
        session.add(row)
        session.flush()
        return row.id


def calibration(dataset_id: int, right: int = 200, wrong: int = 0, **changes: object) -> CalibrationRow:
    """So many right registrations with confidences from 0.5 on, and wrong ones below."""
    confidences = [*np.linspace(0.1, 0.4, wrong), *np.linspace(0.5, 0.99, right)]
    values = {
        "dataset_id": dataset_id,
        "algorithm": ALGORITHM,
        "stretch": 0.5,
        "shift": 1.0,
        "confidences": confidences,
        "right": [False] * wrong + [True] * right,
        "gains": {},
    }
    return CalibrationRow(**(values | changes))


def keep(database: Database, row: CalibrationRow) -> None:
    with database.write() as session:
        session.add(row)


def test_without_calibration_the_shipped_one_counts(database, dataset_id) -> None:
    standard = Standards(database, 0.03).of(dataset_id)
    assert (standard.risk, standard.threshold) == (0.03, acceptance(0.03))
    assert standard.recalibration(0.7) == pytest.approx(0.7)


def test_a_dataset_has_its_own_risk_and_calibration_from_now_on(database, dataset_id) -> None:
    standards = Standards(database)
    standards.of(dataset_id)
    with database.write() as session:
        session.get_one(Dataset, dataset_id).risk = 0.1
    keep(database, calibration(dataset_id, 200, 50))
    standard = standards.of(dataset_id)
    assert standard.risk == 0.1
    assert 0.1 < standard.threshold <= 0.5
    assert standard.recalibration(0.5) == pytest.approx(1 / (1 + np.exp(-1.0)))
    assert (standard.is_own, standard.rests_on) == (True, 250)
    with database.read() as session:
        row = session.get_one(Dataset, dataset_id)
        assert standards.of_row(row) == standard
        assert standards.of_row(row, 0.2).risk == 0.2
    with database.write() as session:
        other = Dataset(name="other tools")
        session.add(other)
    assert standards.of(other.id).risk == RISK
    assert not standards.of(other.id).is_own


def test_a_calibration_of_another_algorithm_rests(database, dataset_id) -> None:
    keep(database, calibration(dataset_id, algorithm="another"))
    standard = Standards(database).of(dataset_id)
    assert standard.threshold == acceptance(RISK)
    assert standard.recalibration(0.7) == pytest.approx(0.7)


def test_one_that_is_too_small_for_the_risk_leaves_the_shipped_threshold(monkeypatch) -> None:
    monkeypatch.setattr(
        "app.confidence.standards.acceptance", lambda risk, own=None: 0.6 if own is None else NEVER
    )
    small = standard_of(calibration(1, right=50), 0.02)
    assert small.threshold == pytest.approx(small.recalibration(0.6))
    assert (small.is_own, small.rests_on) == (False, len(shipped_calibration()))
    assert standard_of(calibration(1, right=120), 0.02).threshold == NEVER
