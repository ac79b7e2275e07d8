"""A camera is told of when it came somewhere new, seldom, and not on the thread that moves it."""

import threading

import pytest

from app.labeling.moves import camera_watch
from app.labeling.moves.camera_watch import Camera, CameraWatch
from tests.app.waiting import wait_until


class Listener:
    def __init__(self) -> None:
        self.told: list[tuple[Camera, float]] = []
        self.threads: set[int] = set()
        self.broken = False

    def __call__(self, camera: Camera, seconds: float) -> None:
        self.threads.add(threading.get_ident())
        self.told.append((camera, seconds))
        if self.broken:
            raise OSError("no space left")


@pytest.fixture(autouse=True)
def quick(monkeypatch: pytest.MonkeyPatch) -> None:
    monkeypatch.setattr(camera_watch, "SECONDS_BETWEEN_LOOKS", 0.05)


@pytest.fixture
def listener() -> Listener:
    return Listener()


def test_many_movements_are_told_once_with_where_they_led(listener):
    watch = CameraWatch(listener)
    for fov in range(100):
        watch.moved({"fov": float(fov)})
    wait_until(lambda: listener.told, "the camera")
    ((camera, seconds),) = listener.told
    assert camera == {"fov": 99.0} and seconds >= 0.05
    assert threading.get_ident() not in listener.threads
    watch.close()


def test_a_camera_that_stands_where_it_stood_is_not_told_again(listener):
    watch = CameraWatch(listener)
    watch.moved({"fov": 1.0})
    wait_until(lambda: len(listener.told) == 1, "the camera")
    watch.moved({"fov": 1.0})
    watch.moved({"fov": 2.0})
    wait_until(lambda: len(listener.told) == 2, "the camera elsewhere")
    assert [camera["fov"] for camera, _ in listener.told] == [1.0, 2.0]
    watch.close()


def test_what_could_not_be_written_down_is_logged_and_the_next_is_told(listener, caplog):
    listener.broken = True
    watch = CameraWatch(listener)
    watch.moved({"fov": 1.0})
    wait_until(lambda: "could not be written down" in caplog.text, "the complaint")
    watch.moved({"fov": 2.0})
    wait_until(lambda: len(listener.told) == 2, "the next")
    watch.close()


def test_a_closed_watch_tells_nothing(listener):
    before = set(threading.enumerate())
    watch = CameraWatch(listener)
    watch.moved({"fov": 1.0})
    watch.close()
    watch.moved({"fov": 2.0})
    assert set(threading.enumerate()) <= before
    assert listener.told == []
