"""How fast and reliable the application is, and how well its snaps register: `python -m benchmarks`."""
