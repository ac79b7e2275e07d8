# mypy: allow-untyped-defs
"""Telling hypotheses apart: distinct modes, symmetric twins, groups that are one mode."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.kernels import FAST, Array32, f4, squared_angle


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
    for candidate in order:
        A = poses[candidate]
        free = True
        for k in range(count):
            B = poses[chosen[k]]
            dx, dy, dz = A[0, 3] - B[0, 3], A[1, 3] - B[1, 3], A[2, 3] - B[2, 3]
            d = (dx * dx + dy * dy + dz * dz) * per_translation
            if d < f4(1) and d + squared_angle(A, B) * per_rotation < f4(1):
                free = False
                break
        if free:
            chosen[count] = candidate
            count += 1
            if count == chosen.shape[0]:
                break
    return count


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
