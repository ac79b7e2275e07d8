# mypy: allow-untyped-defs
"""Telling hypotheses apart: distinct modes, symmetric twins, groups that are one mode."""

import numpy as np
from numba import njit
from numpy.typing import NDArray

from registration_core.geometry.kernels import FAST, Array32, f4, squared_angle

BUCKETS = 4096
"""Of the grid in which neighbours are looked up; a power of two."""


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
    count = _distinct(poses, order, f4(niche_translation), f4(niche_rotation), chosen)
    return chosen[:count]


@njit(**FAST)
def _distinct(poses, order, niche_translation, niche_rotation, chosen):
    """Only what lies in the same cell of a grid of `niche_translation`, or in one beside it, can be nearer
    than that: each bucket holds a list of the chosen ones in it.
    """
    per_translation, per_rotation = f4(1) / niche_translation, niche_rotation**-2
    newest = np.full(BUCKETS, -1, np.int32)
    older = np.empty(chosen.shape[0], np.int32)
    count = 0
    for candidate in order:
        T = poses[candidate]
        i = int(np.floor(T[0, 3] * per_translation))
        j = int(np.floor(T[1, 3] * per_translation))
        k = int(np.floor(T[2, 3] * per_translation))
        if _is_in_a_niche(T, i, j, k, poses, chosen, newest, older, per_translation**2, per_rotation):
            continue
        bucket = _bucket(i, j, k)
        chosen[count], older[count], newest[bucket] = candidate, newest[bucket], count
        count += 1
        if count == chosen.shape[0]:
            break
    return count


@njit(**FAST)
def _is_in_a_niche(T, i, j, k, poses, chosen, newest, older, per_translation, per_rotation):
    for di in range(-1, 2):
        for dj in range(-1, 2):
            for dk in range(-1, 2):
                n = newest[_bucket(i + di, j + dj, k + dk)]
                while n >= 0:
                    other = poses[chosen[n]]
                    x, y, z = T[0, 3] - other[0, 3], T[1, 3] - other[1, 3], T[2, 3] - other[2, 3]
                    apart = (x * x + y * y + z * z) * per_translation
                    if apart < f4(1) and apart + squared_angle(T, other) * per_rotation < f4(1):
                        return True
                    n = older[n]
    return False


@njit(**FAST, inline="always")
def _bucket(i, j, k):
    return (i * 73856093 ^ j * 19349663 ^ k * 83492791) & (BUCKETS - 1)


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
