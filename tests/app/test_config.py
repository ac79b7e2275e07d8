"""Settings: defaults, the environment, and what is out of range."""

import pytest
from pydantic import ValidationError

import app.config
from app.config import Settings
from tests.conftest import REPOSITORY


def test_everything_has_a_default(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)  # no .env here
    settings = Settings()
    assert (settings.host, settings.port, settings.workers) == ("127.0.0.1", 8000, 2)
    assert settings.state_dir == REPOSITORY / "state"
    assert settings.scheduler_address == settings.database_url == settings.public_url == ""


def test_an_installed_snap6d_keeps_its_state_in_a_folder_of_whoever_runs_it(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setattr(app.config, "CHECKOUT", None)
    monkeypatch.setenv("XDG_DATA_HOME", str(tmp_path / "data"))
    assert Settings().state_dir == tmp_path / "data" / "snap6d"
    monkeypatch.setenv("SNAP6D_STATE_DIR", str(tmp_path / "told"))
    assert Settings().state_dir == tmp_path / "told"


def test_the_environment_changes_it_and_arguments_go_before(monkeypatch, tmp_path):
    monkeypatch.chdir(tmp_path)
    monkeypatch.setenv("SNAP6D_PORT", "9000")
    monkeypatch.setenv("SNAP6D_WORKERS", "5")
    (tmp_path / ".env").write_text("SNAP6D_WORKERS=6\nSNAP6D_HOST=0.0.0.0\nOTHER=1\n")
    settings = Settings(port=9001)
    assert (settings.host, settings.port, settings.workers) == ("0.0.0.0", 9001, 5)


def test_the_database_lies_in_the_state_directory_unless_told(tmp_path, monkeypatch):
    monkeypatch.chdir(tmp_path)
    relative = Settings(state_dir="here")
    assert relative.resolved_database_url == f"sqlite:///{tmp_path / 'here' / 'snap6d.sqlite'}"
    told = Settings(state_dir=tmp_path, database_url="postgresql+psycopg://db/snap6d")
    assert told.resolved_database_url == "postgresql+psycopg://db/snap6d"
    assert told.files_dir == tmp_path / "files" and told.prepared_dir == tmp_path / "prepared"


@pytest.mark.parametrize(
    ("name", "value"),
    [("port", -1), ("port", 65536), ("port", "http"), ("workers", 0), ("workers", 257), ("max_upload_mb", 0)],
)
def test_what_is_out_of_range_is_refused_by_name(name, value):
    with pytest.raises(ValidationError, match=name):
        Settings(**{name: value})
