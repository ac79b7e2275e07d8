"""Dockerfile and compose.yaml: what they name exists, and they are safe; without a Docker engine."""

import itertools
import json
import os
import re
import shutil
import socket
import subprocess
import sys
import sysconfig
import time
import tomllib
from collections.abc import Iterator
from contextlib import contextmanager
from importlib.metadata import entry_points
from pathlib import Path
from typing import Any

import pytest
import yaml
from typer.core import TyperGroup
from typer.main import get_command

from app.api import health
from app.cli.commands import cli
from tests.conftest import REPOSITORY

SCRIPTS = Path(sysconfig.get_path("scripts"))
DOCKERFILE = re.sub(r"^#.*\n|\\\n", "", (REPOSITORY / "Dockerfile").read_text(), flags=re.MULTILINE)
STEPS = [line.split(maxsplit=1) for line in DOCKERFILE.splitlines() if line]
"""The name of each instruction and what follows it."""
CONTEXT = (REPOSITORY / ".dockerignore").read_text().split()
COMPOSE = yaml.safe_load((REPOSITORY / "compose.yaml").read_text())
SERVICES: dict[str, dict[str, Any]] = COMPOSE["services"]
OWN_SERVICES = ("app", "scheduler", "worker")


def values(name: str) -> list[str]:
    return [value for step, value in STEPS if step == name]


def copied() -> set[str]:
    return {source for value in values("COPY") for source in value.split()[:-1]}


def last_command(name: str) -> list[str]:
    """Arguments of the exec form, `["program", "argument"]`, with which an instruction ends."""
    command: list[str] = json.loads(re.sub(r"^[^\[]*", "", values(name)[-1]))
    return command


def image_environment() -> dict[str, str]:
    return dict(part.split("=", 1) for value in values("ENV") for part in value.split())


# --- Dockerfile


def test_the_image_starts_from_the_python_that_is_asked_for() -> None:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    assert values("FROM")[0].startswith(f"python:{project['requires-python'].removeprefix('>=')}-")


def test_every_copied_path_exists() -> None:
    for source in copied():
        assert (REPOSITORY / source).exists(), source


def test_everything_the_application_needs_is_copied() -> None:
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    packages = {"registration_core", "app", "migrations", "static", "scenes"}
    files = {"pyproject.toml", "setup.py", "constraints.txt", project["readme"], *project["license-files"]}
    assert packages | files <= copied()


def test_the_build_context_holds_what_is_copied_and_nothing_that_was_built_here() -> None:
    rules = [rule for rule in CONTEXT if rule.startswith("!")]
    assert CONTEXT[: 1 + len(rules)] == ["*", *rules], "all is kept out first, and nothing let in at the end"
    assert {rule.removeprefix("!") for rule in rules} == copied()
    assert {"**/__pycache__", "**/*.egg-info"} <= set(CONTEXT)


def test_the_image_does_not_run_as_root() -> None:
    names = [name for name, _ in STEPS]
    assert values("USER")[-1] not in {"root", "0"}
    assert names.index("USER") < names.index("CMD")
    assert f"--uid 10001 --create-home {values('USER')[-1]}" in " ".join(values("RUN"))


def test_the_folders_written_at_run_time_belong_to_the_user() -> None:
    made = next(value for value in values("RUN") if "install -d -o snap6d" in value)
    environment = image_environment()
    assert environment["SNAP6D_STATE_DIR"] in made
    assert environment["NUMBA_CACHE_DIR"] in made
    assert values("VOLUME") == [environment["SNAP6D_STATE_DIR"]]


def test_the_image_installs_the_libraries_that_the_scripts_install() -> None:
    setup = (REPOSITORY / "scripts/setup").read_text()
    (libraries,) = re.findall(r"^libraries=\((.*)\)$", setup, re.MULTILINE)
    checked = {library.partition("=")[2] for library in libraries.split()}
    assert checked
    assert checked <= set(values("RUN")[0].split())


def test_pinned_packages_are_installed() -> None:
    for value in values("RUN"):
        for command in value.split("&&"):
            if "pip install" in command:
                assert "--constraint constraints.txt" in command or "--no-deps" in command


def test_the_command_exists_and_listens_on_the_exposed_port() -> None:
    command = last_command("CMD")
    assert_is_a_command(command)
    options = dict(itertools.pairwise(command))
    assert options["--host"] == "0.0.0.0"
    assert values("EXPOSE") == [options["--port"]]


# --- compose.yaml


def test_only_the_application_publishes_a_port_and_by_default_to_this_machine() -> None:
    published = {name: service["ports"] for name, service in SERVICES.items() if "ports" in service}
    assert published == {"app": [f"${{SNAP6D_PUBLISH:-127.0.0.1:8000}}:{values('EXPOSE')[0]}"]}
    assert not any("network_mode" in service for service in SERVICES.values())


def test_only_the_application_is_on_a_network_that_leads_outside() -> None:
    internal = {name for name, network in COMPOSE["networks"].items() if network and network.get("internal")}
    for name, service in SERVICES.items():
        assert name == "app" or set(service["networks"]) <= internal


@pytest.mark.parametrize("name", ["scheduler", "worker"])
def test_commands_exist(name: str) -> None:
    assert_is_a_command(SERVICES[name]["command"])


def test_services_name_each_other_rightly() -> None:
    address = SERVICES["app"]["environment"]["SNAP6D_SCHEDULER_ADDRESS"]
    command = SERVICES["scheduler"]["command"]
    assert address == f"tcp://scheduler:{command[command.index('--port') + 1]}"
    assert address in SERVICES["worker"]["command"]


def test_workers_have_one_thread_and_load_the_kernels_first() -> None:
    command = SERVICES["worker"]["command"]
    assert command[command.index("--nthreads") + 1] == "1"
    assert command[command.index("--preload") + 1] == "app.workers.jobs"
    assert "${SNAP6D_WORKERS:-2}" in SERVICES["worker"]["deploy"]["replicas"]


def test_every_service_is_checked_restarted_and_waited_for() -> None:
    for service in SERVICES.values():
        assert service["healthcheck"]["test"][0] == "CMD"
        assert service["restart"] == "unless-stopped"
        for needed, how in service.get("depends_on", {}).items():
            assert how["condition"] == "service_healthy"
            assert needed in SERVICES
            assert ("profiles" in SERVICES[needed]) is (how.get("required") is False)
    assert set(SERVICES["app"]["depends_on"]) == {"scheduler", "worker", "postgres"}


def test_own_services_may_gain_no_privileges() -> None:
    for name in OWN_SERVICES:
        assert SERVICES[name]["cap_drop"] == ["ALL"]
        assert "no-new-privileges:true" in SERVICES[name]["security_opt"]
        assert "user" not in SERVICES[name]


def test_volumes_are_declared_and_hold_the_state() -> None:
    mounted = {
        tuple(volume.split(":")) for service in SERVICES.values() for volume in service.get("volumes", [])
    }
    assert {name for name, _ in mounted} == set(COMPOSE["volumes"])
    assert ("state", image_environment()["SNAP6D_STATE_DIR"]) in mounted


def test_postgres_is_a_profile_and_has_no_password_of_ours() -> None:
    postgres = SERVICES["postgres"]
    assert postgres["profiles"] == ["postgres"]
    assert postgres["environment"]["POSTGRES_PASSWORD"] == "${POSTGRES_PASSWORD:-}"
    assert SERVICES["app"]["environment"]["SNAP6D_DATABASE_URL"] == "${SNAP6D_DATABASE_URL:-}"


# --- health


def test_the_application_is_asked_for_a_route_that_exists() -> None:
    in_image = last_command("HEALTHCHECK")
    assert SERVICES["app"]["healthcheck"]["test"] == ["CMD", *in_image]
    url = re.search(r"http://127\.0\.0\.1:(\d+)(/[^']*)", in_image[-1])
    assert url is not None
    assert url[1] == values("EXPOSE")[0]
    assert url[2] in {getattr(route, "path", "") for route in health.router.routes}


def test_scheduler_and_worker_run_by_their_own_commands_and_health_checks(tmp_path: Path) -> None:
    ports = {port: str(free_port()) for port in ("8786", "8787", "8790")}

    def here(command: list[str]) -> list[str]:
        """The command with free ports of this machine instead of the containers' own."""
        line = "\n".join(command).replace("scheduler:", "127.0.0.1:").replace("\n:87", "\n127.0.0.1:87")
        for port, free in ports.items():
            line = line.replace(port, free)
        return line.split("\n")

    def healthy(service: str) -> bool:
        program, *arguments = here(SERVICES[service]["healthcheck"]["test"][1:])
        assert program == "python"
        return (
            subprocess.run([sys.executable, *arguments], stderr=subprocess.DEVNULL, check=False).returncode
            == 0
        )

    assert not healthy("scheduler")
    with running([*here(SERVICES["scheduler"]["command"]), "--host", "127.0.0.1"], tmp_path):
        wait_until(lambda: healthy("scheduler"))
        assert not healthy("worker")
        with running(here(SERVICES["worker"]["command"]), tmp_path):
            wait_until(lambda: healthy("worker"))


# --- the scripts


def test_scripts_are_executable_and_name_no_address() -> None:
    for path in [*(REPOSITORY / "scripts").iterdir(), REPOSITORY / ".ci/run"]:
        assert path.stat().st_mode & 0o111, path
        assert "://" not in path.read_text(), path


def test_constraints_pin_every_direct_dependency_and_nothing_else_than_versions() -> None:
    lines = (REPOSITORY / "constraints.txt").read_text().splitlines()
    pinned = [line for line in lines if not line.startswith("#")]
    assert all(re.fullmatch(r"[A-Za-z0-9._-]+==[A-Za-z0-9.]+", line) for line in pinned)
    names = {_normal(line.partition("==")[0]) for line in pinned}
    project = tomllib.loads((REPOSITORY / "pyproject.toml").read_text())["project"]
    wanted = [*project["dependencies"], *itertools.chain(*project["optional-dependencies"].values())]
    assert {_normal(re.split(r"[^A-Za-z0-9._-]", line)[0]) for line in wanted} <= names


def _normal(name: str) -> str:
    return re.sub(r"[-_.]+", "-", name).lower()


def assert_is_a_command(command: list[str]) -> None:
    """The program is a console script of this environment that takes these arguments."""
    program, subcommand, *arguments = command
    assert shutil.which(program, path=str(SCRIPTS)), program
    if program == "dask":
        (found,) = entry_points(group="dask_cli", name=subcommand)
        found.load().make_context(subcommand, arguments)
    else:
        group = get_command(cli)
        assert isinstance(group, TyperGroup)
        group.commands[subcommand].make_context(subcommand, arguments)


def free_port() -> int:
    with socket.socket() as listener:
        listener.bind(("127.0.0.1", 0))
        port: int = listener.getsockname()[1]
        return port


def wait_until(condition: Any, seconds: float = 90) -> None:
    deadline = time.monotonic() + seconds
    while not condition():
        assert time.monotonic() < deadline, "did not become healthy"


@contextmanager
def running(command: list[str], folder: Path) -> Iterator[None]:
    """A console script of this environment, stopped at the end."""
    log = (folder / f"{command[1]}.log").open("w")
    environment = os.environ | {"PYTHONPATH": str(REPOSITORY)}
    with (
        log,
        subprocess.Popen(
            [SCRIPTS / command[0], *command[1:]], cwd=folder, stdout=log, stderr=log, env=environment
        ) as process,
    ):
        try:
            yield
        finally:
            process.terminate()
            process.wait(30)
