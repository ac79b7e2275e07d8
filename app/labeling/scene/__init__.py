"""The other objects of a scene, and what its depth says."""
