"""Runs the Dockerfile's steps in order in an empty Debian, where no Docker engine is at hand.

usage, as root, from the project's root:  python3 -m tests.tools.run_dockerfile FOLDER

The folder becomes the image. A Debian made by debootstrap, with Debian's Python, stands in for the base image
(kept beside it as FOLDER.tar for the next time). Then come the Dockerfile's steps, each COPY by the rules of
.dockerignore. At last CMD is started as the image's user, in a network of its own that reaches nothing, until
HEALTHCHECK finds it healthy.
"""

import argparse
import os
import shlex
import shutil
import subprocess
import sys
import tarfile
import time
from dataclasses import dataclass, field
from pathlib import Path

from tests.tools.dockerfile import Ignored, Instruction, health_command, read_dockerfile

PROJECT = Path(__file__).resolve().parents[2]
PYTHON = "/usr/local/python"
"""Stands in for the base image's own Python: Debian keeps pip from changing Debian's."""
MOUNTED = ("proc", "sys", "dev")
SECONDS_TO_BECOME_HEALTHY = 180
STARTING = """
ip link set lo up
{enter} {command} &
until {enter} {check} 2>/dev/null; do
    [ "$(( $(date +%s) - {start} ))" -lt {limit} ] || {{ echo "not healthy after {limit} s"; exit 1; }}
    kill -0 $! || exit 1
    sleep 1
done
echo "healthy after $(( $(date +%s) - {start} )) s"
kill $!
wait $! || true
"""


@dataclass
class Image:
    """What the steps up to now have set."""

    root: Path
    user: str = "root"
    folder: str = "/"
    environment: dict[str, str] = field(default_factory=dict)

    def enter(self) -> list[str]:
        """The command line that runs what follows it inside, as the image's user."""
        passwd = dict(line.split(":", 1) for line in (self.root / "etc/passwd").read_text().splitlines())
        home = passwd[self.user].split(":")[4]
        variables = {"HOME": home, **self.environment}
        settings = [f"{name}={value}" for name, value in variables.items()]
        inside = ["chroot", f"--userspec={self.user}:{self.user}", str(self.root), "env", "-i", *settings]
        return [*inside, "sh", "-c", f'cd {shlex.quote(self.folder)} && exec "$@"', "sh"]


def main() -> None:
    """Run all steps, telling each and its seconds."""
    parser = argparse.ArgumentParser(
        description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter
    )
    parser.add_argument("folder", type=Path, help="what the image is made in; removed first if it is there")
    root = parser.parse_args().folder.resolve()
    if os.geteuid() != 0 or not shutil.which("debootstrap"):
        sys.exit("run_dockerfile: this needs root and debootstrap: install debootstrap and run it as root")
    steps = read_dockerfile(PROJECT / "Dockerfile")
    _unmount(root)
    image = Image(root)
    try:
        for step in steps:
            start = time.monotonic()
            print(f"{step.name} {step.value[:150]}", flush=True)
            _run_step(image, step)
            print(f"    {time.monotonic() - start:.1f} s", flush=True)
        _start(image, steps)
    except subprocess.CalledProcessError as error:
        sys.exit(f"run_dockerfile: that step failed with exit code {error.returncode}")
    finally:
        _unmount(root)


def _run_step(image: Image, step: Instruction) -> None:
    match step.name:
        case "FROM":
            _make_base(image)
        case "RUN":
            subprocess.run(
                [*image.enter(), "/bin/sh", "-c", step.value], stdin=subprocess.DEVNULL, check=True
            )
        case "COPY":
            *sources, target = step.value.split()
            for source in sources:
                _copy(image, source, target)
        case "WORKDIR":
            image.folder = step.value
            (image.root / step.value.lstrip("/")).mkdir(parents=True, exist_ok=True)
        case "ENV":
            for part in shlex.split(step.value):
                name, value = part.split("=", 1)
                image.environment[name] = value
        case "USER":
            image.user = step.value


def _make_base(image: Image) -> None:
    archive = image.root.with_name(image.root.name + ".tar")
    shutil.rmtree(image.root, ignore_errors=True)
    if archive.exists():
        image.root.mkdir()
        subprocess.run(["tar", "-C", image.root, "-xf", archive], check=True)
    else:
        included = "--include=ca-certificates,python3,python3-venv"
        subprocess.run(
            ["debootstrap", "--variant=minbase", included, "bookworm", image.root, _mirror()],
            stdout=subprocess.DEVNULL,
            check=True,
        )
        with tarfile.open(archive, "w") as tar:
            tar.add(image.root, ".")
    _share_way_to_registries(image)
    for name in MOUNTED:
        subprocess.run(["mount", "--rbind", f"/{name}", image.root / name], check=True)
    image.environment["PATH"] = f"{PYTHON}/bin:/usr/local/sbin:/usr/local/bin:/usr/sbin:/usr/bin:/sbin:/bin"
    subprocess.run([*image.enter(), "python3", "-m", "venv", PYTHON], check=True)


def _mirror() -> str:
    """Where this machine itself gets Debian's packages."""
    for path in Path("/etc/apt/sources.list.d").glob("*.sources"):
        for line in path.read_text().splitlines():
            if line.startswith("URIs:"):
                return line.split()[1]
    sys.exit("run_dockerfile: found no Debian mirror in /etc/apt/sources.list.d")


def _share_way_to_registries(image: Image) -> None:
    """Give the image what this machine needs to reach package registries: sources, names, certificates."""
    etc = image.root / "etc"
    (etc / "apt/sources.list").write_text("")
    shutil.copytree("/etc/apt/sources.list.d", etc / "apt/sources.list.d", dirs_exist_ok=True)
    for name in ("resolv.conf", "hosts", "pip.conf", "ssl/certs/ca-certificates.crt"):
        if Path("/etc", name).exists():
            shutil.copy(Path("/etc", name), etc / name)


def _copy(image: Image, source: str, target: str) -> None:
    ignored = Ignored((PROJECT / ".dockerignore").read_text())
    origin = PROJECT / source
    destination = Path(image.folder, target)
    files = [origin] if origin.is_file() else [path for path in origin.rglob("*") if path.is_file()]
    kept = [path for path in files if not ignored(path.relative_to(PROJECT).as_posix())]
    if not kept:
        raise FileNotFoundError(f"COPY {source}: the build context has no such file")
    for path in kept:
        inside = destination / (path.name if origin.is_file() else path.relative_to(origin))
        place = image.root / inside.relative_to("/")
        place.parent.mkdir(parents=True, exist_ok=True)
        shutil.copy2(path, place)


def _start(image: Image, steps: list[Instruction]) -> None:
    by_name = {step.name: step for step in steps}
    script = STARTING.format(
        enter=shlex.join(image.enter()),
        command=shlex.join(by_name["CMD"].command),
        check=shlex.join(health_command(by_name["HEALTHCHECK"])),
        start=int(time.time()),
        limit=SECONDS_TO_BECOME_HEALTHY,
    )
    print(f"starting {by_name['CMD'].value} as {image.user}", flush=True)
    # its own processes and its own network: nothing is left behind, and nothing can be reached
    own = ["--net", "--pid", "--fork", "--kill-child", f"--mount-proc={image.root / 'proc'}"]
    subprocess.run(["unshare", *own, "bash", "-c", script], check=True)


def _unmount(root: Path) -> None:
    mounts = [line.split()[1] for line in Path("/proc/mounts").read_text().splitlines()]
    for name in MOUNTED:
        if str(root / name) in mounts:
            subprocess.run(["umount", "--lazy", root / name], check=True)


if __name__ == "__main__":
    main()
