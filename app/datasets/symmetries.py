"""Symmetries of objects: suggested once a mesh, decided by people, every decision kept as a version."""

from collections.abc import Callable, Mapping, Sequence
from typing import Any

import numpy as np
from sqlalchemy import select
from sqlalchemy.orm import Session, joinedload

from app.datasets.scene_data import symmetries_from_json, symmetries_to_json
from app.storage.database import Database
from app.storage.tables import Object, SymmetrySuggestions, SymmetryVersion
from registration_core import (
    ObjectModel,
    Symmetries,
    SymmetryAxis,
    as_symmetries,
    axes_of,
    check_axes,
    find_symmetries,
)


class OutdatedError(Exception):
    """Somebody else has decided meanwhile; the message may be shown."""


def suggest(
    database: Database, models: Mapping[str, ObjectModel], report: Callable[[], None] = lambda: None
) -> dict[str, list[Any]]:
    """Suggested axes by the hash of the mesh, for those of `models` that were never looked into.

    Args:
        database: Where suggestions are kept.
        models: By the hash of the mesh's file.
        report: Called before each search, which takes up to a second.
    """
    with database.read() as session:
        known = set(session.scalars(select(SymmetrySuggestions.mesh_hash)))
    found = {}
    for mesh_hash in models.keys() - known:
        report()
        axes = find_symmetries(models[mesh_hash])
        found[mesh_hash] = [axis_to_json(axis) | {"residual": axis.residual} for axis in axes]
    return found


def keep_suggestions(session: Session, found: Mapping[str, list[Any]]) -> None:
    """Keep what was found on meshes, and mark objects that it leaves something to decide about."""
    for mesh_hash, suggestions in found.items():
        session.merge(SymmetrySuggestions(mesh_hash=mesh_hash, suggestions=suggestions))
    session.flush()
    for row in session.scalars(select(Object).where(Object.mesh_hash.in_(found))):
        open_suggestions(session, row)


def never_looked_into(session: Session) -> list[Object]:
    """Objects without symmetries whose mesh was not looked into, since an older version imported them."""
    known = select(SymmetrySuggestions.mesh_hash)
    rows = session.scalars(select(Object).where(Object.mesh_hash.not_in(known)).order_by(Object.id.desc()))
    return [row for row in rows if _is_none(row.symmetries)]


def first_version(session: Session, row: Object) -> None:
    """Keep what an object was imported with; the object has its id by now."""
    session.add(SymmetryVersion(object_id=row.id, version=1, symmetries=row.symmetries))


def open_suggestions(session: Session, row: Object) -> None:
    """Mark an object whose suggestions wait for somebody to decide."""
    now = _version(session, row, row.symmetries_version)
    as_imported = now.version == 1 or now.restores == 1
    row.suggestions_open = bool(as_imported and _is_none(row.symmetries) and suggestions_of(session, row))


def suggestions_of(session: Session, row: Object) -> list[Any] | None:
    """The suggested axes of an object, best first; None where its mesh was never looked into."""
    kept = session.get(SymmetrySuggestions, row.mesh_hash)
    return kept.suggestions if kept else None


def versions_of(session: Session, object_id: int) -> Sequence[SymmetryVersion]:
    """All versions of an object's symmetries, the newest first."""
    return session.scalars(
        select(SymmetryVersion)
        .where(SymmetryVersion.object_id == object_id)
        .options(joinedload(SymmetryVersion.user))
        .order_by(SymmetryVersion.version.desc())
    ).all()


def present_axes(session: Session, row: Object) -> list[Any]:
    """The axes of the present symmetries: as somebody chose them, or read off what was imported."""
    return axes_in(_version(session, row, row.symmetries_version))


def axes_in(version: SymmetryVersion) -> list[Any]:
    """The axes of one version, likewise."""
    if version.axes is not None:
        return version.axes
    return [axis_to_json(axis) for axis in axes_of(symmetries_from_json(version.symmetries))]


def version_before(session: Session, row: Object) -> int | None:
    """The version that undo leads to; None at what was imported."""
    now = _version(session, row, row.symmetries_version)
    shown = now.restores or now.version
    if shown == 1:
        return None
    before = _version(session, row, shown - 1)
    return before.restores or before.version


def decide(
    session: Session,
    row: Object,
    axes: Sequence[SymmetryAxis],
    model: ObjectModel,
    user_id: int,
    changes: int | None,
) -> None:
    """Make the symmetries that axes amount to the present ones, as a new version; no axes: it has none.

    Args:
        session: A writing one.
        row: The object, as this session has it.
        axes: All that it is to have.
        model: Its mesh.
        user_id: Who decides.
        changes: The version that was seen; whatever is present where it is None.

    Raises:
        ValueError: naming `axes[i]`, where they do not go together.
        OutdatedError: where another version is present by now.
    """
    _check_present(row, changes)
    check_axes(axes, model)
    symmetries = symmetries_to_json(as_symmetries(axes))
    chosen = [axis_to_json(axis) for axis in axes]
    _add(session, row, SymmetryVersion(symmetries=symmetries, axes=chosen, user_id=user_id))


def restore(session: Session, row: Object, version: int, user_id: int, changes: int | None) -> None:
    """Bring an earlier version back, as a new one.

    Raises:
        ValueError: where the object has no such version.
        OutdatedError: where another version than `changes` is present by now.
    """
    _check_present(row, changes)
    if not 1 <= version <= row.symmetries_version:
        raise ValueError(f"restore: there is no version {version}; the newest is {row.symmetries_version}")
    wanted = _version(session, row, version)
    added = SymmetryVersion(
        symmetries=wanted.symmetries,
        axes=wanted.axes,
        restores=wanted.restores or wanted.version,
        user_id=user_id,
    )
    _add(session, row, added)


def axis_to_json(axis: SymmetryAxis) -> dict[str, Any]:
    """An axis as it is kept: metres, in the mesh's frame."""
    return {"axis": axis.axis.tolist(), "point": axis.origin.tolist(), "fold": axis.fold}


def axis_from_json(content: dict[str, Any]) -> SymmetryAxis:
    """The inverse of `axis_to_json`."""
    return SymmetryAxis(np.array(content["axis"]), np.array(content["point"]), content["fold"])


def _add(session: Session, row: Object, version: SymmetryVersion) -> None:
    version.object_id, version.version = row.id, row.symmetries_version + 1
    session.add(version)
    row.symmetries, row.symmetries_version = version.symmetries, version.version
    session.flush()
    open_suggestions(session, row)


def _version(session: Session, row: Object, version: int) -> SymmetryVersion:
    return session.scalars(select(SymmetryVersion).filter_by(object_id=row.id, version=version)).one()


def _check_present(row: Object, changes: int | None) -> None:
    if changes is not None and changes != row.symmetries_version:
        raise OutdatedError(
            f"The symmetries were changed meanwhile: version {row.symmetries_version} is the present one,"
            f" not {changes}. Look at it, and decide again."
        )


def _is_none(symmetries: dict[str, Any]) -> bool:
    return symmetries_from_json(symmetries) == Symmetries()
