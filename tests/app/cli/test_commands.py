"""The command line, as a person uses it."""

import sqlite3
import zipfile
from pathlib import Path

import pytest

from app.access.auth import Auth
from app.config import Settings
from app.datasets.importing import import_dataset
from app.storage.database import Database
from app.storage.files import FileStore
from app.storage.roles import Role
from tests.app.export.site import make_site
from tests.processes import Command, failure, run_snap6d


@pytest.fixture
def state(tmp_path: Path, snap6d: Command) -> Path:
    """A state directory with an empty database."""
    folder = tmp_path / "state"
    assert snap6d(folder, "migrate").stdout == "The database is up to date.\n"
    return folder


def opened(state: Path) -> Database:
    return Database(Settings(state_dir=state).resolved_database_url)


def test_migrating_twice_does_no_harm(snap6d, state):
    assert snap6d(state, "migrate").returncode == 0
    database = opened(state)
    database.check_version()
    database.close()


def test_import_says_what_is_new(snap6d, state, demo):
    first = snap6d(state, "import", str(demo))
    assert first.returncode == 0, first.stderr
    assert first.stdout == "Dataset tools: 2 new objects, 2 new scenes, 3 new frames, 4 new tasks.\n"
    again = snap6d(state, "import", str(demo))
    assert again.stdout == "Dataset tools: 0 new objects, 0 new scenes, 0 new frames, 0 new tasks.\n"
    renamed = snap6d(state, "import", str(demo), "--name", "other")
    assert renamed.stdout.startswith("Dataset other: 2 new objects")


def test_import_of_what_is_not_sound_is_one_sentence(snap6d, state, demo_copy):
    (demo_copy / "test/000001/depth/000005.png").unlink()
    message = failure(snap6d(state, "import", str(demo_copy)))
    assert message.startswith("test/000001/depth/000005.png is missing")
    assert failure(snap6d(state, "import", str(demo_copy / "nothing"))).endswith("a BOP dataset")


def test_a_token_is_printed_once_and_works(snap6d, state):
    token = snap6d(state, "token", "create", "robot", "--role", "admin").stdout.strip()
    database = opened(state)
    identity = Auth(database).identify_token(token)
    database.close()
    assert identity is not None and (identity.name, identity.role) == ("robot", Role.ADMIN)
    message = failure(snap6d(state, "token", "create", "robot"))
    assert message == "user 'robot' has the role admin, not operator; choose another name"


def test_an_unknown_role_is_said(snap6d, state):
    for command in (["token", "create", "x"], ["user", "add", "x"]):
        message = failure(snap6d(state, *command, "--role", "king"))
        assert message == "role 'king' is unknown; choose one of operator, reviewer, admin"


def test_a_new_user_gets_a_link(snap6d, state):
    printed = snap6d(state, "user", "add", "ann", SNAP6D_PORT="9123").stdout.splitlines()
    assert printed[0] == "User ann may sign in, once, with this link:"
    address, secret = printed[1].split("#")
    assert address == "http://localhost:9123/sign-in"
    database = opened(state)
    auth = Auth(database)
    identity = auth.identify_session(auth.sign_in_with_link(secret))
    assert identity is not None and identity.role == Role.OPERATOR
    database.close()
    assert "already is a user named 'ann'" in failure(snap6d(state, "user", "add", "ann"))


def test_a_name_that_looks_like_markup_is_a_name(snap6d, state):
    added = snap6d(state, "user", "add", "[/x] [bold]")
    assert added.returncode == 0, added.stderr
    assert "User [/x] [bold] may sign in" in added.stdout


def test_an_import_says_what_looked_odd(snap6d, state, shared_cases):
    done = snap6d(state, "import", str(shared_cases / "55-pose-in-opengl-axes"))
    assert done.returncode == 0, done.stderr
    assert "Odd: object 1 lies behind the camera" in done.stdout and "(test/000001, image 0)" in done.stdout


def test_an_import_takes_another_depth_scale(snap6d, state, shared_cases):
    case = str(shared_cases / "22-depth-scale-in-metres")
    assert "import with depth scale 1" in failure(snap6d(state, "import", case))
    assert snap6d(state, "import", case, "--depth-scale", "1").returncode == 0


def test_who_is_there_already_gets_another_link(snap6d, state):
    snap6d(state, "user", "add", "ann", "--role", "reviewer")
    printed = snap6d(state, "user", "link", "ann").stdout.splitlines()
    assert printed[0] == "User ann may sign in, once, with this link:"
    database = opened(state)
    auth = Auth(database)
    identity = auth.identify_session(auth.sign_in_with_link(printed[1].split("#")[1]))
    assert identity is not None and identity.role == Role.REVIEWER
    database.close()
    assert failure(snap6d(state, "user", "link", "bob")) == "there is no user 'bob'"


def test_a_public_address_is_in_the_link(snap6d, state):
    printed = snap6d(state, "user", "add", "ann", SNAP6D_PUBLIC_URL="https://snap.example/").stdout
    assert "https://snap.example/sign-in#" in printed


@pytest.mark.parametrize(
    ("variables", "expected"),
    [
        ({"SNAP6D_PORT": "70000"}, "setting port (SNAP6D_PORT) is '70000': Input should be less than"),
        ({"SNAP6D_PORT": "http"}, "setting port (SNAP6D_PORT) is 'http': Input should be a valid integer"),
        ({"SNAP6D_WORKERS": "0"}, "setting workers (SNAP6D_WORKERS) is '0': Input should be greater than"),
    ],
)
def test_a_setting_out_of_range_is_named(snap6d, tmp_path, variables, expected):
    assert failure(snap6d(tmp_path, "migrate", **variables)).startswith(expected)


def test_a_flag_out_of_range_is_named(snap6d, tmp_path):
    message = failure(snap6d(tmp_path, "serve", "--workers", "1000"))
    assert message.startswith("setting workers (SNAP6D_WORKERS) is 1000: ")


@pytest.mark.slow
def test_an_empty_database_is_said(snap6d, tmp_path):
    message = "the database is empty; run `snap6d migrate` first"
    for command in (["import", "."], ["export", "x", "y"], ["token", "create", "x"], ["user", "add", "x"]):
        assert failure(snap6d(tmp_path, *command)) == message


@pytest.mark.slow
def test_a_newer_database_is_said(snap6d, state):
    connection = sqlite3.connect(state / "snap6d.sqlite")
    connection.execute("UPDATE alembic_version SET version_num = '9999'")
    connection.commit()
    connection.close()
    for run, command in (
        (snap6d, ["migrate"]),
        (run_snap6d, ["serve", "--port", "0"]),
        (run_snap6d, ["serve", "--port", "0", "--prepare"]),
    ):
        message = failure(run(state, *command))
        assert message == "the database was made by a newer Snap6D (revision 9999); update Snap6D to open it"


def test_another_database_may_be_given(snap6d, tmp_path):
    url = f"sqlite:///{tmp_path / 'elsewhere.sqlite'}"
    assert snap6d(tmp_path / "state", "migrate", SNAP6D_DATABASE_URL=url).returncode == 0
    assert (tmp_path / "elsewhere.sqlite").exists()
    assert not (tmp_path / "state/snap6d.sqlite").exists()
    wrong = snap6d(tmp_path / "state", "migrate", SNAP6D_DATABASE_URL="nonsense")
    assert "no SQLAlchemy address" in failure(wrong)


@pytest.mark.slow
def test_export_writes_a_zip_or_says_why_not(snap6d, tmp_path, demo):
    site = make_site(tmp_path)
    import_dataset(site.database, FileStore(tmp_path / "files"), demo)
    target = tmp_path / "out.zip"
    message = failure(snap6d(tmp_path, "export", "nothing", str(target)))
    assert message == "there is no dataset 'nothing'; there are: Two boxes / v1, tools"
    assert "no submitted registration" in failure(snap6d(tmp_path, "export", "tools", str(target)))
    assert not target.exists()
    site.submit_all()
    site.database.close()
    done = snap6d(tmp_path, "export", "Two boxes / v1", str(target))
    assert done.returncode == 0, done.stderr
    assert "6 poses in 7 images of 2 scenes, read back and found right" in done.stdout
    with zipfile.ZipFile(target) as archive:
        assert archive.testzip() is None


def test_without_a_command_there_is_help(snap6d, tmp_path):
    helped = snap6d(tmp_path)
    assert "serve" in helped.stdout + helped.stderr and "Traceback" not in helped.stderr
