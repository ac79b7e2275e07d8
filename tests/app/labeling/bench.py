"""A labelling session between a log and workers that the test holds in its hands."""

from collections.abc import Callable
from dataclasses import dataclass, field

import numpy as np

from app.confidence.assessment import Assessed, Assessment
from app.labeling.moves.history import replay
from app.labeling.moves.permissions import Wanted
from app.labeling.scene.known_object import KnownObject
from app.labeling.session import LabelingSession
from app.labeling.session_state import SessionState
from app.labeling.snaps.find import SearchOrder
from app.labeling.snaps.request import Submit
from app.labeling.snaps.snap_exchange import SnapFrames, SnapOrder, SnapResult
from app.storage.event_log import NewEvent
from app.storage.tables import Condition, EstimateRow, Method
from app.workers.jobs import Proposals
from app.workers.pool import SnapError
from registration_core import Ambiguity, Certificates, Check, Estimate, Hypothesis
from registration_core.geometry import pose

START = pose.exp([0.1, 0.2, 0.8, 0.3, -0.2, 0.1])
FRAMES = (11, 12)
PIVOT = np.array([0.02, -0.01, 0.03])


def shifted(amount: float, axis: int = 0) -> np.ndarray:
    twist = np.zeros(6)
    twist[axis] = amount
    return START @ pose.exp(twist)


class Log:
    """Keeps what is recorded; or breaks."""

    def __init__(self) -> None:
        self.events: list[NewEvent] = []
        self.estimates: list[EstimateRow] = []
        self.broken = False
        self.watch: Callable[[], object] = lambda: None

    def __call__(self, event: NewEvent, estimate: EstimateRow | None = None) -> None:
        self.watch()
        if self.broken:
            raise OSError("no space left")
        self.events.append(event)
        if estimate is not None:
            self.estimates.append(estimate)

    @property
    def kinds(self) -> list[str]:
        return [event.kind for event in self.events]


@dataclass
class RequestedSnap:
    """A snap that a session asked for, moved on by hand."""

    order: SnapOrder
    progress: Callable[[float], None]
    end: Callable[[SnapResult | SnapError], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True


@dataclass
class Workers:
    """Takes orders and does nothing by itself."""

    snaps: list[RequestedSnap] = field(default_factory=list)

    def __call__(
        self,
        order: SnapOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[SnapResult | SnapError], None],
    ) -> Callable[[], None]:
        self.snaps.append(RequestedSnap(order, on_progress, on_end))
        return self.snaps[-1].cancel


@dataclass
class RequestedSearch:
    """A search that a session asked for, moved on by hand."""

    order: SearchOrder
    progress: Callable[[float], None]
    end: Callable[[Proposals | SnapError], None]
    cancelled: bool = False

    def cancel(self) -> None:
        self.cancelled = True


@dataclass
class Searchers:
    """Takes searches and does nothing by itself."""

    searches: list[RequestedSearch] = field(default_factory=list)

    def __call__(
        self,
        order: SearchOrder,
        on_progress: Callable[[float], None],
        on_end: Callable[[Proposals | SnapError], None],
    ) -> Callable[[], None]:
        self.searches.append(RequestedSearch(order, on_progress, on_end))
        return self.searches[-1].cancel


CHECK = Check(pixels=400, seen=0.9, match=0.96, behind=0.01, behind_by=0.014, before=0.0, before_by=0.0)
SURE = Certificates(observably_correct=True, non_degenerate=True, check=CHECK, unused=())


def thought(verdict: Assessed, confidence: float) -> Assessment:
    return Assessment(verdict, ("because",), confidence, risk=0.02, threshold=0.8)


def result(
    T: np.ndarray,
    confidence: float = 0.9,
    verdict: Assessed = "accept",
    certificates: Certificates = SURE,
) -> SnapResult:
    estimate = Estimate(
        T_camera_object=T,
        confidence=confidence,
        covariance=np.eye(6) * 1e-6,
        hypotheses=(Hypothesis(T, 0.7), Hypothesis(START, 0.3)),
        seconds=0.25,
        evaluations=1234,
        converged=True,
        certificates=certificates,
        ambiguities=(Ambiguity("free motion", "turn", (0.0, 0.0, 1.0), 0.4),),
        seed=5,
        hardware="a test machine",
    )
    return SnapResult(estimate, T, 3, thought(verdict, confidence))


class Bench:
    """A session between a log and workers."""

    def __init__(
        self,
        state: str = "open",
        condition: Condition = "snap",
        in_study: bool = False,
        request_snap: Submit[SnapOrder, SnapResult] | None = None,
        method: Method = "default",
    ) -> None:
        self.log = Log()
        self.workers = Workers()
        self.searchers = Searchers()
        self.others: tuple[int, ...] = ()
        """Frames that are not used and see the object."""
        self.session = LabelingSession(
            registration_id=7,
            history=replay(START, ()),
            state=state,
            frame_id=FRAMES[0],
            frame_ids=FRAMES,
            pivot=PIVOT,
            condition=condition,
            same_pose=lambda a, b: bool(np.allclose(a, b, atol=0.005)),
            record_event=self.log,
            request_snap=request_snap or self.workers,
            request_search=self.searchers,
            choose_frames=self.choose_frames,
            in_study=in_study,
            method=method,
        )

    def choose_frames(
        self, shown: int, T_world_object: np.ndarray, known: tuple[KnownObject, ...], wanted: Wanted
    ) -> SnapFrames:
        """All frames, where the session is free to use them."""
        used = wanted if isinstance(wanted, tuple) else FRAMES if wanted == "auto" else (shown,)
        return SnapFrames(used, self.others)

    @property
    def state(self) -> SessionState:
        return self.session.snapshot()

    def drag(self, *way: np.ndarray) -> None:
        self.session.start_drag()
        for T in way:
            self.session.drag_to(T)
        self.session.end_drag()
