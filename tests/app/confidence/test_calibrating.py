"""Calibrating the confidence by a dataset's own registrations: what is taken, gained and kept."""

import shutil
from collections.abc import Iterator
from pathlib import Path

import numpy as np
import pytest
from scipy.special import expit, logit
from sqlalchemy import select

from app.confidence.calibrating import Experience, TooFewError, calibrate, experience_of, gains_of, told
from app.confidence.standards import Standards
from app.config import Settings
from app.datasets.scene_data import SceneData
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.tables import CalibrationRow, EstimateRow, Registration, Task, User
from registration_core import ALGORITHM, SnapConfig
from registration_core.geometry import pose
from tests.processes import Command, failure


def experience(count: int, stretch: float = 1.0, shift: float = 0.0, each: int = 1) -> Experience:
    """Registrations with estimates whose chance of being right has log-odds so much stretched and shifted."""
    rng = np.random.default_rng(5)
    confidences = rng.beta(3.0, 0.6, count * each)
    right = rng.random(count * each) < expit(stretch * logit(np.clip(confidences, 1e-4, 1 - 1e-4)) + shift)
    return Experience(confidences, right, np.repeat(np.arange(count), each))


def test_an_overconfident_dataset_gains_by_it() -> None:
    row, gains = calibrate(experience(400, 0.6, -1.5), 0.1)
    assert gains.after.brier < gains.before.brier - 0.02
    assert gains.after.log_loss < gains.before.log_loss - 0.1
    assert gains.after.calibration_error < 0.5 * gains.before.calibration_error
    assert gains.after.auroc == pytest.approx(gains.before.auroc, abs=0.02)
    assert row.stretch == pytest.approx(0.6, abs=0.15)
    assert row.shift == pytest.approx(-1.5, abs=0.3)
    assert len(row.confidences) == len(row.right) == gains.registrations == 400


def test_a_dataset_whose_confidence_is_right_loses_next_to_nothing() -> None:
    _, gains = calibrate(experience(200), 0.1)
    assert gains.after.log_loss < gains.before.log_loss + 0.02


def test_what_is_accepted_holds_the_risk_on_registrations_left_out() -> None:
    gains = gains_of(experience(2_000, 1.0, 1.0), 0.05)
    assert gains.after.accepted > 0.3
    assert gains.after.wrong_among_accepted is not None
    assert gains.after.wrong_among_accepted < 0.06


def test_a_registration_counts_as_one_however_many_estimates_it_has() -> None:
    known = experience(60)
    _, inverse = np.unique(np.repeat(known.registrations, 3), return_inverse=True)
    thrice = Experience(np.repeat(known.confidences, 3), np.repeat(known.right, 3), inverse)
    once, again = calibrate(known, 0.1)[0], calibrate(thrice, 0.1)[0]
    assert again.stretch == pytest.approx(once.stretch, abs=1e-3)
    assert sorted(again.confidences) == pytest.approx(sorted(once.confidences), abs=1e-3)


def test_too_few_registrations_are_refused_in_one_sentence() -> None:
    with pytest.raises(TooFewError, match="29 submitted registrations"):
        calibrate(experience(29, each=10), 0.02)


def test_lines_for_people() -> None:
    known = experience(40)
    lines = told(calibrate(Experience(known.confidences, np.ones(40, bool), known.registrations), 0.02)[1])
    assert lines[0].startswith("40 registrations, 40 estimates, 100 % right")
    assert [line.split("  ")[0] for line in lines[2:]] == [
        "Brier score",
        "log loss",
        "AUROC",
        "calibration error",
        "accepted at a risk of 2 %",
        "wrong among these",
    ]
    assert lines[4].split() == ["AUROC", "–", "–"]


@pytest.fixture
def state_dir(imported_state: Path, tmp_path: Path) -> Path:
    return Path(shutil.copytree(imported_state, tmp_path / "state"))


@pytest.fixture
def database(state_dir: Path) -> Iterator[Database]:
    opened = Database(Settings(state_dir=state_dir).resolved_database_url)
    yield opened
    opened.close()


def register(database: Database, number: int, off: float, **changes: object) -> None:
    """A submitted registration of the first task with one estimate, so many metres off."""
    T = pose.exp([0.1, 0.0, 0.5, 0.2, 0.1, 0.0])
    with database.write() as session:
        user = User(name=f"operator {number}", role="operator")
        session.add(user)
        session.flush()
        task = session.scalars(select(Task)).first()
        assert task is not None
        row = Registration(task_id=task.id, user_id=user.id, state="submitted", T_world_object=T.tolist())
        session.add(row)
        session.flush()
        found = (pose.exp([off, 0.0, 0.0, 0.0, 0.0, 0.0]) @ T).tolist()
        values = {
            "snap_id": f"snap {number}",
            "registration_id": row.id,
            "frame_id": task.frame_id,
            "T_world_object_start": T.tolist(),
            "T_world_object": found,
            "T_camera_object": found,
            "confidence": 0.5 + 0.01 * (number % 40),
            "covariance": [],
            "hypotheses": [],
            "converged": True,
            "seed": 1,
            "config": SnapConfig().to_dict(),
            "version": "1",
            "algorithm": ALGORITHM,
            "hardware": "",
            "seconds": 0.1,
            "evaluations": 1,
        }
        session.add(EstimateRow(**(values | changes)))


def test_estimates_on_the_way_to_submitted_poses_are_taken(database: Database, state_dir: Path) -> None:
    register(database, 1, off=0.0)
    register(database, 2, off=0.1)
    register(database, 3, off=0.0, algorithm="another")
    register(database, 4, off=0.0, config=SnapConfig.paper().to_dict())
    register(database, 5, off=0.0)
    with database.write() as session:
        session.scalars(select(Registration)).all()[-1].state = "open"
    known = experience_of(database, SceneData(FileStore(state_dir / "files")), 1)
    assert known.right.tolist() == [True, False]
    assert known.registrations.tolist() == [0, 1]


def test_the_command_calibrates_says_what_it_gained_and_takes_it_back(
    database: Database, state_dir: Path, snap6d: Command
) -> None:
    refused = snap6d(state_dir, "calibrate", "tools")
    assert failure(refused) == ("0 submitted registrations have snaps of this version; calibrating needs 30")
    assert "there is no dataset 'none'; there are: tools" in failure(snap6d(state_dir, "calibrate", "none"))
    for number in range(40):
        register(database, number, off=0.1 if number % 4 == 0 else 0.0)
    done = snap6d(state_dir, "calibrate", "tools")
    assert done.returncode == 0, done.stderr
    assert done.stdout.startswith("40 registrations, 40 estimates, 75 % right")
    assert "go by this from now on" in done.stdout
    with database.read() as session:
        row = session.scalars(select(CalibrationRow)).one()
    assert row.gains["registrations"] == len(row.confidences) == 40
    standard = Standards(database).of(1)
    assert (standard.recalibration.stretch, standard.recalibration.shift) == (row.stretch, row.shift)
    assert snap6d(state_dir, "calibrate", "tools").returncode == 0  # in place of the one before
    assert "again." in snap6d(state_dir, "calibrate", "tools", "--reset").stdout
    assert "no calibration of its own" in snap6d(state_dir, "calibrate", "tools", "--reset").stdout
    assert Standards(database).of(1).recalibration.stretch == 1.0
