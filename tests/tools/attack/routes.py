"""Every route of the interface, as a stranger and as each role."""

import re
from collections.abc import Iterator

import httpx

from app.storage.roles import Role
from tests.tools.attack.target import Outcome, Target

OPEN = frozenset(
    {
        "GET /api/health",
        "POST /api/sign-in",
        "POST /api/sign-in/link",
        "POST /api/sign-in/study",
        "POST /api/sign-out",
    }
)
"""To strangers."""
OF_PARTICIPANTS = (
    r"GET /api/me",
    r"\w+ /api/participation.*",
    r"GET /api/(scenes/{scene_id}|tasks/{task_id}|frames/{frame_id}/color.png)",
    r"GET /api/objects/{object_id}(/(outline|textured).mesh)?",
    r"POST /api/tasks/{task_id}/registration",
    r"\w+ /api/registrations/{registration_id}(?!/(events|replay)).*",
    r"(GET|DELETE) /api/(snaps|searches)/{\w+}",
)
"""What the least of all roles may ask for; that it is theirs is looked at behind."""
OF_REVIEWERS = (r"GET /api/datasets/{dataset_id}/acceptance", r"PUT /api/datasets/.*", r"GET /api/reports/.*")
OF_ADMINISTRATORS = (
    r"POST /api/(datasets|tasks|exports|studies.*)",
    r"GET /api/(exports|studies).*",
    r"DELETE /api/studies/.*",
    r"PUT /api/objects/{object_id}/symmetries",
)
NOTHING = str(2**31 - 1)
"""An id that nothing has."""
ENDS_THE_LOGIN = frozenset({"POST /api/participation/withdraw", "POST /api/sign-out"})
"""Of the participant, who is needed further on."""


def attack_routes(target: Target) -> Iterator[Outcome]:
    """A stranger is asked to sign in, a role that is too low is told so, and nothing breaks."""
    with httpx.Client(base_url=target.url, timeout=60) as stranger:
        callers: dict[Role | None, httpx.Client] = {None: stranger} | target.clients
        for path, methods in target.document["paths"].items():
            for operation in (f"{method.upper()} {path}" for method in methods):
                for role, client in callers.items():
                    if role is not Role.PARTICIPANT or operation not in ENDS_THE_LOGIN:
                        yield _tried(client, role, operation)


def needed(operation: str) -> Role | None:
    """The least role that a route is for; None where it is for everybody."""
    if operation in OPEN:
        return None
    rules = (
        (Role.ADMIN, OF_ADMINISTRATORS),
        (Role.REVIEWER, OF_REVIEWERS),
        (Role.PARTICIPANT, OF_PARTICIPANTS),
    )
    for role, patterns in rules:
        if any(re.fullmatch(pattern, operation) for pattern in patterns):
            return role
    return Role.OPERATOR


def _tried(client: httpx.Client, role: Role | None, operation: str) -> Outcome:
    method, path = operation.split(" ")
    body: dict[str, object] | None = {} if method in {"POST", "PUT"} else None
    with client.stream(method, re.sub(r"{\w+}", NOTHING, path), json=body) as answer:
        status = answer.status_code
    least = needed(operation)
    if least is None:
        withstood = status < 500 or (status == 503 and operation == "GET /api/health")  # no workers yet
    elif role is None:
        withstood = status == 401
    elif not role.includes(least):
        withstood = status == 403
    else:
        withstood = status != 401 and status < 500
    return Outcome(f"{operation} as {role or 'a stranger'}", withstood, str(status))
