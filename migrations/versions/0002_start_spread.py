"""An estimate keeps how far off its start was said to be; those before were made with no such word."""

import sqlalchemy as sa
from alembic import op

revision = "0002"
down_revision = "0001"


def upgrade() -> None:
    """Apply."""
    # In place: a table copied by a batch would lose the triggers that keep it append-only.
    op.add_column("estimates", sa.Column("start_spread", sa.JSON(none_as_null=True), nullable=True))
