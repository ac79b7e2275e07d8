"""What is to be thought of an estimate: how far off it may be, and how sure is sure enough."""
