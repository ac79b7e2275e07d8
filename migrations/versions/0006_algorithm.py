"""What computed an estimate or an offline snap, by the hash of its sources."""

import sqlalchemy as sa
from alembic import op

revision = "0006"
down_revision = "0008"


def upgrade() -> None:
    """Apply."""
    op.add_column("estimates", sa.Column("algorithm", sa.String(length=12), nullable=True))
    op.add_column("offline_snaps", sa.Column("algorithm", sa.String(length=12), nullable=True))
