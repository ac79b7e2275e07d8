"""What depth cannot tell about a pose, in words: about which axis, how far, and as what it is drawn."""

from collections.abc import Sequence
from typing import Literal, Protocol

import numpy as np
from numpy.typing import ArrayLike, NDArray
from scipy.special import ndtri  # that of `scipy.stats`, whose import takes half a second

Array = NDArray[np.float64]
Kind = Literal["other mode", "free motion"]
Motion = Literal["turn", "shift"]

SHARE = 0.95
"""Of the belief that lies within what is told."""
REACH_ALONG = float(ndtri(0.5 + SHARE / 2.0))
"""Standard deviations, along one axis."""
ANY_TURN = np.radians(120.0)
"""A free turn that reaches so far to either side may as well be any."""
LEAST_DIFFERENT = 1.1
"""Ratio of two sides of the bounding box from which on one can be told to be the longer."""
ALONG = np.cos(np.radians(20.0))
"""Cosine from which on an axis is that of a side of the box."""


class Told(Protocol):
    """What has to be known of a motion that depth cannot tell from none."""

    @property
    def kind(self) -> Kind: ...
    @property
    def motion(self) -> Motion: ...
    @property
    def extent(self) -> float:
        """Radians or metres: where another mode lies, or how far to either side a free motion reaches."""
        ...


def reach(kind: str, motion: str, extent: float) -> float:
    """How far a motion goes, from what an estimate says: of free motions, standard deviations."""
    far = extent * REACH_ALONG if kind == "free motion" else extent
    return min(far, np.pi) if motion == "turn" else far


def axis_name(axis: ArrayLike, sides: Array) -> str:
    """Names an axis (3,) of an object by the sides (3,) of its bounding box, metres."""
    along = np.abs(np.asarray(axis))
    side = int(np.argmax(along))
    if along[side] < ALONG:
        return "a slanted axis"
    others = np.delete(sides, side)
    if sides[side] > LEAST_DIFFERENT * others.max():
        return "the long axis"
    if LEAST_DIFFERENT * sides[side] < others.min():
        return "the short axis"
    return f"the {'xyz'[side]} axis"


def amount(told: Told) -> str:
    """How far it goes, as people read it."""
    if told.motion == "turn":
        return f"{np.degrees(told.extent):.0f}°"
    return millimetres(told.extent)


def millimetres(metres: float) -> str:
    """A length as people read it."""
    return f"{1000.0 * metres:.0f} mm"


def names_of_drawn(unknown: Sequence[Told]) -> list[str]:
    """What the motions are called that a view draws: turns are arcs, shifts are lines."""
    shapes = ["arc" if told.motion == "turn" else "line" for told in unknown]
    if len(shapes) == 1:
        return [f"blue {shapes[0]}"]
    return [f"{shape} {number}" for number, shape in enumerate(shapes, start=1)]


def sentence(drawn: str, told: Told, axis: str) -> str:
    """What may be the case, beside the name of what is drawn of it."""
    turns = told.motion == "turn"
    where = f"{'about' if turns else 'along'} {axis}"
    if told.kind == "other mode":
        text = f"{'turned' if turns else 'shifted'} by {amount(told)} {where} it fits as well"
    elif turns and told.extent >= ANY_TURN:
        text = f"it may be turned anywhere {where}"
    else:
        text = f"it may {'be turned' if turns else 'lie'} up to {amount(told)} either way {where}"
    return f"{drawn[0].upper()}{drawn[1:]}: {text}."
