# mypy: allow-untyped-defs
"""Telling hypotheses apart: distinct modes, symmetric twins, groups that are one mode."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.kernels import FAST, Array32, f4, squared_angle_of


def distinct(
    poses: Array32, scores: Array32, most: int, niche_translation: float, niche_rotation: float
) -> NDArray[np.intp]:
    """Indices of at most `most` of the poses (N, 3, 4), best first, none in the niche of a better one.

    Args:
        scores: (N,), higher is better.
        niche_translation, niche_rotation: half axes of a niche, metres and radians.
    """
    order = np.argsort(-scores, kind="stable")
    chosen = np.empty(min(most, len(order)), np.intp)
    count = _distinct(poses, order, f4(niche_translation**-2), f4(niche_rotation**-2), chosen)
    return chosen[:count]


@njit(**FAST)
def _distinct(poses, order, per_translation, per_rotation, chosen):
    count = 0
    kept = np.empty((12, chosen.shape[0]), np.float32)
    for candidate in order:
        T = poses[candidate]
        if _distance_to_nearest(T, kept, count, per_translation, per_rotation) < f4(1):
            continue
        for a in range(3):
            for b in range(4):
                kept[4 * a + b, count] = T[a, b]
        chosen[count] = candidate
        count += 1
        if count == chosen.shape[0]:
            break
    return count


@njit(**FAST)
def _distance_to_nearest(T, kept, count, per_translation, per_rotation):
    """Squared distance in niches to the nearest of the first `count` poses kept (12, N), one a column."""
    a0, a1, a2, a3 = T[0, 0], T[0, 1], T[0, 2], T[0, 3]
    b0, b1, b2, b3 = T[1, 0], T[1, 1], T[1, 2], T[1, 3]
    c0, c1, c2, c3 = T[2, 0], T[2, 1], T[2, 2], T[2, 3]
    k0, k1, k2, k3, k4, k5, k6, k7, k8, k9, k10, k11 = kept
    nearest = f4(1e9)
    for k in range(count):
        dx, dy, dz = a3 - k3[k], b3 - k7[k], c3 - k11[k]
        trace = (
            a0 * k0[k] + a1 * k1[k] + a2 * k2[k]
            + b0 * k4[k] + b1 * k5[k] + b2 * k6[k]
            + c0 * k8[k] + c1 * k9[k] + c2 * k10[k]
        )  # fmt: skip
        distance = (dx * dx + dy * dy + dz * dz) * per_translation
        nearest = min(nearest, distance + squared_angle_of(trace) * per_rotation)
    return nearest


@njit(**FAST)
def move_to_nearest_twin(poses, symmetries, start):
    """Replace each of the poses (N, 3, 4) by its symmetric twin whose rotation is nearest to the start's.

    Args:
        symmetries: (S, 3, 4), in the centred frame, identity first.
    """
    twin = np.empty((3, 4), np.float32)
    for i in range(poses.shape[0]):
        T = poses[i]
        # trace(start^T T S) = sum of (T^T start) * S: the larger, the nearer
        best, best_trace = 0, f4(-9)
        relative = np.zeros((3, 3), np.float32)
        for a in range(3):
            for b in range(3):
                for c in range(3):
                    relative[a, b] += T[c, a] * start[c, b]
        for s in range(symmetries.shape[0]):
            trace = f4(0)
            for a in range(3):
                for b in range(3):
                    trace += relative[a, b] * symmetries[s, a, b]
            if trace > best_trace + f4(1e-5):
                best, best_trace = s, trace
        if best == 0:
            continue
        S = symmetries[best]
        for a in range(3):
            for b in range(4):
                twin[a, b] = T[a, 0] * S[0, b] + T[a, 1] * S[1, b] + T[a, 2] * S[2, b]
            twin[a, 3] += T[a, 3]
        T[:] = twin


@njit(**FAST)
def distances(poses, points, symmetries, out):
    """MSSD (N, N) between poses (N, 3, 4): the largest move of any of the points (E, 3), least over
    symmetries.
    """
    moved = np.empty((poses.shape[0], points.shape[0], 3), np.float32)
    for i in range(poses.shape[0]):
        for e in range(points.shape[0]):
            for a in range(3):
                T, p = poses[i], points[e]
                moved[i, e, a] = T[a, 0] * p[0] + T[a, 1] * p[1] + T[a, 2] * p[2] + T[a, 3]
    twin = np.empty((points.shape[0], 3), np.float32)
    for i in range(poses.shape[0]):
        out[i, i] = f4(0)
        out[i, i + 1 :] = f4(1e9)
        for s in range(symmetries.shape[0]):
            S = symmetries[s]
            for e in range(points.shape[0]):
                p = points[e]
                x = S[0, 0] * p[0] + S[0, 1] * p[1] + S[0, 2] * p[2] + S[0, 3]
                y = S[1, 0] * p[0] + S[1, 1] * p[1] + S[1, 2] * p[2] + S[1, 3]
                z = S[2, 0] * p[0] + S[2, 1] * p[1] + S[2, 2] * p[2] + S[2, 3]
                for a in range(3):
                    twin[e, a] = poses[i, a, 0] * x + poses[i, a, 1] * y + poses[i, a, 2] * z + poses[i, a, 3]
            for j in range(i + 1, poses.shape[0]):
                largest = f4(0)
                for e in range(points.shape[0]):
                    dx, dy, dz = (
                        twin[e, 0] - moved[j, e, 0],
                        twin[e, 1] - moved[j, e, 1],
                        twin[e, 2] - moved[j, e, 2],
                    )
                    largest = max(largest, dx * dx + dy * dy + dz * dz)
                    if largest >= out[i, j]:
                        break
                out[i, j] = min(out[i, j], largest)
    for i in range(poses.shape[0]):
        for j in range(i + 1, poses.shape[0]):
            out[i, j] = np.sqrt(out[i, j])
            out[j, i] = out[i, j]
