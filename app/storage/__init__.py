"""The database, its append-only log, and the files."""
