"""Trials as figures beside what they have to reach."""

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.registration.instances import BUNNY, HALF, HIDDEN, REAL, SETS, SYNTHETIC, YCB
from benchmarks.registration.methods import DEFAULT, PEERS, TOLD
from benchmarks.registration.starts import FAR, FARTHEST, GOOD, MIDDLE, SHELLS, Shell
from benchmarks.registration.statistics import auroc, calibration_error, false_accepts, percentiles
from benchmarks.registration.trials import InstanceTrials, Trial

RIGHT = {
    HALF: dict(zip(SHELLS, (99.5, 99.0, 96.0, 90.0), strict=True)),
    HIDDEN: dict(zip(SHELLS, (97.0, 95.0, 88.0, 75.0), strict=True)),
    YCB: {MIDDLE: 98.0, FAR: 95.0},
}
"""Percent of starts from which ADD(-S) ends below 10 % of the diameter."""
EXACT = {BUNNY: {MIDDLE: 100.0, FARTHEST: 95.0}}
"""The same for an MSSD below 5 %."""
OF_THE_NOISE_LIMIT = dict(zip(SHELLS, (99.0, 98.0, 94.0, 88.0), strict=True))
"""Percent of what the polish from the truth reaches, within 2 mm and 2 degrees."""
SMALLER_ROTATION = Target(98.0, at_least=True)
MADE_WORSE = Target(0.5)
AUROC, CALIBRATION, FALSE_ACCEPTS = Target(95.0, at_least=True), Target(5.0), Target(1.0)
NOT_BEHIND, AS_FAST = Target(0.0, at_least=True), Target(100.0)


def figures(results: Sequence[InstanceTrials]) -> list[Figure]:
    """All that the trials tell of the default, as it is when nobody says how far off the start is."""
    trials = [trial for result in results for trial in result.trials]
    default = [trial for trial in trials if trial.method == DEFAULT]
    return [
        *_successes(default, RIGHT, "ADD(-S) < 10 %", "is_right"),
        *_ambiguities(default),
        *_successes(default, EXACT, "MSSD < 5 %", "is_exact"),
        *_noise_limit(results),
        *_rotations(default),
        *_made_worse(trials),
        *_peers(trials),
        *_confidences(default),
    ]


def _successes(
    trials: Iterable[Trial], targets: dict[str, dict[Shell, float]], measure: str, flag: str
) -> Iterable[Figure]:
    trials = list(trials)
    for set_name, shells in targets.items():
        for shell, percent in shells.items():
            rights = [getattr(t.error, flag) for t in trials if (t.set_name, t.shell) == (set_name, shell)]
            if rights:
                name = f"{set_name}, {measure}, from {shell}"
                yield Figure(name, _percent(rights), "%", Target(percent, at_least=True))


def _ambiguities(trials: Sequence[Trial]) -> Iterable[Figure]:
    for set_name in SETS:
        elsewhere = [t.fits_elsewhere for t in trials if t.set_name == set_name and t.shell != GOOD]
        if elsewhere:
            name = f"{set_name}, wrong though depth fits as well as at the truth, of all"
            yield Figure(name, _percent(elsewhere), "%")


def _noise_limit(results: Sequence[InstanceTrials]) -> Iterable[Figure]:
    synthetic = [result for result in results if result.trials[0].set_name in SYNTHETIC]
    if not synthetic:
        return
    limit = _percent([result.polish_error.is_close for result in synthetic])
    yield Figure("synthetic, within 2 mm and 2°, polish from the truth", limit, "%")
    trials = [trial for result in synthetic for trial in result.trials if trial.method == DEFAULT]
    for shell, percent in OF_THE_NOISE_LIMIT.items():
        close = [trial.error.is_close for trial in trials if trial.shell == shell]
        if close and limit > 0:
            name = f"the same from {shell}, share of that"
            yield Figure(name, 100 * _percent(close) / limit, "%", Target(percent, at_least=True))


def _rotations(trials: Sequence[Trial]) -> Iterable[Figure]:
    for set_name in SETS:
        smaller = [
            trial.error.rotation < trial.start_error.rotation
            for trial in trials
            if (trial.set_name, trial.shell) == (set_name, MIDDLE)
        ]
        if smaller:
            name = f"{set_name}, rotation error smaller than at the start, from {MIDDLE}"
            yield Figure(name, _percent(smaller), "%", SMALLER_ROTATION)


def _made_worse(trials: Sequence[Trial]) -> Iterable[Figure]:
    for set_name in SETS:
        for method in (DEFAULT, TOLD):
            worse = [
                trial.error.is_worse_than_good
                for trial in trials
                if (trial.set_name, trial.method, trial.shell) == (set_name, method, GOOD)
            ]
            if worse:
                target = MADE_WORSE if set_name not in REAL else None  # their truth is no better than that
                yield Figure(f"{set_name}, {method}, good poses made worse", _percent(worse), "%", target)


def _peers(trials: Sequence[Trial]) -> Iterable[Figure]:
    """From the starts that both had, in the shell where the lead is least, and where the time is most."""
    by_start = {(t.instance, t.shell, t.start, t.method): t for t in trials}
    for set_name in SETS:
        for peer in PEERS:
            leads, shares = [], []
            for shell in SHELLS:
                theirs = [
                    t
                    for t in trials
                    if (t.set_name, t.shell, t.method) == (set_name, shell, peer)
                    and (t.instance, t.shell, t.start, DEFAULT) in by_start
                ]
                ours = [by_start[t.instance, t.shell, t.start, DEFAULT] for t in theirs]
                if theirs:
                    leads.append(
                        _percent([t.error.is_right for t in ours])
                        - _percent([t.error.is_right for t in theirs])
                    )
                    shares.append(_median_seconds(ours) / _median_seconds(theirs))
            if leads:
                lead = f"{set_name}, successes minus those of {peer}, in the worst shell"
                time = f"{set_name}, median time of that of {peer}, in the worst shell"
                yield Figure(lead, min(leads), "%", NOT_BEHIND)
                yield Figure(time, 100 * max(shares), "%", AS_FAST)


def _confidences(trials: Sequence[Trial]) -> Iterable[Figure]:
    for title, sets in (("synthetic", SYNTHETIC), ("real", REAL)):
        own = [trial for trial in trials if trial.set_name in sets and trial.shell != GOOD]
        exact = [trial.error.is_exact for trial in own]
        if not any(exact) or all(exact):
            continue
        claims = [trial.confidence for trial in own]
        accepted = 100 * false_accepts(claims, exact)
        error = 100 * calibration_error(claims, exact)
        yield Figure(f"confidence, {title}, AUROC", 100 * auroc(claims, exact), "%", AUROC)
        yield Figure(f"confidence, {title}, calibration error", error, "%", CALIBRATION)
        yield Figure(
            f"confidence, {title}, wrong accepted with 90 % of the good", accepted, "%", FALSE_ACCEPTS
        )


def _percent(flags: Sequence[bool]) -> float:
    return 100.0 * float(np.mean(flags))


def _median_seconds(trials: Sequence[Trial]) -> float:
    return percentiles([trial.seconds for trial in trials])[0]
