"""Names what computes: results of the same `ALGORITHM`, inputs and seed are the same on one machine.

A version of the software says too little, since what it computes changes between two of them, and too much,
since most changes are of something else. So this is a hash of the numeric sources themselves: of every module
that a snap imports, directly or not, without comments and docstrings, and of the fitted numbers.
"""

import ast
import hashlib
import json
from collections.abc import Iterator
from functools import cache
from pathlib import Path

PACKAGE = "registration_core"
ENTRIES = ("snap", "snap_views", "propose", "rendering.known_objects")
"""The modules whose functions make results; what they import follows from them."""
FITTED = "fitted.json"
DIGITS = 12
"""Hexadecimal ones: enough to tell any two states of the sources apart, and short enough to be read."""


def algorithm_of(root: Path, entries: tuple[str, ...] = ENTRIES) -> str:
    """The hash of the modules `entries` and of all that they import, under the package folder `root`, and of
    the fitted numbers that lie there.

    Line endings, comments and docstrings do not count, nor does the version of Python that reads them.
    """
    digest = hashlib.sha256(sources_hash(root, entries).encode())
    fitted = root / FITTED
    if fitted.exists():
        digest.update(json.dumps(json.loads(fitted.read_bytes()), sort_keys=True).encode())
    return digest.hexdigest()[:DIGITS]


def sources_hash(root: Path, entries: tuple[str, ...]) -> str:
    """The same of the modules alone."""
    digest = hashlib.sha256()
    for name, written in sorted(imported(root, entries).items()):
        digest.update(f"{name}:{written};".encode())
    return digest.hexdigest()[:DIGITS]


def imported(root: Path, entries: tuple[str, ...]) -> dict[str, str]:
    """The modules `entries` and all of the package that they import, directly or not: what counts of their
    sources, by dotted name.
    """
    found: dict[str, str] = {}
    ahead = list(entries)
    while ahead:
        name = ahead.pop()
        if name not in found and (path := _path(root, name)) is not None:
            found[name], imports = _read(path.read_bytes())
            ahead += imports
    return found


@cache
def _read(source: bytes) -> tuple[str, tuple[str, ...]]:
    """What counts of a module's source, and what it imports."""
    tree = ast.parse(source)
    return _written(tree), tuple(_imports(tree))


def _path(root: Path, name: str) -> Path | None:
    """The file of a module; None where the name is that of a function or a class."""
    stem = root.joinpath(*name.split("."))
    return next((path for path in (stem.with_suffix(".py"), stem / "__init__.py") if path.exists()), None)


def _imports(tree: ast.Module) -> Iterator[str]:
    """The dotted names under the package that a module imports."""
    for node in ast.walk(tree):
        if isinstance(node, ast.ImportFrom) and node.module:
            names = [node.module, *(f"{node.module}.{alias.name}" for alias in node.names)]
        elif isinstance(node, ast.Import):
            names = [alias.name for alias in node.names]
        else:
            continue
        yield from (name.removeprefix(f"{PACKAGE}.") for name in names if name.startswith(f"{PACKAGE}."))


def _written(node: object) -> str:
    """A syntax tree as text, without positions, docstrings and whatever a version of Python leaves empty."""
    if isinstance(node, list):
        return f"[{','.join([_written(one) for one in node if not _is_docstring(one)])}]"
    if not isinstance(node, ast.AST):
        return repr(node)
    fields = [(name, getattr(node, name, None)) for name in node._fields]
    written = [f"{name}={_written(value)}" for name, value in fields if value is not None and value != []]
    return f"{type(node).__name__}({','.join(written)})"


def _is_docstring(node: object) -> bool:
    if not isinstance(node, ast.Expr) or not isinstance(node.value, ast.Constant):
        return False
    return isinstance(node.value.value, str)


ALGORITHM = algorithm_of(Path(__file__).parent)
"""Of this installation; 12 hexadecimal digits."""

VIEWPOINT_ALGORITHM = sources_hash(Path(__file__).parent, ("search.viewpoint_model",))
"""The same of what is built of an object before it is looked for, which changes less often."""
