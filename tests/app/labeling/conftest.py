"""A session whose log and workers a test holds."""

import pytest

from tests.app.labeling.bench import Bench


@pytest.fixture
def bench() -> Bench:
    """A session whose log and workers the test holds."""
    return Bench()
