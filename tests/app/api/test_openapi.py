"""The OpenAPI document is true: calls made from it get the answers that it promises, and no crash."""

import importlib
import pkgutil
import re
import uuid
from typing import Any, cast

import httpx
import pytest
import schemathesis
import schemathesis.specs.openapi
from hypothesis import HealthCheck, Phase, given, settings
from schemathesis.checks import not_a_server_error
from schemathesis.specs.openapi.checks import (
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
    status_code_conformance,
)

from app.main import create_app
from app.services import Services
from app.storage.roles import Role
from tests.app.live import LiveServer
from tests.app.rest import begin, finished_snap, sentence
from tests.app.waiting import LONGEST

for part in pkgutil.walk_packages(schemathesis.specs.openapi.__path__, "schemathesis.specs.openapi."):
    importlib.import_module(part.name)  # before there are threads: CPython 3.11 fails where two parse at once

EXAMPLES = 8
CHECKS = [
    not_a_server_error,
    status_code_conformance,
    content_type_conformance,
    response_headers_conformance,
    response_schema_conformance,
]
OPEN_TO_ALL = {
    "/api/health",
    "/api/sign-in",
    "/api/sign-in/link",
    "/api/sign-in/study",
    "/api/sign-out",
}

DOCUMENT: dict[str, Any] = create_app(cast(Services, None)).openapi()  # the routes alone need no services
OPERATIONS = [(path, method) for path, methods in DOCUMENT["paths"].items() for method in methods]
ENDLESS = "/stream"


def names(operations: list[tuple[str, str]]) -> list[str]:
    return [f"{method.upper()} {path}" for path, method in operations]


@pytest.fixture
def explorer(server: LiveServer) -> httpx.Client:
    """An administrator who has begun nothing."""
    return server.script(f"explorer {uuid.uuid4().hex}", Role.ADMIN)


def known_ids(explorer: httpx.Client, path: str) -> dict[str, int | str]:
    """Parameters of the path that lead to something; to the explorer's own where it has to be theirs."""
    ids: dict[str, int | str] = dict.fromkeys(re.findall(r"{(\w+)}", path), 1)
    if "registration_id" in ids or "snap_id" in ids:
        ids["registration_id"] = begin(explorer)["id"]
    if "snap_id" in ids:
        url = f"/api/registrations/{ids.pop('registration_id')}/snaps"
        ids["snap_id"] = finished_snap(explorer, explorer.post(url).json()["id"])["id"]
    if "export_id" in ids:
        ids["export_id"] = explorer.post("/api/exports", json={"dataset_id": 1}).json()["id"]
    return ids


RANDOM_ELSEWHERE = "ignore:Do not use the `random`:hypothesis.errors.HypothesisDeprecationWarning"
"""The server's threads may draw from `random` while a strategy does, which Hypothesis takes for its doing."""

EXPLORED = [operation for operation in OPERATIONS if not operation[0].endswith(ENDLESS)]


@pytest.mark.filterwarnings(RANDOM_ELSEWHERE)
@pytest.mark.parametrize(("path", "method"), EXPLORED, ids=names(EXPLORED))
def test_calls_get_the_answers_that_are_promised(
    server: LiveServer, explorer: httpx.Client, path: str, method: str
) -> None:
    schema = schemathesis.openapi.from_dict(DOCUMENT)
    headers = {"authorization": explorer.headers["authorization"]}
    known = known_ids(explorer, path)

    @given(case=schema[path][method].as_strategy())
    @settings(
        max_examples=EXAMPLES,
        derandomize=True,
        database=None,
        phases=[Phase.explicit, Phase.generate],
        suppress_health_check=list(HealthCheck),
    )
    def explore(case: schemathesis.Case) -> None:
        case.call_and_validate(base_url=server.url, headers=headers, checks=CHECKS, timeout=LONGEST)
        if known:
            case.path_parameters.update(known)
            case.call_and_validate(base_url=server.url, headers=headers, checks=CHECKS, timeout=LONGEST)

    explore()


SECRET = [operation for operation in OPERATIONS if operation[0] not in OPEN_TO_ALL]


@pytest.mark.parametrize(("path", "method"), SECRET, ids=names(SECRET))
def test_strangers_reach_nothing_else(server: LiveServer, path: str, method: str) -> None:
    answer = server.stranger().request(method, re.sub(r"{\w+}", "1", path))
    assert sentence(answer, 401) == "Please sign in first."


def test_the_document_is_served_with_examples(server: LiveServer, operator: httpx.Client) -> None:
    document = operator.get("/api/openapi.json").json()
    assert document == DOCUMENT
    schemas = document["components"]["schemas"]
    (example,) = schemas["NewPose"]["properties"]["T_world_object"]["examples"]
    assert len(example) == 4 and example[3] == [0, 0, 0, 1]


def test_the_contract_is_kept() -> None:
    promised = """
        GET /api/health, POST /api/sign-in, POST /api/sign-out,
        GET /api/datasets, GET /api/datasets/{}, POST /api/datasets,
        GET /api/scenes, GET /api/scenes/{},
        GET /api/objects, GET /api/objects/{}, GET /api/objects/{}/mesh.ply,
        GET /api/tasks, POST /api/tasks, POST /api/tasks/{}/registration,
        GET /api/registrations/{}, PUT /api/registrations/{}/pose, POST /api/registrations/{}/snaps,
        GET /api/snaps/{}, DELETE /api/snaps/{},
        POST /api/registrations/{}/undo, POST /api/registrations/{}/redo, POST /api/registrations/{}/reset,
        POST /api/registrations/{}/submit, GET /api/registrations/{}/events,
        POST /api/exports, GET /api/exports/{}, GET /api/exports/{}/download
    """
    there = {
        f"{method.upper()} " + "/".join("{}" if part.startswith("{") else part for part in path.split("/"))
        for path, method in OPERATIONS
    }
    assert {call.strip() for call in promised.split(",")} <= there
