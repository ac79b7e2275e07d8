"""An estimate keeps the frames that it was found in, and what others say of it."""

import sqlalchemy as sa
from alembic import op

revision = "0009"
down_revision = "0010"


def upgrade() -> None:
    """Apply."""
    # In place: a table copied by a batch would lose the triggers that keep it append-only.
    for name in ("used_frames", "other_frames"):
        op.add_column("estimates", sa.Column(name, sa.JSON(none_as_null=True), nullable=True))
