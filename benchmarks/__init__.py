"""How fast and reliable the application is, and how well its snaps register: `python -m benchmarks`."""

from pathlib import Path

PROJECT = Path(__file__).resolve().parents[1]
"""The checkout."""
