"""How fast, big and reliable the running application is, and how well snaps register: `python -m benchmarks`."""
