"""A part of a study: some groups, modes, conditions, scenes or objects."""

from collections.abc import Sequence
from dataclasses import dataclass, fields, replace

from app.analysis.study_data.collect import Collected
from app.analysis.study_data.trial import TrialTrace


@dataclass(frozen=True)
class Selection:
    """What trials have to have; None lets all through."""

    group: str | None = None
    mode: str | None = None
    condition: str | None = None
    scene: str | None = None
    object: str | None = None

    def of(self, collected: Collected) -> Collected:
        """The part of a study.

        Raises:
            ValueError: naming the field, where a value is none of the study's.
        """
        choices = choices_of(collected)
        trials: Sequence[TrialTrace] = collected.trials
        for name, value in vars(self).items():
            if value is None:
                continue
            if value not in choices[name]:
                there = ", ".join(choices[name]) or "none"
                raise ValueError(f"{name} {value!r} is none of this study; there are: {there}")
            trials = [trial for trial in trials if getattr(trial, name) == value]
        groups = {name: n for name, n in collected.groups.items() if self.group in (None, name)}
        return replace(collected, trials=trials, groups=groups)


def choices_of(collected: Collected) -> dict[str, list[str]]:
    """What can be chosen of each field, in the order of the study."""
    choices = {
        field.name: list(dict.fromkeys(getattr(trial, field.name) for trial in collected.trials))
        for field in fields(Selection)
    }
    return choices | {"group": list(collected.groups)}
