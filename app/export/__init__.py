"""Datasets out of the database: written, read back and checked, packed."""
