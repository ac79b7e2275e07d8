"""The particle filter of the paper."""
