"""Studies: their plan, their course, simulated operators, and snaps computed afterwards."""
