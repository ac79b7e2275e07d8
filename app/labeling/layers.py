"""What the 3-D view shows of a scene besides the gizmo, which is always there."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Layers:
    """Each can be put away, so that what it hides is seen."""

    cloud: bool = True
    mesh: bool = True
    texture: bool = True
    """The mesh in its own colours, where it has any; otherwise in the operator's."""
    fine: bool = True
    """All measured points; otherwise a few large ones, which are drawn soon without a graphics card, too."""
    agreement: bool = False
    """The object's surface, coloured by how the depth image agrees with it."""
