"""The object of a session: its mesh stays, its symmetries may be changed while the session is open."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core import ObjectModel
from registration_core.symmetry.pose_equivalence import SamePose, same_pose_of

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class PresentObject:
    """The object as it is known at one moment."""

    model: ObjectModel
    symmetries_version: int
    same_pose: SamePose


class SessionObject:
    """What snaps, and whatever compares poses, ask for the object whenever they need it."""

    def __init__(self, model: ObjectModel, symmetries_version: int) -> None:
        self.renew(model, symmetries_version)

    def renew(self, model: ObjectModel, symmetries_version: int) -> None:
        """Go on with another version of its symmetries; a snap under way keeps the one it began with."""
        self.present = PresentObject(model, symmetries_version, same_pose_of(model))

    def same_pose(self, T_a: Array, T_b: Array) -> bool:
        """Whether two poses T_world_object (4, 4) are one, as far as anybody could tell."""
        return self.present.same_pose(T_a, T_b)
