"""Requests that no well-behaved client sends: paths, bodies and headers."""

from collections.abc import Iterator

from app.api.body_limits import LARGEST_BODY
from app.storage.roles import Role
from tests.tools.attack.target import Outcome, Target, refused, status_of, unbroken

UPWARDS = ("../", "..%2f", "%2e%2e/", "%2e%2e%2f", "..%5c", "..\\", "....//", "%252e%252e%252f", "..%c0%af")
WANTED = ("pyproject.toml", "app/config.py", "etc/passwd", "snap6d.sqlite")
CONTENT = (b"[build-system]", b"class Settings", b"root:", b"SQLite format")
"""Of these files."""
TOO_MUCH = ("a large body", "a deep list", "a deep object")
"""Bodies that no route is to read."""


def attack_paths(target: Target) -> Iterator[Outcome]:
    """No path leads to a file that is not to be served."""
    view = f"/view/{target.registration_id}/"
    for folder in ("/", "/static/", "/static/label/", view, "/api/exports/", "/api/reports/1/files/"):
        for upwards in UPWARDS:
            for wanted in WANTED:
                yield _path(target, f"{folder}{upwards * 8}{wanted}")
        for path in (
            f"{folder}/etc/passwd",
            f"{folder}%00",
            f"{folder}x%00.html",
            f"{folder}~root",
            f"{folder}%",
        ):
            yield _path(target, path)


def _path(target: Target, path: str) -> Outcome:
    asked = [f"GET {path} HTTP/1.1", f"Host: {target.host}", "Connection: close", _token(target), "", ""]
    with target.connection() as opened:
        opened.sendall("\r\n".join(asked).encode())
        answer = b""
        while data := opened.recv(65536):
            answer += data
    told = any(content in answer for content in CONTENT)
    return Outcome(
        f"GET {path}", status_of(answer) < 500 and not told, answer[-100:].decode(errors="replace")
    )


def attack_bodies(target: Target) -> Iterator[Outcome]:
    """Bodies that are too large or too deep are refused by every route, and no body breaks one."""
    for path, methods in target.document["paths"].items():
        for method in sorted({"post", "put"} & methods.keys()):
            for name, body in _bodies().items():
                for caller, own in (("a stranger", ""), ("an administrator", _token(target))):
                    asked = _request(
                        target, f"{method.upper()} {path.replace('{', '').replace('}', '')}", own
                    )
                    large = body if body is not None else b""
                    length = len(large) if body is not None else 50 * LARGEST_BODY
                    answer = target.answer(f"{asked}Content-Length: {length}\r\n\r\n".encode(), large)
                    what = f"{method.upper()} {path} with {name} as {caller}"
                    yield refused(what, answer, 401, 413, 422) if name in TOO_MUCH else unbroken(what, answer)


def _bodies() -> dict[str, bytes | None]:
    """By what is wrong with them; None is one that is announced and does not come."""
    return {
        "a deep list": b"[" * 50_000 + b"]" * 50_000,
        "a deep object": b'{"a":' * 50_000 + b"1" + b"}" * 50_000,
        "a large body": None,
        "half a body": b'{"name": "x',
        "bytes that are no text": b'{"name": "\xff\xfe"}',
        "a number beyond all": b'{"seconds": 1' + b"0" * 5000 + b"}",
        "what is no number": b'{"T_world_object": NaN, "seconds": Infinity}',
        "half a character": b'{"name": "\\ud800", "password": "\\udfff\\u0000"}',
    }


def attack_headers(target: Target) -> Iterator[Outcome]:
    """Headers make nobody somebody else, and smuggle nothing."""
    admin = target.clients[Role.ADMIN].headers["authorization"].removeprefix("Bearer ")
    login = target.login["cookie"].partition("=")[2]
    for name, value in (
        ("Authorization", "Basic YWRtaW46YWRtaW4="),
        ("Authorization", f"Bearer {login}"),
        ("Authorization", f"Token {admin}"),
        ("Cookie", f"snap6d_session={admin}"),
        ("Cookie", "snap6d_session="),
        ("Cookie", f"snap6d_session={'x' * 4000}"),
        ("X-Forwarded-User", "admin"),
        ("X-Remote-User", "admin"),
        ("X-Original-URL", "/api/health"),
        ("X-Forwarded-For", "127.0.0.1"),
    ):
        yield refused(f"{name}: {value[:30]}", _asked(target, f"{name}: {value}"), 401)
    for host in ("evil.example", "", "localhost.evil.example", "[::1", "127.0.0.1@evil.example"):
        yield refused(
            f"Host: {host}", target.answer(f"GET / HTTP/1.1\r\nHost: {host}\r\n\r\n".encode()), 421, 400
        )
    for lines in (
        ("Content-Length: 5", "Content-Length: 6"),
        ("Content-Length: -1",),
        ("Content-Length: 1e3",),
        ("Content-Length: 5", "Transfer-Encoding: chunked"),
        ("Transfer-Encoding: gzip",),
        (" folded: x",),
        ("no colon",),
        (f"X-Long: {'x' * 100_000}",),
        *((tuple(f"X-{i}: {'x' * 90}" for i in range(1000))),),
        ("X-Forwarded-For: 192.0.2.1, evil",),
    ):
        answer = target.answer(_request(target, "POST /api/exports", *lines).encode() + b"\r\n0\r\n\r\n")
        yield refused(f"{lines[0][:40]} and {len(lines) - 1} more", answer)


def _asked(target: Target, *lines: str) -> bytes:
    return target.answer(_request(target, "GET /api/me", *lines).encode() + b"\r\n")


def _request(target: Target, what: str, *lines: str) -> str:
    own = (f"{what} HTTP/1.1", f"Host: {target.host}", "Content-Type: application/json", *lines)
    return "".join(f"{line}\r\n" for line in own if line)


def _token(target: Target) -> str:
    return f"Authorization: {target.clients[Role.ADMIN].headers['authorization']}"
