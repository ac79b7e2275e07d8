"""Starts a server on a temporary state, attacks it by all kinds, and prints what it withstood."""

import argparse
import sys
import tempfile
from collections.abc import Iterator, Mapping, Sequence
from contextlib import contextmanager
from pathlib import Path

import httpx

from app.storage.roles import Role
from tests.app.waiting import LONGEST
from tests.processes import serving
from tests.tools.attack.malformed import attack_bodies, attack_headers, attack_paths
from tests.tools.attack.origins import attack_origins, attack_ports
from tests.tools.attack.patience import attack_silence, attack_throttle
from tests.tools.attack.routes import attack_routes
from tests.tools.attack.target import Attack, Outcome, Target, target_of

KINDS: Mapping[str, Attack] = {
    "routes by role": attack_routes,
    "foreign origins": attack_origins,
    "other ports": attack_ports,
    "paths": attack_paths,
    "bodies": attack_bodies,
    "headers": attack_headers,
    "guesses": attack_throttle,
    "silence": attack_silence,
}


def attacked(target: Target) -> dict[str, list[Outcome]]:
    """What came of all kinds of attacks."""
    return {kind: list(attack(target)) for kind, attack in KINDS.items()}


def report(found: Mapping[str, Sequence[Outcome]]) -> int:
    """Print how much was tried and what failed; returns the exit code."""
    print(f"{'kind':<18}{'tried':>8}{'failed':>8}")
    for kind, outcomes in found.items():
        failed = [outcome for outcome in outcomes if not outcome.withstood]
        print(f"{kind:<18}{len(outcomes):>8}{len(failed):>8}")
    failures = [(kind, one) for kind, outcomes in found.items() for one in outcomes if not one.withstood]
    for kind, outcome in failures:
        print(f"FAILED {kind}: {outcome.what}: {outcome.said}")
    return 1 if failures else 0


@contextmanager
def own_server(has_time: bool) -> Iterator[Target]:
    """A server with the demo scenes, in a process of its own, as a target."""
    with tempfile.TemporaryDirectory() as folder, serving(Path(folder) / "state", "--prepare") as server:
        url = server.url.replace("localhost", "127.0.0.1")

        def script(role: Role) -> httpx.Client:
            token = server.command("token", "create", f"a script of role {role}", "--role", role).strip()
            return httpx.Client(base_url=url, headers={"authorization": f"Bearer {token}"}, timeout=LONGEST)

        port = int(url.rsplit(":", 1)[1])
        with target_of(port, server.process.pid, script, has_time) as target:
            yield target


def main() -> int:
    """Attack a server of one's own; the exit code is 1 where it did not withstand something."""
    parser = argparse.ArgumentParser(prog="./scripts/attack", description=__doc__)
    parser.add_argument("--quick", action="store_true", help="leave out what waits for the server's patience")
    with own_server(has_time=not parser.parse_args().quick) as target:
        return report(attacked(target))


if __name__ == "__main__":
    sys.exit(main())
