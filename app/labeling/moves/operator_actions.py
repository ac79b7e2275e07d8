"""The operator's hand on the object: drags, poses that are set, and the way back and forth."""

from collections.abc import Callable, Mapping

from app.labeling.moves.degrees_of_freedom import GizmoAxes, degrees_of_freedom
from app.labeling.moves.drag import Drag
from app.labeling.moves.history import Step, poser
from app.labeling.moves.pose_record import ActionError, Array, PoseRecord
from app.storage.event_log import NewEvent
from app.storage.faults import told
from app.storage.roles import Actor


class OperatorActions:
    """One at a time, as with the machine's hand: the session that owns it lets nobody else in.

    Args:
        record: The object's way.
        now: Tells the seconds that the paths of drags are written down with.
    """

    def __init__(self, record: PoseRecord, now: Callable[[], float]) -> None:
        self._record = record
        self._now = now
        self.axes: GizmoAxes = "object"
        """Along which the gizmo's arrows lie."""

    def take(self) -> None:
        """Take hold of the gizmo."""
        self._record.drag = Drag(self._record.history.current.T_world_object, self.axes, self._now)

    def let_go(self) -> bool:
        """Write the drag down; where that fails, it is taken back and said so.

        Returns:
            Whether it moved anything.
        """
        record = self._record
        drag, record.drag = record.drag, None
        event = None if drag is None else drag.event(record.pivot)
        if drag is None or event is None:
            return False
        try:
            record.push(event, Step(drag.T_now, dragged=True))
        except Exception as error:
            record.message = f"The last drag could not be saved and was taken back: {told(error)}."
            raise
        return True

    def put(self, T_world_object: Array, actor: Actor, detail: Mapping[str, object]) -> None:
        """Put the object at a pose."""
        before = self._record.history.current.T_world_object
        event = NewEvent(
            kind="set_pose",
            actor=actor,
            T_before=before.tolist(),
            T_after=T_world_object.tolist(),
            dof=degrees_of_freedom(before, T_world_object, self._record.pivot),
            detail=dict(detail),
        )
        self._record.push(event, Step(T_world_object, posed_by=poser(event.kind, detail)))

    def reset(self, actor: Actor) -> None:
        """Put the object back to where it began."""
        start = self._record.history.steps[0]
        self._record.push(self._record.move_event("reset", actor, start), start)

    def undo(self, actor: Actor) -> None:
        """Take the last change of pose back."""
        if not self._record.history.can_undo:
            raise ActionError("There is nothing to undo.")
        self._record.go_to(self._record.history.undone(), "undo", actor)

    def redo(self, actor: Actor) -> None:
        """Bring back what was undone last."""
        if not self._record.history.can_redo:
            raise ActionError("There is nothing to redo.")
        self._record.go_to(self._record.history.redone(), "redo", actor)
