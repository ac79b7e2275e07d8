"""What is known of a scene beside the object that is sought."""

from dataclasses import dataclass

import numpy as np
from numpy.typing import NDArray

from registration_core import ObjectModel

Array = NDArray[np.float64]


@dataclass(frozen=True, eq=False)
class KnownObject:
    """Another thing of the scene, whose pose is done: it is not what a snap looks for, and hides that."""

    registration_id: int
    object_id: int
    T_world_object: Array
    model: ObjectModel
