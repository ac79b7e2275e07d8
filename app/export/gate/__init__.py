"""Reads an export back and compares it with the database before anybody gets it."""
