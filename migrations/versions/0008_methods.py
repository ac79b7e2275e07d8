"""A task says what its snaps are computed with unless somebody chooses; an offline snap, what it was."""

import sqlalchemy as sa
from alembic import op

revision = "0008"
down_revision = "0005"


def upgrade() -> None:
    """Apply."""
    for table in ("tasks", "offline_snaps"):
        op.add_column(table, sa.Column("method", sa.String(20), nullable=False, server_default="default"))
