"""Reads a Dockerfile and a .dockerignore, as far as this project's own use the format."""

import json
import re
from dataclasses import dataclass
from pathlib import Path


@dataclass(frozen=True)
class Instruction:
    """One instruction, such as RUN, and all that follows it."""

    name: str
    value: str

    @property
    def command(self) -> list[str]:
        """Arguments of the exec form, `["program", "argument"]`."""
        return [str(part) for part in json.loads(self.value)]


def read_dockerfile(path: Path) -> list[Instruction]:
    """The instructions in order, without comments and with continued lines joined."""
    lines = [line for line in path.read_text().splitlines() if not line.lstrip().startswith("#")]
    joined = re.sub(r"\\\n\s*", " ", "\n".join(lines))
    parts = [line.split(maxsplit=1) for line in joined.splitlines() if line.strip()]
    return [Instruction(name.upper(), value.strip()) for name, value in parts]


def health_command(instruction: Instruction) -> list[str]:
    """The command of a HEALTHCHECK in exec form."""
    return Instruction("CMD", instruction.value.partition("CMD ")[2]).command


class Ignored:
    """Which paths of the build context a .dockerignore keeps out; the last rule that matches decides."""

    def __init__(self, text: str) -> None:
        lines = [line.strip() for line in text.splitlines()]
        rules = [line for line in lines if line and not line.startswith("#")]
        self._rules = [(not rule.startswith("!"), _expression(rule.lstrip("!"))) for rule in rules]

    def __call__(self, path: str) -> bool:
        """Whether `path`, relative to the context and with slashes, is kept out."""
        ignored = False
        for ignores, expression in self._rules:
            if expression.fullmatch(path):
                ignored = ignores
        return ignored


def _expression(rule: str) -> re.Pattern[str]:
    pieces = {"**/": "(?:.*/)?", "**": ".*", "*": "[^/]*", "?": "[^/]"}
    tokens = re.findall(r"\*\*/|\*\*|\*|\?|[^*?]+", rule.strip("/"))
    return re.compile("".join(pieces.get(token) or re.escape(token) for token in tokens) + "(?:/.*)?")
