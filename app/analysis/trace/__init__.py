"""Logs as poses over time."""
