"""Snaps from every pose that operators passed through, computed afterwards."""
