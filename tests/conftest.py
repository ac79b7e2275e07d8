"""Fixtures that every test may use."""

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)  # machines may be busy; speed belongs in benchmarks
settings.load_profile("untimed")

REPOSITORY = Path(__file__).resolve().parents[1]

SLOW_FIXTURES = frozenset({"cluster", "server", "postgres_server", "shared_data", "shared_cases"})
"""What takes workers, a server, a database server or real data; `./scripts/test fast` leaves it out."""
SLOW_FOLDERS = frozenset({"benchmarks", "e2e"})
SLOW_PARAMETER = "postgresql"
"""With which a test takes a database server, though none of its fixtures says so."""


def pytest_collection_modifyitems(items: list[pytest.Item]) -> None:
    """Mark what is slow by what it needs; what computes long is marked where it stands."""
    for item in items:
        folder = item.path.relative_to(REPOSITORY / "tests").parts[0]
        takes_slow = SLOW_FIXTURES.intersection(getattr(item, "fixturenames", ()))
        if folder in SLOW_FOLDERS or takes_slow or SLOW_PARAMETER in item.name.partition("[")[2]:
            item.add_marker(pytest.mark.slow)


@pytest.fixture(scope="session")
def shared_data() -> Path:
    """Real RGB-D scenes that lie beside the repository; tests that need them are skipped without."""
    return _beside("data")


@pytest.fixture(scope="session")
def shared_cases() -> Path:
    """Small datasets that people reported problems with, beside the repository, as the scenes are."""
    return _beside("cases")


def _beside(name: str) -> Path:
    folder = REPOSITORY.parent / "shared" / name
    if not folder.is_dir():
        pytest.skip(f"needs {folder}")
    return folder
