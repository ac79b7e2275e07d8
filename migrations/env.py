"""How alembic reaches the database: through the connection that `app.storage.database` hands over."""

from alembic import context

from app.storage.tables import Base

connection = context.config.attributes.get("connection")
if connection is None:
    raise SystemExit("run migrations with `snap6d migrate`, which knows the database")
context.configure(connection=connection, target_metadata=Base.metadata, render_as_batch=True)
with context.begin_transaction():
    context.run_migrations()
