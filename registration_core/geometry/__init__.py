"""Poses, cameras, meshes and error measures."""
