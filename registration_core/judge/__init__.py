"""Decides between candidates, and how sure that is."""
