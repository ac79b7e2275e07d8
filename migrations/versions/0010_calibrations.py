"""A dataset's own calibration and risk; an estimate keeps its certificates and what was thought of it."""

import sqlalchemy as sa
from alembic import op

revision = "0010"
down_revision = "0007"


def upgrade() -> None:
    """Apply."""
    op.create_table(
        "calibrations",
        sa.Column("id", sa.Integer, primary_key=True),
        sa.Column("dataset_id", sa.Integer, sa.ForeignKey("datasets.id"), nullable=False, unique=True),
        sa.Column("algorithm", sa.String(12), nullable=False),
        sa.Column("stretch", sa.Float, nullable=False),
        sa.Column("shift", sa.Float, nullable=False),
        sa.Column("confidences", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("right", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("gains", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("created_at", sa.DateTime(timezone=True), nullable=False),
    )
    op.add_column("datasets", sa.Column("risk", sa.Float, nullable=True))
    # In place: a table copied by a batch would lose the triggers that keep it append-only.
    op.add_column("estimates", sa.Column("certificates", sa.JSON(none_as_null=True), nullable=True))
    op.add_column("estimates", sa.Column("assessment", sa.JSON(none_as_null=True), nullable=True))
