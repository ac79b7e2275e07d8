"""Looks for poses that explain what a view shows."""
