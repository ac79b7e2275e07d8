"""The reference is built from docstrings and OpenAPI, and needs no other host."""

import json
import re
from pathlib import Path

import pytest

import registration_core
from tests.tools import reference


@pytest.fixture(scope="module")
def site(tmp_path_factory: pytest.TempPathFactory) -> Path:
    folder = tmp_path_factory.mktemp("reference") / "site"
    reference.write_reference(folder)
    return folder


@pytest.mark.slow
def test_every_name_of_the_core_and_every_call_of_rest_is_in_it(site: Path) -> None:
    core = (site / "core/registration_core.html").read_text()
    for name in registration_core.__all__:
        assert f'id="{name}"' in core, name
    document = json.loads((site / "rest/openapi.json").read_text())
    assert "/api/registrations/{registration_id}/snaps" in document["paths"]
    shown = re.search(r"spec: (.*),\n", (site / "rest/index.html").read_text())
    assert shown is not None and json.loads(shown[1]) == document


@pytest.mark.slow
def test_its_pages_lead_to_each_other_and_load_nothing_from_elsewhere(site: Path) -> None:
    for page in site.rglob("*.html"):
        text = page.read_text()
        for address in re.findall(r'<(?:script|img|link)\b[^>]*\b(?:src|href)="([^"]*)"', text):
            assert (page.parent / address).is_file() or address.startswith("data:"), (page, address)
        for address in re.findall(r'<a\b[^>]*\bhref="([^"#:$]+)[#"]', text):  # $: what a script fills in
            assert (page.parent / address).is_file(), (page, address)


def test_what_has_no_docstring_is_named() -> None:
    assert reference.silent_names() == []
    document = {"paths": {"/api/a": {"get": {"description": "Returns a."}, "put": {}}}}
    assert reference.silent_operations(document) == ["PUT /api/a"]
