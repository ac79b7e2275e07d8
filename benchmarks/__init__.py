"""How fast, how big and how reliable the running application is: `python -m benchmarks`."""
