"""Versions of an object's symmetries, of which each estimate names one, and suggested axes."""

import sqlalchemy as sa
from alembic import op

revision = "0007"
down_revision = "0006"


def upgrade() -> None:
    """Apply."""
    op.create_table(
        "symmetry_versions",
        sa.Column("id", sa.Integer(), nullable=False),
        sa.Column("object_id", sa.Integer(), nullable=False),
        sa.Column("version", sa.Integer(), nullable=False),
        sa.Column("symmetries", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("axes", sa.JSON(none_as_null=True), nullable=True),
        sa.Column("restores", sa.Integer(), nullable=True),
        sa.Column("user_id", sa.Integer(), nullable=True),
        sa.Column("utc", sa.DateTime(timezone=True), nullable=False),
        sa.ForeignKeyConstraint(["object_id"], ["objects.id"]),
        sa.ForeignKeyConstraint(["user_id"], ["users.id"]),
        sa.PrimaryKeyConstraint("id"),
        sa.UniqueConstraint("object_id", "version"),
    )
    op.create_table(
        "symmetry_suggestions",
        sa.Column("mesh_hash", sa.String(length=64), nullable=False),
        sa.Column("suggestions", sa.JSON(none_as_null=True), nullable=False),
        sa.Column("utc", sa.DateTime(timezone=True), nullable=False),
        sa.PrimaryKeyConstraint("mesh_hash"),
    )
    op.add_column(
        "objects", sa.Column("symmetries_version", sa.Integer(), nullable=False, server_default="1")
    )
    op.add_column(
        "objects", sa.Column("suggestions_open", sa.Boolean(), nullable=False, server_default=sa.false())
    )
    op.add_column("estimates", sa.Column("symmetries_version", sa.Integer(), nullable=True))
    op.execute(
        "INSERT INTO symmetry_versions (object_id, version, symmetries, utc)"
        " SELECT objects.id, 1, objects.symmetries, datasets.created_at"
        " FROM objects JOIN datasets ON datasets.id = objects.dataset_id ORDER BY objects.id"
    )
    _refuse_changes("symmetry_versions")


def _refuse_changes(table: str) -> None:
    if op.get_bind().dialect.name == "sqlite":
        for action in ("UPDATE", "DELETE"):
            op.execute(
                f"CREATE TRIGGER {table}_no_{action.lower()} BEFORE {action} ON {table} "
                f"BEGIN SELECT RAISE(ABORT, '{table} is append-only'); END"
            )
        return
    op.execute(
        f"CREATE FUNCTION {table}_append_only() RETURNS trigger LANGUAGE plpgsql AS "
        f"$$ BEGIN RAISE EXCEPTION '{table} is append-only'; END $$"
    )
    op.execute(
        f"CREATE TRIGGER {table}_append_only BEFORE UPDATE OR DELETE OR TRUNCATE ON {table} "
        f"FOR EACH STATEMENT EXECUTE FUNCTION {table}_append_only()"
    )
