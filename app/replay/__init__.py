"""Registrations played back from their logs."""
