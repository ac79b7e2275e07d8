"""Trials as figures beside what they have to reach."""

from collections.abc import Iterable, Sequence

import numpy as np

from benchmarks.figures import Figure, Target
from benchmarks.registration.instances import (
    BUNNY,
    HALF,
    HIDDEN,
    INEXACT,
    MORO,
    PLAIN,
    REAL,
    SENSORS,
    SETS,
    SYNTHETIC,
    YCB,
)
from benchmarks.registration.methods import DEFAULT, PEERS, PROTOTYPE, TOLD
from benchmarks.registration.starts import FAR, FARTHEST, GOOD, MIDDLE, SHELLS, Shell
from benchmarks.registration.statistics import auroc, calibration_error, false_accepts, percentiles
from benchmarks.registration.trials import InstanceTrials, Trial
from registration_core import acceptance

OF_A_SENSOR = dict(zip(SHELLS, (99.0, 96.0, 93.0), strict=False))
RIGHT = {
    HALF: dict(zip(SHELLS, (100.0, 97.5, 96.2, 93.6), strict=True)),
    HIDDEN: dict(zip(SHELLS, (97.8, 93.3, 81.3, 74.2), strict=True)),
    **dict.fromkeys((*SENSORS, INEXACT), OF_A_SENSOR),
    YCB: {MIDDLE: 98.0, FAR: 95.0},
    MORO: dict(zip(SHELLS, (98.0, 90.0, 70.0), strict=False)),
}
"""Percent of starts from which ADD(-S) ends below 10 % of the diameter."""
EXACT = {BUNNY: {MIDDLE: 100.0, FARTHEST: 95.0}}
"""The same for an MSSD below 5 %."""
OF_THE_NOISE_LIMIT = dict(zip(SHELLS, (99.0, 98.0, 94.0, 88.0), strict=True))
"""Percent of what the polish from the truth reaches, within 2 mm and 2 degrees."""
SMALLER_ROTATION = Target(98.0, at_least=True)
MADE_WORSE = Target(0.5)
AUROC, CALIBRATION, FALSE_ACCEPTS = Target(95.0, at_least=True), Target(5.0), Target(3.0)
RISK = 0.02
"""Share of wrong poses among those that are accepted."""
WRONG_ACCEPTED, ACCEPTED = Target(100 * RISK), Target(75.0, at_least=True)
NOT_BEHIND, AS_FAST, FASTER = Target(0.0, at_least=True), Target(100.0), Target(0.6)
DOUBT, STEADY = 0.5, Target(2.0)
"""A snap of less confidence was in doubt, and searched for long; the slowest of those may take so many times
their median."""


def figures(results: Sequence[InstanceTrials]) -> list[Figure]:
    """All that the trials tell of the default, as it is when nobody says how far off the start is."""
    trials = [trial for result in results for trial in result.trials]
    default = [trial for trial in trials if trial.method == DEFAULT]
    return [
        *_successes(default, RIGHT, "ADD(-S) < 10 %", "is_right"),
        *_ambiguities(default),
        *_truths(results),
        *_successes(default, EXACT, "MSSD < 5 %", "is_exact"),
        *_noise_limit(results),
        *_rotations(default),
        *_made_worse(trials),
        *_peers(trials),
        *_times(trials),
        *_confidences(default),
        *_acceptance(default),
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


def _truths(results: Sequence[InstanceTrials]) -> Iterable[Figure]:
    """How often the polish that starts at the truth ends elsewhere: hardly anything does better by depth."""
    for set_name in REAL:
        own = [one for one in results if one.trials and one.trials[0].set_name == set_name]
        if own:
            name = f"{set_name}, the truth, polished on the depth, has an MSSD >= 5 %, of all"
            yield Figure(name, _percent([not one.polish_error.is_exact for one in own]), "%")


def _noise_limit(results: Sequence[InstanceTrials]) -> Iterable[Figure]:
    plain = [result for result in results if result.trials and result.trials[0].set_name in PLAIN]
    if not plain:
        return
    limit = _percent([result.polish_error.is_close for result in plain])
    yield Figure("the demo's sensor, within 2 mm and 2°, polish from the truth", limit, "%")
    trials = [trial for result in plain for trial in result.trials if trial.method == DEFAULT]
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
    for set_name in SETS:
        for peer in PEERS:
            pairs = [
                _pairs([t for t in trials if (t.set_name, t.shell) == (set_name, shell)], peer)
                for shell in SHELLS
            ]
            leads = [
                _percent([ours.error.is_right for ours, _ in own])
                - _percent([theirs.error.is_right for _, theirs in own])
                for own in pairs
                if own
            ]
            if leads:
                lead = f"{set_name}, successes minus those of {peer}, in the worst shell"
                yield Figure(lead, min(leads), "%", NOT_BEHIND)
            if leads and peer != PROTOTYPE:  # whose time all real sets together are compared with
                slowest = max(_time_ratio(own) for own in pairs if own)
                time = f"{set_name}, median time of that of {peer}, in the worst shell"
                yield Figure(time, 100 * slowest, "%", AS_FAST)


def _times(trials: Sequence[Trial]) -> Iterable[Figure]:
    """Against the prototype in the same run, and how long a snap searches that is in doubt."""
    for title, sets in (("synthetic", SYNTHETIC), ("real", REAL)):
        own = [trial for trial in trials if trial.set_name in sets and trial.shell in SHELLS]
        if pairs := _pairs(own, PROTOTYPE):
            name = f"{title}, median time of a default snap, of that of the {PROTOTYPE}"
            yield Figure(name, _time_ratio(pairs), "times", FASTER)
        doubtful = [t.seconds for t in own if t.method == DEFAULT and t.claim < DOUBT]
        if doubtful:
            median, p95 = percentiles(doubtful)
            yield Figure(f"{title}, p95 of snaps in doubt, of their median", p95 / median, "times", STEADY)


def _pairs(trials: Sequence[Trial], peer: str) -> list[tuple[Trial, Trial]]:
    """The default and a peer from the same starts."""
    by_start = {(t.instance, t.shell, t.start): t for t in trials if t.method == DEFAULT}
    theirs = [t for t in trials if t.method == peer and (t.instance, t.shell, t.start) in by_start]
    return [(by_start[t.instance, t.shell, t.start], t) for t in theirs]


def _time_ratio(pairs: Sequence[tuple[Trial, Trial]]) -> float:
    ours, theirs = zip(*pairs, strict=True)
    return _median_seconds(ours) / _median_seconds(theirs)


def _confidences(trials: Sequence[Trial]) -> Iterable[Figure]:
    for set_name in SETS:
        own = [trial for trial in trials if trial.set_name == set_name and trial.shell != GOOD]
        exact = [trial.error.is_exact for trial in own]
        if not own:
            continue
        claims = [trial.claim for trial in own]
        name = f"confidence, {set_name}"
        yield Figure(f"{name}, calibration error", 100 * calibration_error(claims, exact), "%", CALIBRATION)
        if any(exact) and not all(exact):
            accepted = 100 * false_accepts(claims, exact)
            yield Figure(f"{name}, AUROC", 100 * auroc(claims, exact), "%", AUROC)
            yield Figure(f"{name}, wrong accepted with 90 % of the good", accepted, "%", FALSE_ACCEPTS)


def _acceptance(trials: Sequence[Trial]) -> Iterable[Figure]:
    """What the threshold that is given for a risk accepts."""
    threshold = acceptance(RISK)
    own = [trial for trial in trials if trial.set_name in REAL and trial.shell == MIDDLE]
    if not own:
        return
    accepted = [trial for trial in own if trial.claim >= threshold]
    where = f"acceptance({RISK}), real, from {MIDDLE}"
    yield Figure(f"{where}, accepted", 100 * len(accepted) / len(own), "%", ACCEPTED)
    if accepted:
        wrong = _percent([not trial.error.is_exact for trial in accepted])
        yield Figure(f"{where}, wrong among them", wrong, "%", WRONG_ACCEPTED)


def _percent(flags: Sequence[bool]) -> float:
    return 100.0 * float(np.mean(flags))


def _median_seconds(trials: Sequence[Trial]) -> float:
    return percentiles([trial.seconds for trial in trials])[0]
