"""What a server does when it starts."""

import pytest

from app.services import Services
from app.storage.unfinished import PREFIX, unfinished
from tests.app.live import running_server
from tests.app.waiting import wait_until


def test_what_killed_programs_left_unfinished_goes_and_what_others_are_at_stays(services: Services) -> None:
    settings = services.settings
    settings.prepared_dir.mkdir(exist_ok=True)
    folders = (settings.state_dir, settings.files_dir, settings.prepared_dir)
    for folder in folders:
        (folder / f"{PREFIX}killed").mkdir()
        (folder / f"{PREFIX}killed" / "half").write_bytes(b"half")
    with unfinished(settings.files_dir) as at_work, running_server(services):
        left = [path for folder in folders for path in folder.glob(f"{PREFIX}*")]
        assert left == [at_work]


def test_memory_is_given_back_once_the_threads_of_closed_views_have_ended(
    services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    happened: list[str] = []
    results = iter([0, 2, 0, 0])

    def close_idle() -> int:
        closed = next(results, 0)
        happened.append(f"closed {closed}")
        return closed

    monkeypatch.setattr("app.main.SECONDS_BETWEEN_CLEANINGS", 0.01)
    monkeypatch.setattr("app.main.give_back", lambda: happened.append("given back"))
    monkeypatch.setattr(services.live_sessions, "close_idle", close_idle)
    with running_server(services):
        wait_until(lambda: len(happened) >= 6, "some cleanings")
    assert happened[:6] == ["closed 0", "closed 2", "closed 0", "given back", "closed 0", "closed 0"]


def test_closing_of_idle_sessions_goes_on_after_it_failed(
    services: Services, monkeypatch: pytest.MonkeyPatch
) -> None:
    calls: list[None] = []

    def close_idle() -> int:
        calls.append(None)
        raise OSError("the disk is full")

    monkeypatch.setattr("app.main.SECONDS_BETWEEN_CLEANINGS", 0.01)
    monkeypatch.setattr(services.live_sessions, "close_idle", close_idle)
    with running_server(services):
        wait_until(lambda: len(calls) >= 3, "further tries")
