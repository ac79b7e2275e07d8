"""Where an object is moved, and how that is recorded and undone."""
