"""Where the gizmo's handles are on the screen, and how to drag one with the mouse.

The numbers are those of viser's gizmo; pixel positions come from the hook that viser keeps for its own tests.
"""

from dataclasses import dataclass

import numpy as np
from playwright.sync_api import Frame, Page

GIZMO = "/object"
NODES = [GIZMO, "/cloud"]
"""What every view shows."""
AXES = {"x": 0, "y": 1, "z": 2}
ARROW, PLANE, ARC = 0.9, 0.255, 0.65
"""Where arrows, squares and arcs are grasped, as shares of the gizmo's scale."""

PIXEL = """([name, local]) => {
  const viser = window.__viserMutable, node = viser.nodeRefFromName[name];
  node.updateWorldMatrix(true, false);
  viser.camera.updateMatrixWorld();
  const at = node.position.clone().set(...local).applyMatrix4(node.matrixWorld).project(viser.camera);
  const box = viser.canvas.getBoundingClientRect();
  return [box.left + (at.x + 1) / 2 * box.width, box.top + (1 - at.y) / 2 * box.height];
}"""

PLACE = "name => window.__viserMutable.nodeRefFromName[name].matrix.elements.slice(12, 15)"
"""A drag in the browser moves the matrix alone, what the server says the position as well."""
OBJECT_AT = """([name, point]) => {
  const at = window.__viserMutable.nodeRefFromName[name].matrix.elements.slice(12, 15);
  return Math.hypot(...at.map((x, i) => x - point[i])) < 0.0005;
}"""

COUNT_PICTURES = """() => {
  window.picturesLeft = 3;
  const count = () => (window.picturesLeft -= 1) > 0 && requestAnimationFrame(count);
  requestAnimationFrame(count);
}"""

LOOK_AGAIN = "() => { window.stillness = { times: 0, camera: null }; }"
STANDS_STILL = """() => {
  document.querySelectorAll(".mantine-Notification-closeButton").forEach(button => button.click());
  const camera = window.__viserMutable.camera.matrixWorld.elements.map(x => x.toFixed(4)).join();
  const times = camera === window.stillness.camera ? window.stillness.times + 1 : 0;
  window.stillness = { times, camera };
  return times > 5;
}"""

DRAWN = """names => names.every(name => {
  const node = window.__viserMutable?.nodeRefFromName[name];
  return node && !node.userData.isOld;
})"""
CALL_OLD = """names => {
  for (const name of names) window.__viserMutable.nodeRefFromName[name].userData.isOld = true;
}"""


@dataclass(frozen=True)
class Handle:
    """A part of the gizmo to take hold of: "tx" an arrow, "pxy" a square, "rz" an arc."""

    name: str
    scale: float
    """The gizmo's scale, metres."""

    @property
    def grip(self) -> np.ndarray:
        """Where it is grasped (3,), in the gizmo's frame."""
        kind, axes = self.name[0], [AXES[axis] for axis in self.name[1:]]
        unit = np.eye(3)
        if kind == "t":
            return ARROW * self.scale * unit[axes[0]]
        if kind == "p":
            return PLANE * self.scale * (unit[axes[0]] + unit[axes[1]])
        first, second = (axis for axis in range(3) if axis != axes[0])
        return ARC * self.scale * (unit[first] + unit[second]) / np.sqrt(2)

    def moved_grip(self, amount: float) -> np.ndarray:
        """Where the grip is after moving the handle by `amount` metres or radians."""
        axes = [AXES[axis] for axis in self.name[1:]]
        unit = np.eye(3)
        if self.name[0] == "r":
            axis = unit[axes[0]]
            along = axis * (axis @ self.grip)
            across = self.grip - along
            return along + np.cos(amount) * across + np.sin(amount) * np.cross(axis, across)
        return self.grip + amount * sum(unit[axis] for axis in axes)


def view_frame(page: Page) -> Frame:
    """The 3-D view's document, when its scene is there and the camera stands still."""
    element = page.wait_for_selector("#view")
    assert element is not None
    frame = element.content_frame()
    assert frame is not None
    frame.wait_for_function(DRAWN, arg=NODES)
    wait_for_camera(frame)
    return frame


def wait_for_camera(frame: Frame) -> None:
    """Return when the camera stands still; closes the notice on software rendering, which swallows drags."""
    frame.evaluate(LOOK_AGAIN)
    frame.wait_for_function(STANDS_STILL, polling=100)


def wait_for_picture(frame: Frame) -> None:
    """Return when the 3-D view has drawn what it knows, and looked for what is under the pointer."""
    frame.evaluate(COUNT_PICTURES)
    frame.wait_for_function("() => window.picturesLeft <= 0")


def place_of_object(frame: Frame) -> np.ndarray:
    """Where the view has the gizmo (3,), in the world."""
    return np.array(frame.evaluate(PLACE, GIZMO))


def wait_for_object(frame: Frame, point: np.ndarray) -> None:
    """Return when the view has the gizmo at this point (3,) of the world."""
    frame.wait_for_function(OBJECT_AT, arg=[GIZMO, point.tolist()])


def expect_new_view(frame: Frame) -> None:
    """From now on, what the view shows counts only once it was drawn anew, as after a lost connection."""
    frame.evaluate(CALL_OLD, NODES)


def pixel(page: Page, frame: Frame, local: np.ndarray) -> np.ndarray:
    """The page's pixel (2,) of a point in the gizmo's frame."""
    element = frame.frame_element().bounding_box()
    assert element is not None
    inside = frame.evaluate(PIXEL, [GIZMO, local.tolist()])
    return np.array([inside[0] + element["x"], inside[1] + element["y"]])


def take_hold(page: Page, frame: Frame, handle: Handle, amount: float) -> tuple[np.ndarray, np.ndarray]:
    """Press the mouse on a handle.

    Returns:
        Where it was pressed and where it leads to for `amount` metres or radians, pixels of the page (2,).
    """
    start, end = (pixel(page, frame, grip) for grip in (handle.grip, handle.moved_grip(amount)))
    page.mouse.move(*(start - 2))
    page.mouse.move(*start)
    wait_for_picture(frame)
    page.mouse.down()
    return start, end


def pull(page: Page, start: np.ndarray, end: np.ndarray, steps: int = 6) -> None:
    """Move the mouse, pressed at `start`, to `end`."""
    for step in range(1, steps + 1):
        page.mouse.move(*(start + (end - start) * step / steps))
