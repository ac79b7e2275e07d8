"""The sessions that are open now."""
