"""Logs of registrations, made up."""

from tests.app.analysis.hand_made import Entry, at, moved, view

NEARER = (0.07, 0.045, 0.03, 0.02, 0.012, 0.006)
"""Metres from the world's origin that each move comes to; the turn shrinks along."""


def log_of(seconds_a_move: float, end: float) -> list[Entry]:
    """Moves at even times, then submitted `end` metres off."""
    poses = [at(x, 8.0 * x) for x in (*NEARER, end)]
    moves = [moved(1.0 + seconds_a_move * i, "set_pose", T) for i, T in enumerate(poses, start=1)]
    return [Entry(0.0, "opened"), view(1.0, 0.0), *moves, moved(moves[-1].seconds, "submit", poses[-1])]
