"""Registrations out of the database, with all that belongs to them."""

from sqlalchemy import select
from sqlalchemy.orm import joinedload

from app.database import Database
from app.tables import Registration, Scene, Task


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
