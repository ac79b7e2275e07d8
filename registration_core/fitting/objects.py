"""Known objects for fitting, made in code: the shapes that people register, none of them from a benchmark."""

from collections.abc import Callable, Mapping

import numpy as np
import trimesh
from numpy.typing import ArrayLike, NDArray
from scipy.spatial.transform import Rotation

from registration_core.geometry import pose
from registration_core.geometry.object_model import Symmetries, discrete
from registration_core.synthetic.objects import AROUND_Z, ProceduralObject, centred
from registration_core.synthetic.shapes import (
    arc,
    joined,
    moved,
    painted,
    rounded_box,
    shifted,
    surface,
    swept,
    turned,
)

Array = NDArray[np.float64]

GREY = (150, 150, 150)
CELL = 0.0025
"""Edge of the cells that cut parts are made of, metres."""
HALF_TURNS = discrete([pose.exp([0.0, 0.0, 0.0, *np.pi * axis]).round(12) for axis in np.eye(3)])


def random_object(kind: str, seed: int) -> ProceduralObject:
    """One object of a kind of KINDS; the same for the same seed."""
    rng = np.random.default_rng([seed, sorted(KINDS).index(kind)])
    mesh, symmetries = KINDS[kind](rng)
    return ProceduralObject(f"{kind} {seed}", centred([mesh]), symmetries)


def carton(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A box with three different edges."""
    size = rng.permutation([rng.uniform(0.025, 0.05), rng.uniform(0.06, 0.09), rng.uniform(0.1, 0.19)])
    return rounded_box(size.tolist(), rng.uniform(0.001, 0.005), GREY), HALF_TURNS


def can(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A tin with a sunken lid; it can also stand on its head, nearly, but not quite."""
    radius, height, rim = rng.uniform(0.028, 0.052), rng.uniform(0.05, 0.14), rng.uniform(0.002, 0.005)
    outside = turned([(0, 0), (radius, 0), (radius, height), (radius - 0.002, height)], GREY)
    return joined(
        [outside, turned([(radius - 0.002, height), (radius - 0.002, height - rim), (0, height - rim)], GREY)]
    ), AROUND_Z


def bottle(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A bottle with a shoulder; half of them with a spout that breaks the symmetry."""
    radius, height, neck = rng.uniform(0.025, 0.045), rng.uniform(0.13, 0.22), rng.uniform(0.009, 0.016)
    shoulder = rng.uniform(0.55, 0.8) * height
    profile = [(0, 0), (radius, 0), (radius * rng.uniform(0.8, 1.0), shoulder / 2), (radius, shoulder)]
    body = turned([*profile, (neck, 0.85 * height), (neck, height), (0, height)], GREY)
    if rng.random() < 0.5:
        return body, AROUND_Z
    spout = shifted(rounded_box((0.05, 0.018, 0.016), 0.003, GREY), 0.012, 0.0, height)
    return joined([body, spout]), Symmetries()


def bowl(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A bowl, or a cup without a handle, open to the top."""
    foot, top, height = rng.uniform(0.02, 0.04), rng.uniform(0.04, 0.085), rng.uniform(0.035, 0.11)
    bend = rng.uniform(0.3, 1.0)
    levels = np.linspace(0.0, 1.0, 12)
    outer = np.stack([foot + (top - foot) * levels**bend, height * levels], axis=1)
    inner = outer[::-1] - [0.003, 0.0]
    inner[-1] = (inner[-1, 0], 0.004)
    parts: list[ArrayLike] = [
        [(0, 0), (foot, 0)],
        outer,
        [tuple(outer[-1]), tuple(inner[0])],
        inner,
        [tuple(inner[-1]), (0, 0.004)],
    ]
    return joined([turned(part, GREY) for part in parts]), AROUND_Z


def mug(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A cup with a handle."""
    radius, height, wall = rng.uniform(0.034, 0.048), rng.uniform(0.07, 0.11), 0.0035
    cup = turned([(0, 0), (radius, 0), (radius, height), (radius - wall, height)], GREY)
    inside = turned([(radius - wall, height), (radius - wall, 0.006), (0, 0.006)], GREY)
    bow = arc((radius - 0.002, height / 2), (rng.uniform(0.022, 0.034), 0.33 * height), -85, 85, 16)
    return joined([cup, inside, swept(bow, (0.005, 0.008), GREY, 12)]), Symmetries()


def power_tool(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A barrel with a grip and a foot."""
    length, radius, drop = rng.uniform(0.11, 0.17), rng.uniform(0.02, 0.03), rng.uniform(0.07, 0.12)
    along_x = pose.exp([0.0, 0.0, 0.0, 0.0, np.pi / 2.0, 0.0])
    nose = [(0.6 * radius, 0.35 * length), (0.2 * radius, length / 2), (0, length / 2)]
    barrel = turned([(0, -length / 2), (radius, -length / 2), (radius, 0.2 * length), *nose], GREY, 28)
    lean = rng.uniform(0.0, 0.03)
    grip = swept([(-0.02, 0), (-0.02 - lean, -drop)], (0.019, 0.016), GREY, 16)
    foot = shifted(rounded_box((0.085, 0.055, 0.03), 0.004, GREY), -0.015 - lean, 0.0, -drop)
    return joined([moved(barrel, along_x), grip, foot]), Symmetries()


def cut_part(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A flat printed or milled part with an irregular outline, pockets and through holes."""
    columns, rows = rng.integers(24, 44), rng.integers(20, 36)
    x, y = np.meshgrid(np.arange(columns), np.arange(rows), indexing="ij")
    height = np.full((columns, rows), rng.uniform(0.01, 0.025))
    for _ in range(rng.integers(1, 4)):  # corners cut off
        normal, offset = rng.normal(size=2), rng.uniform(0.25, 0.45)
        height[(x / columns - 0.5) * normal[0] + (y / rows - 0.5) * normal[1] > offset] = 0.0
    if rng.random() < 0.7:  # a notch out of one side
        a, b = np.sort(rng.uniform(0.1, 0.9, 2)) * columns
        height[(x > a) & (x < b) & (y > rng.uniform(0.55, 0.85) * rows)] = 0.0
    for _ in range(rng.integers(1, 4)):  # pockets
        c, r = rng.uniform(0.2, 0.7) * columns, rng.uniform(0.2, 0.7) * rows
        w, h = rng.uniform(0.15, 0.45, 2) * (columns, rows)
        pocket = (x > c) & (x < min(c + w, columns - 2)) & (y > r) & (y < min(r + h, rows - 2))
        height[pocket] = np.minimum(height[pocket], rng.uniform(0.2, 0.8) * height.max())
    for _ in range(rng.integers(0, 4)):  # through holes
        c, r, radius = (
            rng.uniform(0.15, 0.85) * columns,
            rng.uniform(0.15, 0.85) * rows,
            rng.uniform(1.0, 3.0),
        )
        height[(x - c) ** 2 + (y - r) ** 2 < radius**2] = 0.0
    return built_of_cells(height), Symmetries()


def gear(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A gear wheel with a hub and a bore; its fold is its number of teeth."""
    teeth, outer, depth = int(rng.integers(8, 15)), rng.uniform(0.03, 0.05), rng.uniform(0.12, 0.2)
    steps = 8 * teeth
    angles = 2.0 * np.pi * np.arange(steps) / steps
    radius = outer * (1.0 - depth * ((np.arange(steps) % 8) < 4))
    thickness, bore = rng.uniform(0.008, 0.02), rng.uniform(0.15, 0.3) * outer
    ring = np.stack([np.cos(angles), np.sin(angles)], axis=1)
    flat = np.concatenate([ring * radius[:, None], np.zeros((steps, 1))], axis=1)
    hole = np.concatenate([ring * bore, np.zeros((steps, 1))], axis=1)
    up = np.array([0.0, 0.0, thickness])
    rings = np.stack([hole, flat, flat + up, hole + up, hole])
    hub = turned(
        [(bore, thickness), (1.6 * bore, thickness), (1.6 * bore, 1.6 * thickness), (bore, 1.6 * thickness)],
        GREY,
    )
    turns = [pose.exp([0, 0, 0, 0, 0, 2.0 * np.pi * k / teeth]) for k in range(1, teeth)]
    return joined([painted(surface(rings), GREY), hub]), discrete(turns)


def bolt(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A large bolt or shaft with steps, and a square head."""
    radius, length = rng.uniform(0.006, 0.014), rng.uniform(0.07, 0.14)
    shaft = turned(
        [
            (0, 0),
            (radius, 0),
            (radius, 0.6 * length),
            (1.25 * radius, 0.6 * length),
            (1.25 * radius, length),
            (0, length),
        ],
        GREY,
        24,
    )
    head = rng.uniform(3.2, 4.5) * radius
    quarter_turns = [pose.exp([0, 0, 0, 0, 0, k * np.pi / 2]).round(12) for k in (1, 2, 3)]
    block = shifted(rounded_box((head, head, 0.9 * radius + 0.004), 0.001, GREY), 0.0, 0.0, length)
    return joined([shaft, block]), discrete(quarter_turns)


def figure(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """An organic shape: a ball with bumps of many sizes."""
    ball = trimesh.creation.icosphere(subdivisions=4)
    directions = np.asarray(ball.vertices)
    reach = np.ones(len(directions))
    for scale, size in ((1.5, 0.35), (3.0, 0.2), (6.0, 0.08)):
        for _ in range(4):
            axis, phase = scale * rng.normal(size=3), rng.uniform(0.0, 2.0 * np.pi)
            reach += size / 2.0 * np.sin(directions @ axis + phase)
    ball.vertices = directions * np.maximum(reach, 0.3)[:, None] * rng.uniform(0.03, 0.06, 3)
    return painted(ball, GREY), Symmetries()


def bent_fruit(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A banana, or a bent hose."""
    path = arc((0.0, 0.0), (rng.uniform(0.05, 0.1), rng.uniform(0.05, 0.1)), 10, rng.uniform(90, 150), 18)
    thick = rng.uniform(0.011, 0.019)
    widths = thick * (0.35 + 0.65 * np.sin(np.linspace(0.25, np.pi - 0.15, 18)))
    lie_down = pose.exp([0.0, 0.0, 0.0, np.pi / 2.0, 0.0, 0.0])
    return moved(
        swept(path, np.stack([widths, widths * rng.uniform(0.8, 1.0)], axis=1), GREY, 16), lie_down
    ), Symmetries()


def pliers(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """Two thin arms that cross: pliers, scissors, a clamp."""
    length, thin = rng.uniform(0.12, 0.19), rng.uniform(0.004, 0.008)
    lie_down = pose.exp([0.0, 0.0, 0.0, np.pi / 2.0, 0.0, 0.0])
    arms = []
    for sign in (-1, 1):
        spread = sign * rng.uniform(0.015, 0.035)
        path = [
            (-length / 2, spread),
            (-0.2 * length, 0.8 * spread),
            (0.1 * length, 0),
            (length / 2, -0.4 * spread),
        ]
        arms.append(swept(path, (thin * rng.uniform(0.7, 1.5), thin), GREY, 12))
    return moved(joined(arms), lie_down), Symmetries()


def hand_tool(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A hammer, a brush: a handle with a head across."""
    length, thick = rng.uniform(0.13, 0.2), rng.uniform(0.007, 0.013)
    along_x = pose.exp([0.0, 0.0, 0.0, 0.0, np.pi / 2.0, 0.0])
    handle = moved(turned([(0, 0), (thick, 0), (0.8 * thick, length), (0, length)], GREY, 20), along_x)
    head = rounded_box(
        (rng.uniform(0.02, 0.035), rng.uniform(0.06, 0.1), rng.uniform(0.02, 0.035)), 0.003, GREY
    )
    return joined([handle, shifted(head, length, rng.uniform(-0.015, 0.015), 0.0)]), Symmetries()


def bracket(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """Plates at right angles, with a rib."""
    width, long, tall = rng.uniform(0.03, 0.07), rng.uniform(0.06, 0.11), rng.uniform(0.04, 0.09)
    thick = rng.uniform(0.005, 0.011)
    base = shifted(rounded_box((long, width, thick), 0.001, GREY), long / 2, 0.0, thick / 2)
    wall = shifted(rounded_box((thick, width, tall), 0.001, GREY), thick / 2, 0.0, tall / 2)
    rib = shifted(
        rounded_box((0.5 * long, thick, 0.5 * tall), 0.001, GREY),
        0.25 * long,
        rng.uniform(-0.3, 0.3) * width,
        0.25 * tall,
    )
    return joined([base, wall, rib]), Symmetries()


def assembly(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A few blocks and cylinders stuck together: housings, connectors, toys."""
    parts = [rounded_box(rng.uniform(0.03, 0.08, 3).tolist(), 0.002, GREY)]
    for _ in range(rng.integers(2, 5)):
        if rng.random() < 0.5:
            part = rounded_box(rng.uniform(0.015, 0.05, 3).tolist(), 0.002, GREY)
        else:
            radius, height = rng.uniform(0.008, 0.025), rng.uniform(0.02, 0.06)
            part = turned(
                [(0, -height / 2), (radius, -height / 2), (radius, height / 2), (0, height / 2)], GREY, 24
            )
            lie = Rotation.from_euler("x", 90 * rng.integers(2), degrees=True).as_matrix()
            part = moved(part, pose.from_rotation_translation(lie, np.zeros(3)))
        parts.append(shifted(part, *rng.uniform(-0.04, 0.04, 3)))
    return joined(parts), Symmetries()


def cube(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A cube: 24 rotations take it onto itself."""
    edge = rng.uniform(0.04, 0.09)
    rotations = Rotation.create_group("O").as_matrix()
    others = [
        pose.from_rotation_translation(R.round(12), np.zeros(3)) for R in rotations if np.trace(R) < 2.9
    ]
    return rounded_box((edge, edge, edge), rng.uniform(0.0005, 0.004), GREY), discrete(others)


def dish(rng: np.random.Generator) -> tuple[trimesh.Trimesh, Symmetries]:
    """A block with two steps and a slot: juice boxes, soap, housings that are nearly boxes."""
    length, width, height = rng.uniform(0.08, 0.15), rng.uniform(0.04, 0.07), rng.uniform(0.03, 0.06)
    body = rounded_box((length, width, height), 0.003, GREY)
    step = shifted(
        rounded_box((0.4 * length, 0.7 * width, 0.4 * height), 0.002, GREY),
        0.25 * length,
        0.1 * width,
        0.5 * height,
    )
    return joined([body, step]), Symmetries()


def built_of_cells(height: Array) -> trimesh.Trimesh:
    """A solid on z = 0 whose top has the height (C, R) of each cell, metres; 0 is no cell."""
    columns, rows = height.shape
    wide = np.pad(height, 1)
    quads: list[Array] = []
    for c in range(columns):
        for r in range(rows):
            top = wide[c + 1, r + 1]
            if top <= 0.0:
                continue
            x, y = CELL * np.array([c, c + 1, c + 1, c]), CELL * np.array([r, r, r + 1, r + 1])
            quads.append(np.stack([x, y, np.full(4, top)], axis=1))
            quads.append(np.stack([x, y, np.zeros(4)], axis=1)[::-1])
            for k, (dc, dr) in enumerate(((0, -1), (1, 0), (0, 1), (-1, 0))):
                beside = wide[c + 1 + dc, r + 1 + dr]
                if beside < top:
                    i, j = k, (k + 1) % 4
                    low, high = beside, top
                    quads.append(
                        np.array(
                            [[x[i], y[i], low], [x[j], y[j], low], [x[j], y[j], high], [x[i], y[i], high]]
                        )
                    )
    vertices = np.concatenate(quads)
    first = 4 * np.arange(len(quads))[:, None]
    faces = np.concatenate([first + np.array([0, 1, 2]), first + np.array([0, 2, 3])])
    mesh = trimesh.Trimesh(vertices, faces, process=False)
    mesh.merge_vertices(digits_vertex=6)
    return painted(mesh, GREY)


KINDS: Mapping[str, Callable[[np.random.Generator], tuple[trimesh.Trimesh, Symmetries]]] = {
    maker.__name__: maker
    for maker in (
        carton, can, bottle, bowl, mug, power_tool, cut_part, gear, bolt, figure, bent_fruit, pliers,
        hand_tool, bracket, assembly, cube, dish,
    )
}  # fmt: skip
