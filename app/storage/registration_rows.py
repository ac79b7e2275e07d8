"""Registrations out of the database, with all that belongs to them."""

from sqlalchemy import select
from sqlalchemy.orm import joinedload

from app.storage.database import Database
from app.storage.roles import Role
from app.storage.tables import Registration, Scene, Task


def whole_registration(database: Database, registration_id: int) -> Registration | None:
    """A registration with its task, object, scene and frames."""
    with database.read() as session:
        return session.scalar(
            select(Registration)
            .where(Registration.id == registration_id)
            .options(
                joinedload(Registration.task).joinedload(Task.object),
                joinedload(Registration.task).joinedload(Task.scene).selectinload(Scene.frames),
                joinedload(Registration.task).joinedload(Task.frame),
                joinedload(Registration.user),
            )
        )


def is_trial(registration: Registration) -> bool:
    """Whether a participant of a study does it; its user has to be loaded."""
    return registration.user.role == Role.PARTICIPANT
