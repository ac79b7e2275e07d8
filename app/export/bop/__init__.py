"""Writes a dataset in the form of BOP, with its interaction log."""
