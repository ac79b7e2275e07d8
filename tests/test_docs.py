"""Documentation is true where a machine can tell: links, files, commands and examples."""

import ast
import importlib
import re
import tomllib
from pathlib import Path

import pytest
import yaml

import app
from tests.conftest import REPOSITORY

PAGES = sorted([*REPOSITORY.glob("*.md"), *(REPOSITORY / "docs").glob("*.md")])
LINK = re.compile(r"\[[^\]]*\]\((?!\w+:)([^)#\s]*)(?:#([^)\s]*))?\)")
FILE = re.compile(
    r"`\.?/?((?:app|registration_core|static|tests|benchmarks|scripts|migrations|docs)/[\w./-]+)`"
)
COMMAND = re.compile(r"\./scripts/(\w+)")
EXAMPLE = re.compile(r"^```python\n(.*?)^```", re.DOTALL | re.MULTILINE)

of_each_page = pytest.mark.parametrize("page", PAGES, ids=lambda page: page.name)


def anchors(page: Path) -> set[str]:
    """What headings are linked by, as GitHub makes them."""
    headings = re.findall(r"^#+ (.*)$", page.read_text(), re.MULTILINE)
    return {re.sub(r"[^\w\- ]", "", heading.lower()).replace(" ", "-") for heading in headings}


@of_each_page
def test_links_lead_somewhere(page):
    for path, anchor in LINK.findall(page.read_text()):
        target = page.parent / path if path else page
        assert target.exists(), path
        assert not anchor or anchor in anchors(target), f"{path}#{anchor}"


@of_each_page
def test_files_that_are_named_are_there(page):
    named = FILE.findall(page.read_text())
    missing = [path for path in named if not (REPOSITORY / path).exists() and "NAME" not in path]
    assert not missing


@of_each_page
def test_commands_that_are_named_are_there(page):
    assert not [
        name for name in COMMAND.findall(page.read_text()) if not (REPOSITORY / "scripts" / name).exists()
    ]


@of_each_page
def test_examples_import_what_there_is(page):
    for example in EXAMPLE.findall(page.read_text()):
        for node in ast.walk(ast.parse(example)):
            if (
                isinstance(node, ast.ImportFrom)
                and node.module
                and node.module.startswith("registration_core")
            ):
                module = importlib.import_module(node.module)
                assert all(hasattr(module, alias.name) for alias in node.names), ast.unparse(node)


def test_the_version_is_the_same_wherever_it_is_told():
    version = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]["version"]
    changes = (REPOSITORY / "CHANGELOG.md").read_text()
    released, date = re.findall(r"^## \[(\d[\d.]*)\] - (.*)$", changes, re.MULTILINE)[0]
    cited = yaml.safe_load((REPOSITORY / "CITATION.cff").read_text())
    assert version == released == cited["version"] == app.__version__
    assert date == str(cited["date-released"])


def test_the_rules_find_what_is_wrong(tmp_path):
    page = tmp_path / "page.md"
    page.write_text("# A heading, here\n[there](#a-heading-here) `app/nowhere.py` ./scripts/nothing\n")
    assert anchors(page) == {"a-heading-here"}
    assert FILE.findall(page.read_text()) == ["app/nowhere.py"]
    assert COMMAND.findall(page.read_text()) == ["nothing"]
