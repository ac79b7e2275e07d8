"""What depth cannot tell, in words that differ."""

import numpy as np
import pytest

from app.confidence.ambiguity_words import axis_name, names_of_drawn, reach, sentence
from app.confidence.uncertainty import UnknownMotion

X = np.array([1.0, 0.0, 0.0])


def unknown(kind, motion, extent) -> UnknownMotion:
    return UnknownMotion(kind, motion, X, extent, "the long axis")


@pytest.mark.parametrize(
    ("told", "expected"),
    [
        (unknown("free motion", "turn", np.pi), "Arc 1: it may be turned anywhere about the long axis."),
        (
            unknown("free motion", "turn", np.radians(27)),
            "Arc 1: it may be turned up to 27° either way about the long axis.",
        ),
        (
            unknown("free motion", "shift", 0.009),
            "Arc 1: it may lie up to 9 mm either way along the long axis.",
        ),
        (unknown("other mode", "turn", np.pi), "Arc 1: turned by 180° about the long axis it fits as well."),
        (
            unknown("other mode", "shift", 0.012),
            "Arc 1: shifted by 12 mm along the long axis it fits as well.",
        ),
    ],
)
def test_a_motion_is_told_beside_what_is_drawn_of_it(told, expected):
    assert sentence("arc 1", told, told.axis_name) == expected


def test_what_is_drawn_has_names_that_differ():
    turn, shift = unknown("free motion", "turn", 1.0), unknown("free motion", "shift", 0.01)
    assert names_of_drawn([turn]) == ["blue arc"]
    assert names_of_drawn([shift]) == ["blue line"]
    assert names_of_drawn([turn, turn, shift]) == ["arc 1", "arc 2", "line 3"]
    assert names_of_drawn([]) == []


def test_free_motions_are_told_at_95_percent():
    assert reach("free motion", "shift", 0.01) == pytest.approx(0.0196, rel=1e-3)
    assert reach("free motion", "turn", 3.0) == np.pi
    assert reach("other mode", "shift", 0.01) == 0.01


def test_axes_are_named_by_the_bounding_box():
    sides = np.array([0.1, 0.2, 0.3])
    names = [axis_name(axis, sides) for axis in ([0, 0, 1], [-1, 0, 0], [0, 1, 0], [0.6, 0.6, 0.52])]
    assert names == ["the long axis", "the short axis", "the y axis", "a slanted axis"]
