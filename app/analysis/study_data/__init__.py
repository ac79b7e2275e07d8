"""The trials of a study, and the ground truth that they are measured against."""
