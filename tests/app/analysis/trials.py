"""Trials made by hand."""

from collections.abc import Sequence

import numpy as np

from app.analysis.study_data.trial import Snapped, TrialTrace
from app.analysis.trace.pose_errors import PoseErrors
from app.storage.tables import Method

NAN = float("nan")


def trial(
    translation: Sequence[float],
    rotation: Sequence[float] | None = None,
    stg_translation: Sequence[float] | None = None,
    stg_rotation: Sequence[float] | None = None,
    paper_translation: Sequence[float] | None = None,
    paper_rotation: Sequence[float] | None = None,
    operator: str = "P1",
    group: str = "novice",
    mode: str = "accurate",
    condition: str = "manual",
    registration_id: int = 1,
    scene: str = "table",
    idle_seconds: float = 0.0,
    is_simulated: bool = False,
) -> TrialTrace:
    """Errors in metres and radians, half a second apart; all idle time is at the start."""
    count = len(translation)
    seconds = 0.5 * np.arange(count, dtype=np.float64)
    none = [NAN] * count
    snaps: tuple[tuple[Method, Sequence[float] | None, Sequence[float] | None], ...] = (
        ("default", stg_translation, stg_rotation),
        ("paper", paper_translation, paper_rotation),
    )

    def errors(*kinds: Sequence[float] | None) -> PoseErrors:
        return PoseErrors(*(np.array(kind if kind is not None else none, dtype=float) for kind in kinds))

    return TrialTrace(
        registration_id=registration_id,
        operator=operator,
        group=group,
        mode=mode,
        condition=condition,
        scene=scene,
        object="mug",
        instance=0,
        is_simulated=is_simulated,
        seconds=seconds,
        active_seconds=np.maximum(0.0, seconds - idle_seconds),
        idle=(seconds > 0) & (seconds < idle_seconds),
        errors=errors(translation, rotation if rotation is not None else [0.0] * count),
        stg={
            method: Snapped(errors(shifts, turns if turns is not None else shifts), np.ones(count, bool))
            for method, shifts, turns in snaps
            if shifts is not None
        },
    )
