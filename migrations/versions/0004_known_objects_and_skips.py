"""An estimate keeps which objects the snap knew, a registration why it was skipped."""

import sqlalchemy as sa
from alembic import op

revision = "0004"
down_revision = "0003"


def upgrade() -> None:
    """Apply."""
    # In place: a table copied by a batch would lose the triggers that keep it append-only.
    op.add_column("estimates", sa.Column("known_objects", sa.JSON(none_as_null=True), nullable=True))
    op.add_column("registrations", sa.Column("skip_reason", sa.String(20), nullable=True))
