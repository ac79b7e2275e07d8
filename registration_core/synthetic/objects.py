"""The demo's five known objects and its distractors, made in code."""

from collections.abc import Sequence
from dataclasses import dataclass, field
from functools import cached_property

import numpy as np
import trimesh
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.object_model import ContinuousSymmetry, ObjectModel, Symmetries, discrete
from registration_core.synthetic.shapes import (
    Color,
    arc,
    joined,
    moved,
    painted,
    rounded_box,
    shifted,
    swept,
    turned,
)

ORANGE, CHARCOAL, STEEL, RED = (233, 124, 32), (52, 55, 60), (168, 172, 178), (196, 43, 40)
TEAL, CREAM, WHITE, NAVY = (38, 132, 140), (240, 230, 208), (236, 238, 240), (35, 62, 110)
GREEN, LEAF, YELLOW, BLUE = (44, 110, 72), (124, 168, 74), (240, 190, 62), (58, 116, 186)

DISTRACTOR_COLORS: tuple[Color, ...] = (
    (205, 92, 74), (96, 128, 168), (214, 178, 110), (126, 150, 110), (150, 112, 150), (118, 104, 96)
)  # fmt: skip

AROUND_Z = Symmetries(continuous=(ContinuousSymmetry((0.0, 0.0, 1.0)),))


@dataclass(frozen=True, eq=False)
class ProceduralObject:
    """A mesh with vertex colours, metres, z up as it stands, its bounding box centred on the origin."""

    name: str
    mesh: trimesh.Trimesh
    symmetries: Symmetries = field(default_factory=Symmetries)

    @cached_property
    def model(self) -> ObjectModel:
        """Its geometry."""
        return ObjectModel(
            np.asarray(self.mesh.vertices, dtype=np.float64),
            np.asarray(self.mesh.faces, dtype=np.int32),
            self.symmetries,
        )


def demo_objects() -> tuple[ProceduralObject, ...]:
    """Drill, mug, bottle, bowl and box."""
    half_turns = [pose.exp([0.0, 0.0, 0.0, *np.pi * axis]) for axis in np.eye(3)]
    return (
        ProceduralObject("drill", centred(drill_parts())),
        ProceduralObject("mug", centred(mug_parts())),
        ProceduralObject("bottle", centred(bottle_parts()), AROUND_Z),
        ProceduralObject("bowl", centred(bowl_parts()), AROUND_Z),
        ProceduralObject("box", centred([labelled_box()]), discrete([T.round(12) for T in half_turns])),
    )


def centred(parts: Sequence[trimesh.Trimesh]) -> trimesh.Trimesh:
    """One mesh of all parts, moved so that its bounding box is centred."""
    mesh = joined(parts)
    mesh.apply_translation(-mesh.bounds.mean(axis=0))
    return mesh


def drill_parts() -> list[trimesh.Trimesh]:
    """A cordless drill, pointing along x, that stands on its battery."""
    along_x = pose.exp([0.0, 0.0, 0.0, 0.0, np.pi / 2.0, 0.0])
    housing = [(0.0, -0.085), *arc((0.014, -0.075), (0.012, 0.010), -90, 0, 6), (0.027, -0.06)]
    housing += [(0.029, -0.03), (0.029, 0.025), (0.026, 0.045)]
    barrel = [
        turned(housing, ORANGE, 40),
        turned([(0.026, 0.045), (0.023, 0.05), (0.023, 0.056)], CHARCOAL, 40),
        turned([(0.023, 0.056), (0.019, 0.057)], CHARCOAL, 40),
        turned([(0.019, 0.057), (0.0195, 0.075), (0.017, 0.082)], CHARCOAL, 40),
        turned([(0.017, 0.082), (0.008, 0.096)], STEEL, 40),
        turned([(0.008, 0.096), (0.0, 0.097)], STEEL, 40),
        turned([(0.0035, 0.09), (0.0035, 0.122), (0.0, 0.128)], STEEL, 12),
    ]
    grip_path = [(-0.028, -0.01), (-0.031, -0.035), (-0.036, -0.06), (-0.042, -0.085), (-0.045, -0.108)]
    grip_widths = [(0.023, 0.019), (0.021, 0.0175), (0.020, 0.017), (0.021, 0.0175), (0.025, 0.020)]
    return [
        *(moved(part, along_x) for part in barrel),
        swept(grip_path, grip_widths, CHARCOAL, 28),
        shifted(rounded_box((0.014, 0.014, 0.026), 0.004, RED), -0.006, 0.0, -0.043),
        shifted(rounded_box((0.094, 0.062, 0.022), 0.006, ORANGE), -0.026, 0.0, -0.116),
        shifted(rounded_box((0.100, 0.066, 0.026), 0.007, CHARCOAL), -0.024, 0.0, -0.139),
        shifted(rounded_box((0.034, 0.010, 0.018), 0.004, CHARCOAL), -0.022, 0.030, 0.006),
    ]


def mug_parts() -> list[trimesh.Trimesh]:
    """A mug with a handle towards x."""
    outer = [(0.034, 0.0), *arc((0.034, 0.006), (0.006, 0.006), -60, 0, 4), (0.041, 0.030)]
    rim = [(0.0425, 0.094), *arc((0.0407, 0.0945), (0.0018, 0.0018), 0, 180, 7), (0.0389, 0.094)]
    inner = [(0.0389, 0.094), (0.0372, 0.015), *arc((0.030, 0.012), (0.007, 0.007), 0, -90, 5), (0.0, 0.005)]
    handle = arc((0.040, 0.050), (0.030, 0.029), -80, 80, 22)
    return [
        turned([(0.0, 0.002), (0.030, 0.002), (0.034, 0.0)], CREAM),
        turned(outer, TEAL),
        turned([(0.041, 0.030), (0.0415, 0.055)], TEAL),
        turned([(0.0415, 0.055), (0.0417, 0.066)], CREAM),
        turned([(0.0417, 0.066), (0.0425, 0.094)], TEAL),
        turned(rim, CREAM),
        turned(inner, CREAM),
        swept(handle, (0.0045, 0.0075), TEAL),
    ]


def bottle_parts() -> list[trimesh.Trimesh]:
    """A bottle with a label and a cap."""
    shoulder = [
        (0.034, 0.128),
        (0.0335, 0.138),
        (0.031, 0.150),
        (0.026, 0.162),
        (0.019, 0.172),
        (0.0145, 0.182),
    ]
    return [
        turned([(0.0, 0.004), (0.022, 0.003), (0.029, 0.0)], GREEN),
        turned([(0.029, 0.0), *arc((0.028, 0.006), (0.006, 0.006), -70, 0, 5), (0.034, 0.035)], GREEN),
        turned([(0.034, 0.035), (0.034, 0.050)], LEAF),
        turned([(0.034, 0.050), (0.034, 0.100)], CREAM),
        turned([(0.034, 0.100), (0.034, 0.106)], LEAF),
        turned([(0.034, 0.106), *shoulder, (0.0135, 0.198)], GREEN),
        turned([(0.0135, 0.194), (0.0158, 0.194)], RED),
        turned([(0.0158, 0.194), (0.0158, 0.212), (0.0145, 0.2145)], RED),
        turned([(0.0145, 0.2145), (0.0, 0.2155)], RED),
    ]


def bowl_parts() -> list[trimesh.Trimesh]:
    """A bowl, blue outside and cream inside."""
    outer = arc((0.036, 0.060), (0.041, 0.052), -90, 0, 16)
    inner = [*arc((0.034, 0.060), (0.040, 0.046), 0, -90, 16), (0.0, 0.013)]
    return [
        turned([(0.0, 0.003), (0.030, 0.003), (0.033, 0.0)], NAVY),
        turned([(0.033, 0.0), (0.036, 0.0)], NAVY),
        turned([(0.036, 0.0), (0.036, 0.008)], NAVY),
        turned(outer, BLUE),
        turned(arc((0.0755, 0.060), (0.0015, 0.0015), 0, 180, 7), CREAM),
        turned(inner, CREAM),
    ]


def labelled_box() -> trimesh.Trimesh:
    """A carton with coloured bands and a round-cornered label on its front and back."""
    blend = 0.0004
    edges_y, edges_z = (0.036,), (0.052, 0.040, 0.012, -0.046)
    cuts_y = [sign * edge + step for edge in edges_y for sign in (-1, 1) for step in (-blend, blend)]
    cuts_z = [edge + step for edge in edges_z for step in (-blend, blend)]
    box = rounded_box((0.048, 0.104, 0.150), 0.003, YELLOW, ((), cuts_y, cuts_z))
    _, y, z = box.vertices.T
    on_label = np.abs(y) < 0.036
    paint: list[tuple[NDArray[np.bool_], Color]] = [
        ((z < 0.052) & (z > 0.040), RED),
        (z < -0.046, RED),
        (on_label & (z < 0.012) & (z > -0.046), WHITE),
    ]
    for where, color in paint:
        box.visual.vertex_colors[where] = [*color, 255]
    return box


def random_distractor(rng: np.random.Generator) -> ProceduralObject:
    """A plain block, can, ball, cone or book in a muted colour; nobody knows its pose."""
    color = DISTRACTOR_COLORS[rng.integers(len(DISTRACTOR_COLORS))]
    kind = ("block", "can", "ball", "cone", "book")[rng.integers(5)]
    if kind == "block":
        mesh = rounded_box(rng.uniform(0.03, 0.09, 3).tolist(), 0.003, color)
    elif kind == "book":
        mesh = rounded_box((rng.uniform(0.12, 0.17), rng.uniform(0.09, 0.12), 0.022), 0.002, color)
    elif kind == "ball":
        mesh = painted(trimesh.creation.icosphere(subdivisions=4, radius=rng.uniform(0.025, 0.04)), color)
    elif kind == "cone":
        radius, height = rng.uniform(0.025, 0.04), rng.uniform(0.06, 0.11)
        mesh = joined([turned([(0, 0), (radius, 0)], color), turned([(radius, 0), (0.004, height)], color)])
    else:
        radius, height = rng.uniform(0.025, 0.045), rng.uniform(0.05, 0.12)
        lid = turned([(radius, height), (0, height)], STEEL)
        foot = turned([(0, 0), (radius, 0)], STEEL)
        mesh = joined([foot, turned([(radius, 0), (radius, height)], color), lid])
    return ProceduralObject(kind, centred([mesh]))
