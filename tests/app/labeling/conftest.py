"""Somebody at work."""

import pytest

from app.auth import Identity
from app.labeling.seat import Seat
from app.services import Services
from tests.app.labeling.bench import Bench
from tests.app.labeling.seats import sign_up


@pytest.fixture
def ann(services: Services) -> Identity:
    return sign_up(services, "ann")


@pytest.fixture
def seat(services: Services, ann: Identity) -> Seat:
    """Ann before the first task: the angle tool of scene 1."""
    return services.desk.start(1, ann)


@pytest.fixture
def bench() -> Bench:
    """A session whose log and workers the test holds."""
    return Bench()
