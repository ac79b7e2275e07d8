"""Datasets: imported, and read as arrays, meshes and pictures."""
