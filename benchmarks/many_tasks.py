"""The home page of 10,000 tasks: seconds that its requests take, one after the other."""

import asyncio
import time
from collections.abc import Sequence
from pathlib import Path

from sqlalchemy import select

from app.resources import DEMO_SCENES
from app.storage.tables import Frame, Object, Registration, Scene, Task, User
from benchmarks.figures import Figure, Target
from benchmarks.operators import Operator, signed_in_operators
from benchmarks.server import RunningServer, database_of, server_on

TITLE = "The home page of 10,000 tasks"
TARGET = Target(1.0)
SCENES = 2000
OBJECTS = 5
"""Of each scene, and so many tasks."""
REQUESTS = (
    "/api/me",
    "/api/datasets?limit=200",
    "/api/tasks?limit=48",
    "/api/tasks/next",
)
"""What the page asks for before it shows its cards."""
SLOWEST = ("/api/tasks?limit=48&state=submitted&after=9000", "/api/tasks?limit=48&state=skipped")
"""Filters that look at nearly all tasks before they find some, or none."""


def run(folder: Path, quick: bool) -> list[Figure]:
    """A server on the demo scenes."""
    with server_on(folder, [DEMO_SCENES]) as server:
        return measure(server, quick)


def measure(server: RunningServer, quick: bool) -> list[Figure]:
    """The rows are written as an import would write them; of half the tasks, somebody has taken up each."""
    scenes = 10 if quick else SCENES
    _add_scenes(server.state_dir, scenes)
    return asyncio.run(_measure(server, scenes * OBJECTS))


def _add_scenes(state: Path, count: int) -> None:
    with database_of(state) as database, database.write() as session:
        known = session.scalars(select(Frame)).first()
        objects = session.scalars(select(Object).limit(OBJECTS)).all()
        user = User(name="busy", role="operator")
        session.add(user)
        assert known is not None
        copied = {
            column.key: getattr(known, column.key)
            for column in Frame.__table__.columns
            if column.key not in {"id", "scene_id"}
        }
        for number in range(count):
            scene = Scene(
                dataset_id=objects[0].dataset_id, split="train", bop_scene_id=number, label=f"scene {number}"
            )
            frame = Frame(**copied, scene=scene)
            session.add_all([scene, frame])
            session.flush()
            for item in objects:
                task = Task(
                    scene_id=scene.id,
                    object_id=item.id,
                    instance=0,
                    mode="accurate",
                    condition="snap",
                    frame_id=frame.id,
                    T_world_object_start=known.T_world_camera,
                )
                session.add(task)
                if number < count // 2:
                    session.add(Registration(task=task, user=user, state="submitted"))


async def _measure(server: RunningServer, tasks: int) -> list[Figure]:
    async with signed_in_operators(server, 1) as (operator,):
        await _seconds(operator, REQUESTS)  # the first of all loads what every later one has
        return [
            Figure("tasks added", tasks, ""),
            Figure("the page's requests", await _seconds(operator, REQUESTS), "s", TARGET),
            *[Figure(path, await _seconds(operator, [path]), "s", TARGET) for path in SLOWEST],
        ]


async def _seconds(operator: Operator, paths: Sequence[str]) -> float:
    began = time.perf_counter()
    for path in paths:
        await operator.call("GET", path)
    return time.perf_counter() - began
