"""The wheel serves in an environment of its own, and reads nothing of the checkout that it was built in."""

import os
import shutil
import subprocess
import sys
import sysconfig
import venv
import zipfile
from collections.abc import Iterator
from pathlib import Path

import httpx
import pytest

from tests.app.waiting import LONGEST
from tests.conftest import REPOSITORY
from tests.processes import Server, started

BUILT_FROM = (
    *("pyproject.toml", "setup.py", "README.md", "LICENSE"),
    *("app", "registration_core", "static", "migrations", "scenes"),
)
WATCH = """
import os, sys

def watch(event, arguments):
    if event in ("open", "os.listdir", "os.scandir") and isinstance(arguments[0], (str, os.PathLike)):
        path = os.path.realpath(arguments[0])
        if path.startswith({checkout!r} + os.sep) and not (path + os.sep).startswith({packages!r} + os.sep):
            os.write(os.open({seen!r}, os.O_APPEND | os.O_CREAT | os.O_WRONLY), (path + "\\n").encode())

sys.addaudithook(watch)
"""
"""Runs in every Python of the environment, and writes down what it reads of the checkout."""

pytestmark = pytest.mark.slow


@pytest.fixture(scope="module")
def wheel(tmp_path_factory: pytest.TempPathFactory) -> Path:
    """The wheel, built from a copy: setuptools leaves its work beside what it builds."""
    copy, out = tmp_path_factory.mktemp("source"), tmp_path_factory.mktemp("wheel")
    for name in BUILT_FROM:
        if (REPOSITORY / name).is_dir():
            shutil.copytree(REPOSITORY / name, copy / name, ignore=shutil.ignore_patterns("__pycache__"))
        else:
            shutil.copy(REPOSITORY / name, copy)
    _pip("wheel", "--no-deps", "--no-build-isolation", "--wheel-dir", str(out), str(copy))
    (built,) = out.iterdir()
    return built


def _pip(*arguments: str) -> None:
    command = [sys.executable, "-m", "pip", "--quiet", "--disable-pip-version-check", *arguments]
    subprocess.run(command, check=True, cwd="/")


@pytest.fixture(scope="module")
def environment(wheel: Path, tmp_path_factory: pytest.TempPathFactory) -> Path:
    """An environment with the wheel, and with the packages of this one but without its Snap6D."""
    folder = tmp_path_factory.mktemp("environment")
    venv.create(folder, symlinks=True)
    _pip("--python", str(folder / "bin/python"), "install", "--no-deps", "--no-compile", str(wheel))
    (site,) = folder.glob("lib/python*/site-packages")
    _take_kernels_over(site)
    (site / "others.pth").write_text("\n".join(path for path in sys.path if path.endswith("site-packages")))
    watch = WATCH.format(
        checkout=str(REPOSITORY),
        packages=os.path.realpath(sysconfig.get_path("purelib")),
        seen=str(folder / "seen"),
    )
    (site / "sitecustomize.py").write_text(watch)
    return folder


def _take_kernels_over(site: Path) -> None:
    """Spare it a minute of compiling: numba keeps kernels beside a source file, and goes by its time."""
    for source in (REPOSITORY / "registration_core").rglob("*"):
        there = site / source.relative_to(REPOSITORY)
        if source.suffix == ".py":
            shutil.copystat(source, there)
        elif source.suffix in {".nbi", ".nbc"}:
            there.parent.mkdir(exist_ok=True)
            shutil.copy(source, there)


@pytest.fixture
def server(environment: Path, tmp_path: Path) -> Iterator[Server]:
    """Its `snap6d serve`, in a home of its own."""
    kept = {name: value for name, value in os.environ.items() if not name.startswith(("SNAP6D_", "PYTHON"))}
    process = subprocess.Popen(
        [environment / "bin/snap6d", "serve", "--port", "0", "--workers", "1"],
        env={**kept, "XDG_DATA_HOME": str(tmp_path), "PYTHONUNBUFFERED": "1"},
        cwd=tmp_path,
        stdout=subprocess.PIPE,
        stderr=subprocess.STDOUT,
        text=True,
    )
    running = started(process, tmp_path / "snap6d")
    yield running
    running.kill()


def test_a_typed_package_with_pages_migrations_and_demo_scenes_is_built(wheel: Path) -> None:
    names = set(zipfile.ZipFile(wheel).namelist())
    assert {"app/py.typed", "registration_core/py.typed", "registration_core/fitted.json"} <= names
    for folder in ("static", "migrations", "scenes/demo"):
        here = {path for path in (REPOSITORY / folder).rglob("*") if path.is_file() and path.suffix != ".pyc"}
        assert here
        assert {f"app/{path.relative_to(REPOSITORY)}" for path in here} <= names
    assert not [name for name in names if not name.startswith(("app/", "registration_core/", "snap6d-"))]
    assert not [name for name in names if "__pycache__" in name]


def test_it_serves_pages_and_the_demo_scenes_and_reads_no_checkout(environment: Path, server: Server) -> None:
    with httpx.Client(base_url=server.url.replace("localhost", "127.0.0.1"), timeout=LONGEST) as client:
        assert client.post("/api/sign-in/link", json={"token": server.secret}).status_code == 204
        for page in ("/", "/api/docs", "/static/home/home.js", "/static/swagger/swagger-ui-bundle.js"):
            assert client.get(page).status_code == 200, page
        assert [dataset["name"] for dataset in client.get("/api/datasets").json()["items"]] == ["demo"]
        assert client.get("/api/tasks").json()["items"]
    assert (server.state_dir / "snap6d.sqlite").is_file()
    assert not (environment / "seen").exists(), (environment / "seen").read_text()


def test_what_is_read_of_the_checkout_would_be_seen(environment: Path, tmp_path: Path) -> None:
    code = f"open({str(REPOSITORY / 'pyproject.toml')!r})"
    subprocess.run([environment / "bin/python", "-W", "ignore", "-c", code], cwd=tmp_path, check=True)
    assert (environment / "seen").read_text().splitlines() == [str(REPOSITORY / "pyproject.toml")]
    (environment / "seen").unlink()
