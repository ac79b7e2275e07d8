"""Who may do what, and who did it: in rows, logs and requests."""

from enum import StrEnum


class Role(StrEnum):
    """What a user may do; each role may do all that the ones before it may.

    A participant does the tasks of one study and knows of nothing else.
    """

    PARTICIPANT = "participant"
    OPERATOR = "operator"
    REVIEWER = "reviewer"
    ADMIN = "admin"

    def includes(self, other: "Role") -> bool:
        """Whether this role may do what `other` may."""
        order = list(Role)
        return order.index(self) >= order.index(other)


class Actor(StrEnum):
    """Who acted, as the log marks it."""

    HUMAN = "human"
    SCRIPT = "script"
    MACHINE = "machine"
