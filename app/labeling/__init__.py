"""One operator's work on one object: its state, its 3-D view, and the door to that view."""
