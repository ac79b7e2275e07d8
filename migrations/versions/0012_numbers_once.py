"""The number of a registration is given once, also after it was erased."""

from alembic import op

revision = "0012"
down_revision = "0011"


def upgrade() -> None:
    """Apply; only SQLite gives a number again, and has to copy the table for it."""
    if op.get_bind().dialect.name == "sqlite":
        with op.batch_alter_table(
            "registrations", recreate="always", table_kwargs={"sqlite_autoincrement": True}
        ):
            pass
