"""Datasets keep what looked odd at import, objects a texture, exports their choice and what failed."""

import sqlalchemy as sa
from alembic import op

revision = "0011"
down_revision = "0009"


def upgrade() -> None:
    """Apply."""
    op.add_column(
        "datasets",
        sa.Column("warnings", sa.JSON(none_as_null=True), nullable=False, server_default=sa.text("'[]'")),
    )
    op.add_column(
        "exports",
        sa.Column(
            "choice",
            sa.JSON(none_as_null=True),
            nullable=False,
            server_default=sa.text("""'{"scene_ids": null, "without": []}'"""),
        ),
    )
    op.add_column(
        "exports",
        sa.Column("failures", sa.JSON(none_as_null=True), nullable=False, server_default=sa.text("'[]'")),
    )
    op.add_column("objects", sa.Column("texture_hash", sa.String(64), nullable=True))
