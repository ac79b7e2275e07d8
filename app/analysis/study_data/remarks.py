"""What a report has to say beside its numbers: what was left out or handled, and why."""

from dataclasses import dataclass


@dataclass(frozen=True)
class Remark:
    """A sentence about a trial, a participant, an object or a group."""

    about: str
    text: str
    registration_id: int | None = None
    """To look at."""

    def __str__(self) -> str:
        return f"{self.about}: {self.text}."


def counted(number: int, noun: str) -> str:
    """ "1 trial", "2 trials"."""
    return f"{number} {noun}{'' if number == 1 else 's'}"
