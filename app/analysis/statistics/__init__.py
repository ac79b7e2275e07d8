"""What is computed from trials: curves, fits, intervals and comparisons."""
