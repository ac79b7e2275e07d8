"""Writes what scripts are checked against: the types of REST, and the elements of the pages by their ids.

`python -m tests.tools.front_end_types` writes them into types/; with --check it says whether they are there
as they would be written.
"""

import json
import subprocess
import sys
from collections.abc import Iterable
from html.parser import HTMLParser
from pathlib import Path
from typing import Any, cast

from app.main import create_app
from app.pages import TEMPLATES, html_of
from app.services import Services
from tests.conftest import REPOSITORY

TYPES = REPOSITORY / "types"
PAGES = sorted(path.stem for path in TEMPLATES.glob("*.html"))
NODE = Path(sys.executable).parent / "node"
GENERATOR = REPOSITORY / "node_modules" / ".bin" / "openapi-typescript"
SVG = {"svg", "g", "path", "use", "text", "line", "rect", "circle"}


def rest_types() -> str:
    """The types of REST as openapi-typescript writes them."""
    described = json.dumps(without_failures(create_app(cast(Services, None)).openapi()))
    # a field of a request that has a default may be left out
    command = [str(NODE), str(GENERATOR), "--default-non-nullable", "false"]
    return subprocess.run(command, input=described, text=True, capture_output=True, check=True).stdout


def without_failures(document: dict[str, Any]) -> dict[str, Any]:
    """An OpenAPI document without the answers that are problems: to pages these are errors of one kind."""
    for methods in document["paths"].values():
        for operation in methods.values():
            responses = operation["responses"]
            operation["responses"] = {status: responses[status] for status in responses if status[0] == "2"}
    return document


def element_types(pages: Iterable[str]) -> str:
    """The types of the elements by id; of one that pages give to different tags, nothing is known."""
    tags: dict[str, set[str]] = {}
    for page in pages:
        for name, tag in _Ids(page).found:
            tags.setdefault(name, set()).add(tag)
    lines = [f'  "{name}": {_type(tags[name])};' for name in sorted(tags)]
    return "\n".join(["/** The elements of the pages by id. */", "interface ElementsById {", *lines, "}", ""])


def _type(tags: set[str]) -> str:
    tag, *others = tags
    if others:
        return "any"
    return f'{"SVG" if tag in SVG else "HTML"}ElementTagNameMap["{tag}"]'


class _Ids(HTMLParser):
    def __init__(self, page: str) -> None:
        super().__init__()
        self.found: list[tuple[str, str]] = []
        self.feed(page)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.found += [(value, tag) for name, value in attrs if name == "id" and value]


def main() -> None:
    """Write the files, or with --check compare them."""
    wanted = {
        TYPES / "rest.d.ts": rest_types(),
        TYPES / "elements.d.ts": element_types(map(html_of, PAGES)),
    }
    for path, content in wanted.items():
        if "--check" not in sys.argv:
            path.write_text(content)
        elif not path.exists() or path.read_text() != content:
            sys.exit(f"types/{path.name} is not what the application has now: run ./scripts/types")


if __name__ == "__main__":
    main()
