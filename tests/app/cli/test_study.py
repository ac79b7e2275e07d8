"""Commands about studies, as a person uses them."""

from pathlib import Path

import pytest

from app.access.auth import Auth
from app.config import Settings
from app.datasets.scene_data import SceneData
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from app.study.offline.batch import OfflineBatch
from app.study.plan import StudyPlan
from app.study.studies import Studies
from tests.processes import Command, failure


@pytest.fixture
def study(snap6d: Command, state_dir: Path, cluster: str):
    """Runs a command about studies on the small dataset."""

    def run(*arguments: str):
        return snap6d(state_dir, "study", *arguments, SNAP6D_SCHEDULER_ADDRESS=cluster)

    return run


def create_of_people(state_dir: Path, name: str) -> None:
    settings = Settings(state_dir=state_dir)
    database = Database(settings.resolved_database_url)
    plan = StudyPlan.model_validate({"tasks": [{"scene_id": 1, "object_id": 1}]})
    owner = Auth(database).create_user("root", Role.ADMIN)
    Studies(database, SceneData(FileStore(settings.files_dir))).create(name, plan, 0, owner.id)
    database.close()


def test_from_simulated_operators_to_a_report(study, tmp_path):
    done = study("simulate", "try", "--operators", "1", "--scenes", "1")
    assert done.stdout == "Study try: all simulated operators are done.\n", done.stderr
    assert study("list").stdout == "try (simulated, open): 2 participants, 4 of 4 tasks submitted\n"
    printed = study("snap", "try").stdout
    assert printed.startswith("Study try: ") and " snaps computed, 0 failed. A snap took " in printed
    assert ", 0 snaps computed" in study("snap", "try").stdout
    written = study("report", "try", "--out", str(tmp_path / "report")).stdout.splitlines()
    assert str(tmp_path / "report" / "figure.svg") in written
    assert all(Path(path).stat().st_size for path in written)
    report = ("report", "try", "--out", str(tmp_path / "part"))
    assert study(*report, "--group", "expert", "--mode", "quick").returncode == 0
    curves = (tmp_path / "part" / "curves.csv").read_text().splitlines()
    assert len(curves) == 1 + 2 * 2 * 41 and all('"expert","quick"' in line for line in curves[1:])
    assert "mode 'slow' is none of this study; there are: accurate, quick" in failure(
        study(*report, "--mode", "slow")
    )
    (tmp_path / "file").touch()
    message = failure(study("report", "try", "--out", str(tmp_path / "file" / "report")))
    assert message.endswith("Not a directory; choose another folder with --out")
    again = study("simulate", "try", "--operators", "3")
    assert again.stdout.startswith("Study try goes on as it was set up, whatever --operators")
    assert study("list").stdout == "try (simulated, open): 2 participants, 4 of 4 tasks submitted\n"
    assert study("erase", "try", "P01").stdout == "All that P01 did and answered is erased.\n"
    assert study("list").stdout == "try (simulated, open): 2 participants, 2 of 2 tasks submitted\n"


def test_what_is_not_there_is_said(study, tmp_path):
    commands = (["snap", "no"], ["report", "no", "--out", str(tmp_path)], ["erase", "no", "P01"])
    for command in commands:
        message = failure(study(*command))
        assert message == "there is no study 'no'; `snap6d study list` names those that are there"


def test_scenes_of_known_poses_have_to_suffice(study):
    message = failure(study("simulate", "try", "--scenes", "3"))
    assert message == "3 scenes with an object of known pose are needed; there are 2"
    assert study("list").stdout == ""


def test_people_are_not_simulated(study, state_dir):
    create_of_people(state_dir, "people")
    assert study("list").stdout == "people (open): 0 participants, 0 of 0 tasks submitted\n"
    message = failure(study("simulate", "people"))
    assert message == "the study 'people' is one of people; choose another name"
    assert failure(study("erase", "people", "P09")) == "the study 'people' has no participant 'P09'"


def test_ctrl_c_loses_nothing_and_says_so(study, state_dir, monkeypatch):
    create_of_people(state_dir, "people")

    def run(*_arguments: object) -> None:
        raise KeyboardInterrupt

    monkeypatch.setattr(OfflineBatch, "run", run)
    message = failure(study("snap", "people"))
    assert message == "stopped; what was done is stored, and the same command goes on from there"
