"""The database's tables. Poses are 4x4 nested lists, metres; times are UTC; files are hashes in the store."""

from datetime import UTC, datetime
from typing import Any, Literal

from sqlalchemy import (
    JSON,
    BigInteger,
    DateTime,
    Dialect,
    Float,
    ForeignKey,
    Index,
    String,
    TypeDecorator,
    UniqueConstraint,
    column,
    func,
    select,
    table,
)
from sqlalchemy.orm import (
    DeclarativeBase,
    Mapped,
    column_property,
    joinedload,
    mapped_column,
    query_expression,
    relationship,
    undefer,
    with_expression,
)

Pose = list[list[float]]
Mode = Literal["accurate", "quick"]
Condition = Literal[
    "manual", "snap", "paper snap", "auto", "three points", "click-to-place", "live snap", "find it"
]
"""What a task may be done with: no machine, one that is asked, one that does more when it is sure; or, where
studies compare techniques, the gizmo, Snap, and this one. `paper snap` is Snap by the paper's filter."""
FrameUse = Literal["auto", "current"]
"""The frames that a snap uses: those that see the object, or the one that is shown alone."""
Method = Literal["default", "paper"]
"""What a snap is computed with: the fast default, or the particle filter of the paper."""


class UtcDateTime(TypeDecorator[datetime]):
    """A moment with its time zone, also on databases that keep none."""

    impl = DateTime(timezone=True)
    cache_ok = True

    def process_result_value(self, value: datetime | None, dialect: Dialect) -> datetime | None:
        """Mark what comes back without a zone as UTC."""
        return value.replace(tzinfo=UTC) if value is not None and value.tzinfo is None else value


def utc_now() -> datetime:
    """The present moment, UTC."""
    return datetime.now(UTC)


class Base(DeclarativeBase):
    """Common base of all tables."""

    type_annotation_map = {  # noqa: RUF012 - read by SQLAlchemy
        dict[str, Any]: JSON(none_as_null=True),
        list[Any]: JSON(none_as_null=True),
        Pose: JSON(none_as_null=True),
        datetime: UtcDateTime,
    }


class User(Base):
    """A person who may sign in."""

    __tablename__ = "users"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(100), unique=True)
    role: Mapped[str] = mapped_column(String(20))
    password_hash: Mapped[str | None] = mapped_column(String(200))
    created_at: Mapped[datetime] = mapped_column(default=utc_now)


class Credential(Base):
    """A secret that stands for a user: a login session, an API token or a one-time sign-in link."""

    __tablename__ = "credentials"
    id: Mapped[int] = mapped_column(primary_key=True)
    kind: Mapped[str] = mapped_column(String(20))
    secret_hash: Mapped[str] = mapped_column(String(64), unique=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"), index=True)
    name: Mapped[str] = mapped_column(String(100), default="")
    created_at: Mapped[datetime] = mapped_column(default=utc_now)
    expires_at: Mapped[datetime | None]
    user: Mapped[User] = relationship(lazy="joined")


class Dataset(Base):
    """A named collection of objects and scenes."""

    __tablename__ = "datasets"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(200), unique=True)
    risk: Mapped[float | None] = mapped_column(Float)
    """Share of wrong poses among those that the machine may accept; None: as the settings say."""
    warnings: Mapped[list[Any]] = mapped_column(default=list)
    """What looked odd when it was imported: `text`, `images` and whether a lead `accepted` it."""
    created_at: Mapped[datetime] = mapped_column(default=utc_now)
    calibration: Mapped["CalibrationRow | None"] = relationship(back_populates="dataset")


class CalibrationRow(Base):
    """What a dataset's own registrations have taught of the confidence; a dataset has one at most."""

    __tablename__ = "calibrations"
    id: Mapped[int] = mapped_column(primary_key=True)
    dataset_id: Mapped[int] = mapped_column(ForeignKey("datasets.id"), unique=True)
    algorithm: Mapped[str] = mapped_column(String(12))
    """Of the estimates: it says nothing of those of another one."""
    stretch: Mapped[float] = mapped_column(Float)
    shift: Mapped[float] = mapped_column(Float)
    """Both of the log-odds."""
    confidences: Mapped[list[Any]]
    """Corrected ones, one for each registration."""
    right: Mapped[list[Any]]
    gains: Mapped[dict[str, Any]]
    """What it gained, cross-validated, as it was printed."""
    created_at: Mapped[datetime] = mapped_column(default=utc_now)
    dataset: Mapped[Dataset] = relationship(back_populates="calibration")


class Object(Base):
    """A known object of a dataset."""

    __tablename__ = "objects"
    __table_args__ = (UniqueConstraint("dataset_id", "obj_id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    dataset_id: Mapped[int] = mapped_column(ForeignKey("datasets.id"))
    obj_id: Mapped[int]
    name: Mapped[str] = mapped_column(String(200))
    mesh_hash: Mapped[str] = mapped_column(String(64))
    mesh_format: Mapped[str] = mapped_column(String(10))
    texture_hash: Mapped[str | None] = mapped_column(String(64))
    """The picture of the mesh's texture, where it has one."""
    model_hash: Mapped[str] = mapped_column(String(64))
    """Of mesh and symmetries as they were imported."""
    diameter: Mapped[float] = mapped_column(Float)
    symmetries: Mapped[dict[str, Any]]
    """The present ones: those of the newest `SymmetryVersion`."""
    symmetries_version: Mapped[int] = mapped_column(default=1)
    suggestions_open: Mapped[bool] = mapped_column(default=False)
    """Whether it came without symmetries, some are suggested, and nobody has decided yet."""


class SymmetryVersion(Base):
    """What an object's symmetries were, from a time on. Append-only: a trigger refuses changes."""

    __tablename__ = "symmetry_versions"
    __table_args__ = (UniqueConstraint("object_id", "version"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    object_id: Mapped[int] = mapped_column(ForeignKey("objects.id"))
    version: Mapped[int]
    """From 1 on, which is what was imported."""
    symmetries: Mapped[dict[str, Any]]
    axes: Mapped[list[Any] | None]
    """The axes that somebody chose, which the symmetries were made of; None where they were imported."""
    restores: Mapped[int | None]
    """The version that this one brings back, itself no such one."""
    user_id: Mapped[int | None] = mapped_column(ForeignKey("users.id"))
    """Who decided; None for the import."""
    utc: Mapped[datetime] = mapped_column(default=utc_now)
    user: Mapped[User | None] = relationship()


class SymmetrySuggestions(Base):
    """The axes of symmetry that were found on a mesh, whichever objects have it."""

    __tablename__ = "symmetry_suggestions"
    mesh_hash: Mapped[str] = mapped_column(String(64), primary_key=True)
    suggestions: Mapped[list[Any]]
    """Best first: axis, point, fold and residual, metres."""
    utc: Mapped[datetime] = mapped_column(default=utc_now)


class Scene(Base):
    """One rigid world: frames whose poses in it are known."""

    __tablename__ = "scenes"
    __table_args__ = (UniqueConstraint("dataset_id", "split", "bop_scene_id", "label"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    dataset_id: Mapped[int] = mapped_column(ForeignKey("datasets.id"))
    split: Mapped[str] = mapped_column(String(50))
    bop_scene_id: Mapped[int]
    label: Mapped[str] = mapped_column(String(200))
    dataset: Mapped[Dataset] = relationship()
    frames: Mapped[list["Frame"]] = relationship(order_by="Frame.image_id", back_populates="scene")


class Frame(Base):
    """One RGB-D image; `depth_scale` turns its raw depth into millimetres."""

    __tablename__ = "frames"
    __table_args__ = (UniqueConstraint("scene_id", "image_id"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    scene_id: Mapped[int] = mapped_column(ForeignKey("scenes.id"))
    image_id: Mapped[int]
    color_hash: Mapped[str | None] = mapped_column(String(64))
    depth_hash: Mapped[str] = mapped_column(String(64))
    depth_scale: Mapped[float] = mapped_column(Float)
    width: Mapped[int]
    height: Mapped[int]
    fx: Mapped[float] = mapped_column(Float)
    fy: Mapped[float] = mapped_column(Float)
    cx: Mapped[float] = mapped_column(Float)
    cy: Mapped[float] = mapped_column(Float)
    T_world_camera: Mapped[Pose]
    posed: Mapped[bool]
    scene: Mapped[Scene] = relationship(back_populates="frames")


_same = table("tasks", column("scene_id"), column("object_id"), column("instance")).alias("same")


class Task(Base):
    """One instance of an object in a scene, to be registered under a mode and a condition."""

    __tablename__ = "tasks"
    __table_args__ = (UniqueConstraint("scene_id", "object_id", "instance", "mode", "condition"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    scene_id: Mapped[int] = mapped_column(ForeignKey("scenes.id"))
    object_id: Mapped[int] = mapped_column(ForeignKey("objects.id"))
    instance: Mapped[int]
    mode: Mapped[str] = mapped_column(String(20))
    condition: Mapped[str] = mapped_column(String(20))
    frame_id: Mapped[int] = mapped_column(ForeignKey("frames.id"))
    T_world_object_start: Mapped[Pose]
    T_world_object_reference: Mapped[Pose | None]
    is_for_studies: Mapped[bool] = mapped_column(default=False)
    """Only studies ask for it: nobody else is shown it."""
    method: Mapped[str] = mapped_column(String(20), default="default")
    """What Snap computes with unless the operator chooses, where the condition lets them."""
    created_at: Mapped[datetime] = mapped_column(default=utc_now)
    scene: Mapped[Scene] = relationship()
    object: Mapped[Object] = relationship()
    frame: Mapped[Frame] = relationship()
    registrations: Mapped[list["Registration"]] = relationship(back_populates="task")
    instances: Mapped[int] = column_property(
        select(func.max(_same.c.instance) + 1)
        .where(_same.c.scene_id == scene_id, _same.c.object_id == object_id)
        .scalar_subquery(),
        deferred=True,
    )
    """How often the object is in the scene, as far as tasks of any mode and condition say; has to be
    undeferred."""

    @property
    def name(self) -> str:
        """What people call it everywhere: "mug", or "mug #2" where the object is in the scene several times.

        `object` and `instances` have to be loaded: see `NAMED`.
        """
        return f"{self.object.name} #{self.instance + 1}" if self.instances > 1 else self.object.name


class Registration(Base):
    """One operator's work on one task: whose it is and how it ended. What happened is in its events."""

    __tablename__ = "registrations"
    # SQLite would give the number of an erased registration to the next one, under which pages, logs and
    # exports of before still know the erased.
    __table_args__ = (UniqueConstraint("task_id", "user_id"), {"sqlite_autoincrement": True})
    id: Mapped[int] = mapped_column(primary_key=True)
    task_id: Mapped[int] = mapped_column(ForeignKey("tasks.id"))
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    state: Mapped[str] = mapped_column(String(20), default="open")
    T_world_object: Mapped[Pose | None]
    skip_reason: Mapped[str | None] = mapped_column(String(20))
    created_at: Mapped[datetime] = mapped_column(default=utc_now)
    submitted_at: Mapped[datetime | None]
    task: Mapped[Task] = relationship(back_populates="registrations")
    user: Mapped[User] = relationship()
    last_assessment: Mapped[dict[str, Any] | None] = query_expression()
    """That of its newest estimate, where a query asks for it by `LAST_ASSESSMENT`."""
    ended_by: Mapped[int | None] = query_expression()
    """Id of the event that ended it last, where a query asks for it by `ENDED_BY`."""


class Event(Base):
    """One thing that an operator or the machine did. Append-only: a trigger refuses changes."""

    __tablename__ = "events"
    __table_args__ = (
        UniqueConstraint("registration_id", "sequence"),
        Index("ix_events_snap_id", "snap_id"),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    registration_id: Mapped[int] = mapped_column(ForeignKey("registrations.id"))
    sequence: Mapped[int]
    kind: Mapped[str] = mapped_column(String(30))
    actor: Mapped[str] = mapped_column(String(20))
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    utc: Mapped[datetime]
    monotonic_seconds: Mapped[float] = mapped_column(Float)
    boot_id: Mapped[str] = mapped_column(String(40))
    duration_seconds: Mapped[float | None] = mapped_column(Float)
    T_before: Mapped[Pose | None]
    T_after: Mapped[Pose | None]
    dof: Mapped[list[Any] | None]
    path: Mapped[list[Any] | None]
    snap_id: Mapped[str | None] = mapped_column(String(40))
    detail: Mapped[dict[str, Any]] = mapped_column(default=dict)


class EstimateRow(Base):
    """One result of a snap with all that is needed to repeat it. Append-only: a trigger refuses changes."""

    __tablename__ = "estimates"
    id: Mapped[int] = mapped_column(primary_key=True)
    snap_id: Mapped[str] = mapped_column(String(40), unique=True)
    registration_id: Mapped[int] = mapped_column(ForeignKey("registrations.id"), index=True)
    frame_id: Mapped[int] = mapped_column(ForeignKey("frames.id"))
    T_world_object_start: Mapped[Pose]
    T_world_object: Mapped[Pose]
    T_camera_object: Mapped[Pose]
    confidence: Mapped[float] = mapped_column(Float)
    covariance: Mapped[list[Any]]
    hypotheses: Mapped[list[Any]]
    ambiguities: Mapped[list[Any] | None]
    certificates: Mapped[dict[str, Any] | None]
    assessment: Mapped[dict[str, Any] | None]
    """What the operator was told: verdict, reasons, and the confidence after the dataset's calibration."""
    converged: Mapped[bool]
    seed: Mapped[int] = mapped_column(BigInteger)
    config: Mapped[dict[str, Any]]
    start_spread: Mapped[list[Any] | None]
    known_objects: Mapped[list[Any] | None]
    symmetries_version: Mapped[int | None]
    """Of the object's symmetries; None where an older version of Snap6D did not keep it."""
    used_frames: Mapped[list[Any] | None]
    """Ids of the frames that it was found in, best first; None where an older version did not say: `frame_id`
    alone. The pose in camera axes and the covariance are of `frame_id`, used or not."""
    other_frames: Mapped[list[Any] | None]
    """What frames that were not used say of it; None where an older version did not ask."""
    version: Mapped[str] = mapped_column(String(40))
    algorithm: Mapped[str | None] = mapped_column(String(12))
    """`registration_core.ALGORITHM` where it was computed; None where an older version did not say."""
    hardware: Mapped[str] = mapped_column(String(200))
    seconds: Mapped[float] = mapped_column(Float)
    evaluations: Mapped[int]
    utc: Mapped[datetime] = mapped_column(default=utc_now)


class Export(Base):
    """A dataset export: a job and, when done, the zip in the file store."""

    __tablename__ = "exports"
    id: Mapped[int] = mapped_column(primary_key=True)
    dataset_id: Mapped[int] = mapped_column(ForeignKey("datasets.id"))
    format: Mapped[str] = mapped_column(String(20))
    """What it is given as: a name of `app.export.formats`."""
    state: Mapped[str] = mapped_column(String(20), default="queued")
    progress: Mapped[float] = mapped_column(Float, default=0.0)
    message: Mapped[str] = mapped_column(String(2000), default="")
    choice: Mapped[dict[str, Any]] = mapped_column(default=lambda: {"scene_ids": None, "without": []})
    """The part that is exported: rows of `scenes`, or null for all, and registrations that are left out."""
    failures: Mapped[list[Any]] = mapped_column(default=list)
    """Objects that did not pass the gate, as `app.export.job.told_failures` tells of them."""
    file_hash: Mapped[str | None] = mapped_column(String(64))
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    created_at: Mapped[datetime] = mapped_column(default=utc_now)
    dataset: Mapped[Dataset] = relationship()


class Study(Base):
    """A study: who is to do what in which order, and what they are told."""

    __tablename__ = "studies"
    id: Mapped[int] = mapped_column(primary_key=True)
    name: Mapped[str] = mapped_column(String(200), unique=True)
    plan: Mapped[dict[str, Any]]
    """As JSON: conditions, modes, groups and their sizes, tasks, practice, texts, questions, breaks."""
    seed: Mapped[int] = mapped_column(BigInteger)
    is_simulated: Mapped[bool] = mapped_column(default=False)
    state: Mapped[str] = mapped_column(String(20), default="open")
    """open or closed."""
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    created_at: Mapped[datetime] = mapped_column(default=utc_now)
    participants: Mapped[list["Participant"]] = relationship(
        order_by="Participant.id", back_populates="study"
    )


class Participant(Base):
    """One operator of a study: a code and a group, no name."""

    __tablename__ = "participants"
    __table_args__ = (UniqueConstraint("study_id", "code"), UniqueConstraint("user_id"))
    id: Mapped[int] = mapped_column(primary_key=True)
    study_id: Mapped[int] = mapped_column(ForeignKey("studies.id"), index=True)
    user_id: Mapped[int] = mapped_column(ForeignKey("users.id"))
    """Stands for the participant in logs; a user of its own in each study."""
    code: Mapped[str] = mapped_column(String(20))
    group: Mapped[str] = mapped_column(String(40))
    row: Mapped[int]
    """Of the Latin square."""
    is_simulated: Mapped[bool] = mapped_column(default=False)
    consented_at: Mapped[datetime | None]
    finished_at: Mapped[datetime | None]
    withdrawn_at: Mapped[datetime | None]
    answers: Mapped[dict[str, Any] | None]
    """To what the study asks."""
    study: Mapped[Study] = relationship(back_populates="participants")
    trials: Mapped[list["Trial"]] = relationship(order_by="Trial.place", back_populates="participant")


class Trial(Base):
    """One task that a participant is to do, in its place; the registration is that of the user."""

    __tablename__ = "trials"
    __table_args__ = (
        UniqueConstraint("participant_id", "place"),
        UniqueConstraint("participant_id", "task_id"),
    )
    id: Mapped[int] = mapped_column(primary_key=True)
    participant_id: Mapped[int] = mapped_column(ForeignKey("participants.id"))
    place: Mapped[int]
    task_id: Mapped[int] = mapped_column(ForeignKey("tasks.id"), index=True)
    is_practice: Mapped[bool]
    participant: Mapped[Participant] = relationship(back_populates="trials")
    task: Mapped[Task] = relationship()


class OfflineSnap(Base):
    """What a snap gives from a pose that an operator passed through, computed afterwards."""

    __tablename__ = "offline_snaps"
    __table_args__ = (UniqueConstraint("registration_id", "seconds", "input_hash"),)
    id: Mapped[int] = mapped_column(primary_key=True)
    registration_id: Mapped[int] = mapped_column(ForeignKey("registrations.id"))
    seconds: Mapped[float] = mapped_column(Float)
    """Of the trace, where the pose was."""
    T_world_object_start: Mapped[Pose]
    input_hash: Mapped[str] = mapped_column(String(64), index=True)
    """Of pose, object, frame, configuration and algorithm: all that the result depends on. Equal inputs, such
    as the poses of an object that rests, are computed once."""
    method: Mapped[str] = mapped_column(String(20), default="default")
    """Of that configuration."""
    config: Mapped[dict[str, Any]]
    seed: Mapped[int] = mapped_column(BigInteger)
    T_world_object: Mapped[Pose | None]
    """None where the snap failed."""
    confidence: Mapped[float | None] = mapped_column(Float)
    message: Mapped[str] = mapped_column(String(2000), default="")
    snap_seconds: Mapped[float] = mapped_column(Float)
    """As measured."""
    evaluations: Mapped[int]
    version: Mapped[str] = mapped_column(String(40))
    algorithm: Mapped[str | None] = mapped_column(String(12))
    """As that of an estimate."""
    hardware: Mapped[str] = mapped_column(String(200))


NAMED = (joinedload(Task.object), undefer(Task.instances))
"""Options of queries for tasks: what `Task.name` needs."""

LAST_ASSESSMENT = with_expression(
    Registration.last_assessment,
    select(EstimateRow.assessment)
    .where(EstimateRow.registration_id == Registration.id)
    .order_by(EstimateRow.id.desc())
    .limit(1)
    .scalar_subquery(),
)
"""An option of queries for registrations: what was thought of the machine's last estimate of each."""

ENDED_BY = with_expression(
    Registration.ended_by,
    select(func.max(Event.id))
    .where(Event.registration_id == Registration.id, Event.kind.in_(("submit", "skip")))
    .scalar_subquery(),
)
"""An option of queries for registrations: which of them is newer, whatever the clock was set to meanwhile."""

OUTSIDE_STUDIES = Registration.user_id.not_in(select(Participant.user_id))
"""Registrations of the ordinary work, which what participants of studies do never mixes with."""
