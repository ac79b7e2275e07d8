"""Symmetries of meshes: found, and made into a model's."""
