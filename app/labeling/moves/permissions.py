"""What an operator may use on a task beside the gizmo, undo and the views: its condition says so."""

from collections.abc import Collection
from typing import Literal, get_args

from app.labeling.moves.pose_record import ActionError
from app.storage.tables import Condition, FrameUse, Method

Wanted = FrameUse | tuple[int, ...]
"""The frames that a snap is asked to use; ids name them one by one."""

Tool = Literal[
    "snap",
    "live snap",
    "find it",
    "three points",
    "click-to-place",
    "precision",
    "copy",
    "neighbours",
    "agreement",
    "uncertainty",
    "ending",
]
"""`precision`: steps, lock, numbers, putting down. `neighbours`: what is done of the scene, seen and known
to snaps. `ending`: skipping a task, and reopening what was ended."""

ALL: frozenset[Tool] = frozenset(get_args(Tool))
MACHINES: frozenset[Tool] = frozenset({"snap", "live snap", "find it", "uncertainty"})
ORDINARY: frozenset[Tool] = frozenset({"copy", "neighbours", "agreement", "ending"})
"""Have nothing to do with how an object is placed."""
COMPARED: dict[Condition, frozenset[Tool]] = {
    "manual": frozenset(),
    "snap": frozenset({"snap"}),
    "paper snap": frozenset({"snap"}),
    "auto": frozenset({"snap"}),
    "three points": frozenset({"snap", "three points"}),
    "click-to-place": frozenset({"snap", "click-to-place"}),
    "live snap": frozenset({"snap", "live snap"}),
    "find it": frozenset({"snap", "find it"}),
}
"""In a study, where conditions are compared, each has what it is named after and no more."""

TOOL_OF: dict[str | None, Tool] = {
    "place": "click-to-place",
    "three points": "three points",
    "proposal": "find it",
    "mode": "snap",
    "copy": "copy",
}
"""By the technique that the log names; any other one is `precision`."""


def tools_of(condition: Condition, in_study: bool) -> frozenset[Tool]:
    """What may be used on a task, by its condition and by whether a study's participant does it."""
    if in_study:
        return COMPARED[condition]
    match condition:
        case "manual":
            return ALL - MACHINES
        case "snap" | "auto":
            return ALL
        case technique:
            return COMPARED[technique] | ORDINARY


def methods_of(condition: Condition, in_study: bool, method: Method = "default") -> tuple[Method, ...]:
    """What Snap may compute with on a task; the first until another one is chosen.

    A trial, and a technique that is compared, has one method. Elsewhere the operator chooses; `method` is
    what the task says.
    """
    if condition == "paper snap":
        return ("paper",)
    if in_study or condition not in ("snap", "auto"):
        return ("default",)
    return (method, *(other for other in get_args(Method) if other != method))


def frame_uses_of(condition: Condition, in_study: bool) -> tuple[FrameUse, ...]:
    """The frames that Snap may use on a task; the first until others are chosen.

    A trial, and a technique that is compared, is about the one frame that is shown.
    """
    return ("current",) if in_study or condition not in ("snap", "auto") else ("auto", "current")


def require_frames(choices: Collection[FrameUse], wanted: Wanted) -> None:
    """Raise `ActionError` where Snap may not use these frames."""
    if "auto" not in choices and wanted != "current":
        raise ActionError("Snaps of this task use the frame that is shown alone: its condition has no other.")


def require_method(methods: Collection[Method], method: Method) -> None:
    """Raise `ActionError` where Snap may not compute with a method."""
    if method not in methods:
        raise ActionError(
            f"Snaps of this task are not computed with the method {method!r}: its condition has"
            f" {', '.join(methods)} alone."
        )


def require(tools: Collection[Tool], tool: Tool) -> None:
    """Raise `ActionError` where a tool may not be used."""
    if tool in tools:
        return
    if tool in MACHINES and not MACHINES & set(tools):
        raise ActionError("This task is done by hand alone: there is no machine to help.")
    raise ActionError(f"This task is done without the tool {tool!r}: its condition does not have it.")
