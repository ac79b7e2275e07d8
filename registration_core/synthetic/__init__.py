"""Scenes made in code, and what depth sensors make of them."""
