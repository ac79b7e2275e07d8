"""An estimate keeps what depth could not tell; of those before that is not known."""

import sqlalchemy as sa
from alembic import op

revision = "0003"
down_revision = "0002"


def upgrade() -> None:
    """Apply."""
    # In place: a table copied by a batch would lose the triggers that keep it append-only.
    op.add_column("estimates", sa.Column("ambiguities", sa.JSON(none_as_null=True), nullable=True))
