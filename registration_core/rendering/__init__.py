"""Depth and colour images of objects, and comparisons with measured depth."""
