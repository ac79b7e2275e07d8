"""The 3-D views: everything that knows viser."""
