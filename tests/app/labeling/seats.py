"""People before a live session, and what they see of it."""

import numpy as np

from app.auth import Actor, Identity, Role
from app.labeling.seat import Seat
from app.services import Services
from tests.app.waiting import wait_until


def sign_up(services: Services, name: str, role: Role = Role.OPERATOR) -> Identity:
    user = services.auth.create_user(name, role)
    return Identity(user.id, user.name, role, Actor.HUMAN)


def shown(seat: Seat) -> np.ndarray:
    return seat.session.snapshot().T_world_object


def wait_for_snap(seat: Seat) -> str:
    def ended() -> str | None:
        snap = seat.session.snapshot().snap
        return None if snap is None or snap.is_live else snap.state

    return wait_until(ended, "the snap to end")
