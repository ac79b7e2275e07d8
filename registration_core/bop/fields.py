"""Fields of BOP's JSON files, checked one by one: what is wrong is said with file, field and value."""

import json
from collections import Counter
from dataclasses import dataclass
from functools import partial
from pathlib import Path
from typing import Any

import numpy as np
from numpy.typing import NDArray

from registration_core.geometry import pose
from registration_core.geometry.object_model import ContinuousSymmetry, Symmetries

Array = NDArray[np.float64]

METRES_PER_MILLIMETRE = 0.001

ROTATION_TOLERANCE = 0.02
"""Largest entry of |R R^T - I| that is rounding; published datasets reach 0.009."""

LARGEST_NUMBER = 1e300
"""What lies beyond is as good as infinite."""

LONGEST_ID = 9
"""Digits of the id of a scene, an image or an object: what 32 bits hold."""

LONGEST_NAME = 200
"""Characters of the name of an object or a dataset."""

SMALLEST_DISTANCE = 10.0
"""Millimetres; an object nearer to the camera's centre than that was written in metres."""


class BopFormatError(ValueError):
    """A dataset breaks the BOP format; the message is one sentence with file, field, value and remedy."""


@dataclass(frozen=True)
class Entry:
    """One JSON object, and words that say where it stands."""

    where: str
    """File and place for messages, such as "test/000001/scene_gt.json: image 3, entry 0"."""
    values: dict[str, Any]

    @classmethod
    def of(cls, value: object, where: str) -> "Entry":
        """The entry of a JSON value that must be an object."""
        if not isinstance(value, dict):
            raise BopFormatError(f"{where} must be an object {{...}}; it is {shortened(value)}")
        return cls(where, value)

    def has(self, field: str) -> bool:
        """Whether the field is there."""
        return field in self.values

    def numbers(self, field: str, count: int) -> Array:
        """A list of exactly `count` finite numbers (count,)."""
        value = self._required(field)
        if not isinstance(value, list):
            raise BopFormatError(
                f"{self.where}: {field} must be a list of {count} numbers; it is {shortened(value)}"
            )
        if len(value) != count:
            raise BopFormatError(
                f"{self.where}: {field} must have {count} numbers, row by row; it has {len(value)}"
            )
        for item in value:
            if not is_number(item):
                raise BopFormatError(
                    f"{self.where}: {field} must hold finite numbers; it holds {shortened(item)}"
                )
        return np.array(value, dtype=np.float64)

    def positive(self, field: str, meaning: str) -> float:
        """A number above 0; `meaning` tells the reader what it stands for."""
        value = self._required(field)
        if not is_number(value) or value <= 0:
            raise BopFormatError(
                f"{self.where}: {field} must be a number above 0 ({meaning}); it is {shortened(value)}"
            )
        return float(value)

    def whole(self, field: str) -> int:
        """A whole number of at least 0."""
        value = self._required(field)
        if not isinstance(value, int) or isinstance(value, bool) or value < 0:
            raise BopFormatError(
                f"{self.where}: {field} must be a whole number from 0; it is {shortened(value)}"
            )
        return value

    def rigid(self, rotation_field: str, translation_field: str) -> Array:
        """Pose (4, 4) in metres from a rotation of 9 numbers, row by row, and a translation in mm."""
        R = self.numbers(rotation_field, 9).reshape(3, 3)
        check_rotation(R, f"{self.where}: {rotation_field}")
        translation = self.numbers(translation_field, 3) * METRES_PER_MILLIMETRE
        return pose.orthonormalised(pose.from_rotation_translation(R, translation))

    def object_pose(self) -> Array:
        """`T_camera_object` (4, 4), metres, of an entry of `scene_gt.json`."""
        T_camera_object = self.rigid("cam_R_m2c", "cam_t_m2c")
        distance = float(np.linalg.norm(T_camera_object[:3, 3])) / METRES_PER_MILLIMETRE
        if distance < SMALLEST_DISTANCE:
            raise BopFormatError(
                f"{self.where}: cam_t_m2c is {distance:.3g} mm long, which puts the object into the camera;"
                " write translations in millimetres"
            )
        return T_camera_object

    def camera_pose(self) -> Array | None:
        """`T_world_camera` (4, 4), metres, of an entry of `scene_camera.json`; None where it has none."""
        fields = ("cam_R_w2c", "cam_t_w2c")
        if not any(self.has(field) for field in fields):
            return None
        return pose.inverse(self.rigid(*fields))

    def symmetries(self) -> Symmetries:
        """Symmetries in metres of an entry of `models_info.json`; none where it names none."""
        discrete = [
            self._discrete_symmetry(index, value)
            for index, value in enumerate(self._list("symmetries_discrete"))
        ]
        continuous = [
            self._continuous_symmetry(index, value)
            for index, value in enumerate(self._list("symmetries_continuous"))
        ]
        return Symmetries(tuple(discrete), tuple(continuous))

    def _discrete_symmetry(self, index: int, value: object) -> tuple[tuple[float, ...], ...]:
        name = f"symmetries_discrete[{index}]"
        T = Entry(self.where, {name: value}).numbers(name, 16).reshape(4, 4)
        check_rotation(T[:3, :3], f"{self.where}: {name}")
        if not np.allclose(T[3], [0.0, 0.0, 0.0, 1.0]):
            raise BopFormatError(f"{self.where}: {name} must end in 0 0 0 1; it ends in {T[3].tolist()}")
        T[:3, 3] *= METRES_PER_MILLIMETRE
        return tuple(map(tuple, pose.orthonormalised(T).tolist()))

    def _continuous_symmetry(self, index: int, value: object) -> ContinuousSymmetry:
        entry = Entry.of(value, f"{self.where}: symmetries_continuous[{index}]")
        axis = entry.numbers("axis", 3)
        if not axis.any():
            raise BopFormatError(f"{entry.where}: axis must be a direction; it is 0 0 0")
        offset = entry.numbers("offset", 3) if entry.has("offset") else np.zeros(3)
        x, y, z = (offset * METRES_PER_MILLIMETRE).tolist()
        return ContinuousSymmetry((axis[0].item(), axis[1].item(), axis[2].item()), (x, y, z))

    def _list(self, field: str) -> list[Any]:
        value = self.values.get(field, [])
        if not isinstance(value, list):
            raise BopFormatError(f"{self.where}: {field} must be a list [...]; it is {shortened(value)}")
        return value

    def _required(self, field: str) -> Any:
        if field not in self.values:
            raise BopFormatError(f"{self.where}: {field} is missing; add it")
        return self.values[field]


def read_json(path: Path, name: str) -> dict[int, Any]:
    """A JSON file that maps numbers (image or object ids) to values; `name` stands for it in messages."""
    if not path.exists():
        raise BopFormatError(f"{name} is missing; add it")
    if not path.is_file():  # a pipe would be waited for
        raise BopFormatError(f"{name} is no file; put a JSON file in its place")
    try:
        content = json.loads(path.read_text(encoding="utf-8-sig"), object_pairs_hook=partial(_fields, name))
    except json.JSONDecodeError as error:
        raise BopFormatError(
            f"{name} is no valid JSON: {error.msg} at line {error.lineno}, column {error.colno};"
            " write it again"
        ) from error
    except BopFormatError:
        raise
    except (OSError, ValueError, RecursionError) as error:  # no UTF-8, endless numbers, endless nesting
        raise BopFormatError(f"{name} cannot be read as JSON text; check the file") from error
    values: dict[int, Any] = {}
    for key, value in Entry.of(content, name).values.items():
        if not is_id(key):
            raise BopFormatError(
                f"{name}: keys must be whole numbers of at most {LONGEST_ID} digits; there is {key[:20]!r}"
            )
        if int(key) in values:
            raise BopFormatError(f"{name} has number {int(key)} twice; keep one of the two")
        values[int(key)] = value
    return values


def _fields(name: str, pairs: list[tuple[str, Any]]) -> dict[str, Any]:
    """A JSON object's fields, none of which may be there twice: of two, one would be lost."""
    fields = dict(pairs)
    if len(fields) < len(pairs):
        twice = next(key for key, count in Counter(key for key, _ in pairs).items() if count > 1)
        raise BopFormatError(f"{name} has {shortened(twice)} twice in one object; keep one of the two")
    return fields


def optional_json(path: Path, root: Path) -> dict[int, Any]:
    """A JSON file by number; empty where there is no such file."""
    return read_json(path, name_of(path, root)) if path.exists() else {}


def name_of(path: Path, root: Path) -> str:
    """A path for a message: inside the dataset."""
    return path.relative_to(root).as_posix()


def is_id(text: str) -> bool:
    """Whether a file's, folder's or key's name is the number of something."""
    return text.isascii() and text.isdigit() and len(text) <= LONGEST_ID


def is_name(text: str, longest: int = LONGEST_NAME) -> bool:
    """Whether a text can be shown, written to any database, and made a file's name."""
    return 0 < len(text) <= longest and text.isprintable() and not text.isspace()


def check_rotation(R: Array, name: str) -> None:
    """Raise where R (3, 3) is no rotation up to rounding."""
    deviation = float(np.abs(R @ R.T - np.eye(3)).max())
    if deviation > ROTATION_TOLERANCE:
        raise BopFormatError(
            f"{name} must be a rotation, row by row; R R^T differs from the identity by {deviation:.3g}"
        )
    if np.linalg.det(R) < 0:
        raise BopFormatError(
            f"{name} must be a rotation; its determinant is -1, so it mirrors: turn one axis"
        )


def is_number(value: object) -> bool:
    """Whether a JSON value is a finite number; neither NaN nor what a float cannot hold."""
    return isinstance(value, int | float) and not isinstance(value, bool) and abs(value) < LARGEST_NUMBER


def shortened(value: object) -> str:
    """A JSON value for a message, cut where it is long."""
    text = json.dumps(value, ensure_ascii=False)
    return text if len(text) <= 60 else f"{text[:57]}..."
