"""Fixtures that every test may use."""

from pathlib import Path

import pytest
from hypothesis import settings

settings.register_profile("untimed", deadline=None)  # machines may be busy; speed belongs in benchmarks
settings.load_profile("untimed")

REPOSITORY = Path(__file__).resolve().parents[1]


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
