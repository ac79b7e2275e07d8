"""The interaction log: every event and estimate of a dataset, as Parquet and as JSON lines.

Operators appear as codes, such as "operator-3", never by name.
"""

import json
from collections.abc import Callable, Iterator
from datetime import UTC, datetime
from itertools import islice
from pathlib import Path
from typing import Any

import pyarrow as pa
import pyarrow.parquet as pq
from sqlalchemy import Select, select
from sqlalchemy.orm import Session

from app.storage.tables import OUTSIDE_STUDIES, EstimateRow, Event, Frame, Object, Registration, Scene, Task

Record = dict[str, Any]

ROWS_AT_ONCE = 500
"""Rows held in memory: a drag's path can be long."""

MATRIX = pa.list_(pa.list_(pa.float64()))
TIME = pa.timestamp("us", tz="UTC")
JSON_TEXT = pa.string()

LOOSE_FIELDS = (
    *("detail", "hypotheses", "ambiguities", "certificates", "assessment"),
    *("config", "known_objects", "other_images"),
)
"""Without a fixed shape."""

CONTEXT_FIELDS = [
    ("registration_id", pa.int64()),
    ("task_id", pa.int64()),
    ("operator", pa.string()),
    ("split", pa.string()),
    ("scene_id", pa.int64()),
    ("obj_id", pa.int64()),
    ("instance", pa.int64()),
    ("mode", pa.string()),
    ("condition", pa.string()),
]

EVENTS = pa.schema(
    [
        *CONTEXT_FIELDS,
        ("sequence", pa.int64()),
        ("kind", pa.string()),
        ("actor", pa.string()),
        ("utc", TIME),
        ("monotonic_seconds", pa.float64()),
        ("boot_id", pa.string()),
        ("duration_seconds", pa.float64()),
        ("T_world_object_before", MATRIX),
        ("T_world_object_after", MATRIX),
        ("dof", pa.list_(pa.string())),
        ("path", MATRIX),
        ("snap_id", pa.string()),
        ("detail", JSON_TEXT),
    ]
)

ESTIMATES = pa.schema(
    [
        *CONTEXT_FIELDS,
        ("snap_id", pa.string()),
        ("image_id", pa.int64()),
        ("utc", TIME),
        ("T_world_object_start", MATRIX),
        ("T_world_object", MATRIX),
        ("T_camera_object", MATRIX),
        ("confidence", pa.float64()),
        ("covariance", MATRIX),
        ("hypotheses", JSON_TEXT),
        ("ambiguities", JSON_TEXT),
        ("certificates", JSON_TEXT),
        ("assessment", JSON_TEXT),
        ("converged", pa.bool_()),
        ("seed", pa.int64()),
        ("config", JSON_TEXT),
        ("start_spread", pa.list_(pa.float64())),
        ("known_objects", JSON_TEXT),
        ("symmetries_version", pa.int64()),
        ("used_images", pa.list_(pa.int64())),
        ("other_images", JSON_TEXT),
        ("version", pa.string()),
        ("algorithm", pa.string()),
        ("hardware", pa.string()),
        ("seconds", pa.float64()),
        ("evaluations", pa.int64()),
    ]
)


def write_interaction_log(session: Session, dataset_id: int, folder: Path) -> None:
    """Write `events` and `estimates` of all registrations of a dataset, submitted or not, into a folder."""
    folder.mkdir(parents=True, exist_ok=True)
    write_table(folder / "events", EVENTS, records(session, events_query(dataset_id), event_record))
    write_table(
        folder / "estimates", ESTIMATES, records(session, estimates_query(dataset_id), estimate_record)
    )


def write_table(stem: Path, schema: pa.Schema, rows: Iterator[Record]) -> None:
    """Write rows side by side as `stem.parquet` and `stem.jsonl`, a part of them at a time."""
    with (
        pq.ParquetWriter(stem.with_suffix(".parquet"), schema, compression="zstd") as table,
        stem.with_suffix(".jsonl").open("w", encoding="utf-8") as lines,
    ):
        while part := list(islice(rows, ROWS_AT_ONCE)):
            table.write_table(pa.Table.from_pylist([parquet_row(row, schema) for row in part], schema))
            lines.writelines(json.dumps(row, default=iso_text) + "\n" for row in part)


def parquet_row(row: Record, schema: pa.Schema) -> Record:
    """A record whose fields without a fixed shape are JSON texts."""
    loose = {name for name in LOOSE_FIELDS if name in schema.names}
    return row | {name: json.dumps(row[name], sort_keys=True) for name in loose}


def iso_text(value: object) -> str:
    """A moment as text, UTC."""
    assert isinstance(value, datetime)
    return value.astimezone(UTC).isoformat().replace("+00:00", "Z")


def records(
    session: Session, query: Select[*tuple[Any, ...]], record_of: Callable[..., Record]
) -> Iterator[Record]:
    """Rows of a query as records, read a part at a time."""
    for row in session.execute(query.execution_options(yield_per=ROWS_AT_ONCE)):
        yield record_of(*row)


def events_query(dataset_id: int) -> Select[*tuple[Any, ...]]:
    """Events in the order of registrations, each with what it belongs to."""
    return (
        select(Event, Registration, Task, Scene, Object)
        .join(Registration, Event.registration_id == Registration.id)
        .join(Task, Registration.task_id == Task.id)
        .join(Scene, Task.scene_id == Scene.id)
        .join(Object, Task.object_id == Object.id)
        .where(Scene.dataset_id == dataset_id, OUTSIDE_STUDIES)
        .order_by(Event.registration_id, Event.sequence)
    )


def estimates_query(dataset_id: int) -> Select[*tuple[Any, ...]]:
    """Estimates in the order of registrations, each with what it belongs to."""
    return (
        select(EstimateRow, Registration, Task, Scene, Object, Frame)
        .join(Registration, EstimateRow.registration_id == Registration.id)
        .join(Task, Registration.task_id == Task.id)
        .join(Scene, Task.scene_id == Scene.id)
        .join(Object, Task.object_id == Object.id)
        .join(Frame, EstimateRow.frame_id == Frame.id)
        .where(Scene.dataset_id == dataset_id, OUTSIDE_STUDIES)
        .order_by(EstimateRow.registration_id, EstimateRow.id)
    )


def event_record(
    event: Event, registration: Registration, task: Task, scene: Scene, known_object: Object
) -> Record:
    """One event; who acted is the event's user."""
    return context(registration, task, scene, known_object, event.user_id) | {
        "sequence": event.sequence,
        "kind": event.kind,
        "actor": event.actor,
        "utc": event.utc,
        "monotonic_seconds": event.monotonic_seconds,
        "boot_id": event.boot_id,
        "duration_seconds": event.duration_seconds,
        "T_world_object_before": event.T_before,
        "T_world_object_after": event.T_after,
        "dof": event.dof,
        "path": event.path,
        "snap_id": event.snap_id,
        "detail": event.detail,
    }


def estimate_record(
    estimate: EstimateRow,
    registration: Registration,
    task: Task,
    scene: Scene,
    known_object: Object,
    frame: Frame,
) -> Record:
    """One estimate with all that is needed to repeat it."""
    return context(registration, task, scene, known_object, registration.user_id) | {
        "snap_id": estimate.snap_id,
        "image_id": frame.image_id,
        "utc": estimate.utc,
        "T_world_object_start": estimate.T_world_object_start,
        "T_world_object": estimate.T_world_object,
        "T_camera_object": estimate.T_camera_object,
        "confidence": estimate.confidence,
        "covariance": estimate.covariance,
        "hypotheses": estimate.hypotheses,
        "ambiguities": estimate.ambiguities,
        "certificates": estimate.certificates,
        "assessment": estimate.assessment,
        "converged": estimate.converged,
        "seed": estimate.seed,
        "config": estimate.config,
        "start_spread": estimate.start_spread,
        "known_objects": estimate.known_objects,
        "symmetries_version": estimate.symmetries_version,
        **image_records(estimate, {one.id: one.image_id for one in scene.frames}),
        "version": estimate.version,
        "algorithm": estimate.algorithm,
        "hardware": estimate.hardware,
        "seconds": estimate.seconds,
        "evaluations": estimate.evaluations,
    }


def image_records(estimate: EstimateRow, image_ids: dict[int, int]) -> Record:
    """The images that an estimate was found in, and what others say of it; None as in the estimate."""
    used, others = estimate.used_frames, estimate.other_frames
    return {
        "used_images": None if used is None else [image_ids[frame_id] for frame_id in used],
        "other_images": None
        if others is None
        else [
            {"image_id": image_ids[one["frame_id"]], "share": one["share"], "agrees": one["agrees"]}
            for one in others
        ],
    }


def context(
    registration: Registration, task: Task, scene: Scene, known_object: Object, user_id: int
) -> Record:
    """What an event or an estimate belongs to, in the ids of the exported dataset."""
    return {
        "registration_id": registration.id,
        "task_id": task.id,
        "operator": operator_code(user_id),
        "split": scene.split,
        "scene_id": scene.bop_scene_id,
        "obj_id": known_object.obj_id,
        "instance": task.instance,
        "mode": task.mode,
        "condition": task.condition,
    }


def operator_code(user_id: int) -> str:
    """How a user is called in exported files."""
    return f"operator-{user_id}"
