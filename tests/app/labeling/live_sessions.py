"""People before a live session, and what they see of it."""

import numpy as np

from app.access.auth import Identity
from app.labeling.live.live_session import LiveSession
from app.services import Services
from app.storage.roles import Actor, Role
from tests.app.waiting import wait_until


def sign_up(services: Services, name: str, role: Role = Role.OPERATOR) -> Identity:
    user = services.auth.create_user(name, role)
    return Identity(user.id, user.name, role, Actor.HUMAN)


def shown(live_session: LiveSession) -> np.ndarray:
    return live_session.session.snapshot().T_world_object


def wait_for_snap(live_session: LiveSession) -> str:
    def ended() -> str | None:
        snap = live_session.session.snapshot().snap
        return None if snap is None or snap.is_live else snap.state

    return wait_until(ended, "the snap to end")
