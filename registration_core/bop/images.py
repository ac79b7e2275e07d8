"""Images of BOP datasets: found, decoded whole, turned into metres, and brought into one plain form.

A picture means the same everywhere only if nothing about it is left to the reader: no orientation tag, no
transparency, no palette, 8 bits a channel. That is the plain form, in which pictures are kept.
"""

import io
from collections import defaultdict
from dataclasses import dataclass
from pathlib import Path

import numpy as np
from numpy.typing import NDArray
from PIL import Image, ImageOps
from PIL.ExifTags import Base as ExifTag

from registration_core.bop.fields import METRES_PER_MILLIMETRE, BopFormatError

COLOR_FOLDERS = ("rgb", "gray")
"""Where a scene may keep its pictures, best first."""
COLOR_SUFFIXES = (".png", ".jpg", ".jpeg", ".tif", ".tiff")
DEPTH_SUFFIXES = (".png", ".tif", ".tiff")

DEPTH_MODES = ("I;16", "I;16B", "I;16L", "I")
"""Pillow's names of 16-bit greyscale; "I" has 32, of which 16 may be used."""
LARGEST_RAW_DEPTH = 65535
"""What 16 bits hold."""

GREY_MODES = ("1", "L", "LA", "La", *DEPTH_MODES)
JPEG_FORMATS = ("JPEG", "MPO")
UPRIGHT = 1
"""The orientation tag of a picture whose first row is its top."""


@dataclass(frozen=True)
class ImageFile:
    """An image that was found sound."""

    path: Path
    width: int
    height: int
    is_plain: bool
    """Whether the file itself is in the plain form."""


class Folder:
    """The files of one folder of a scene, by the number of the image that they belong to."""

    def __init__(self, path: Path, name: str, suffixes: tuple[str, ...]) -> None:
        self._name = name
        self._suffixes = suffixes
        self._files: dict[str, list[Path]] = defaultdict(list)
        if path.is_dir():
            for file in sorted(path.iterdir()):
                if not file.name.startswith("."):
                    self._files[file.stem].append(file)

    def find(self, image_id: int) -> Path | None:
        """The file of an image, or None.

        Raises:
            BopFormatError: where there are two, or one that is not read.
        """
        files = self._files.get(f"{image_id:06d}", [])
        if len(files) > 1:
            names = " and ".join(f"{self._name}/{file.name}" for file in files)
            raise BopFormatError(f"{names} are both image {image_id}; keep one of them")
        if not files:
            return None
        if files[0].suffix.lower() not in self._suffixes:
            raise BopFormatError(
                f"{self._name}/{files[0].name} is of a kind that is not read; save it as one of"
                f" {', '.join(self._suffixes)}"
            )
        return files[0] if files[0].is_file() else None


class SceneFolders:
    """Where a scene's images lie."""

    def __init__(self, folder: Path, name: str) -> None:
        self._depth = Folder(folder / "depth", f"{name}/depth", DEPTH_SUFFIXES)
        self._colors = [Folder(folder / kind, f"{name}/{kind}", COLOR_SUFFIXES) for kind in COLOR_FOLDERS]

    def depth(self, image_id: int) -> Path | None:
        """The depth image, or None."""
        return self._depth.find(image_id)

    def color(self, image_id: int) -> Path | None:
        """The picture, or None; a coloured one goes before a grey one."""
        found = (folder.find(image_id) for folder in self._colors)
        return next((path for path in found if path is not None), None)


def read_depth(path: Path, depth_scale: float) -> NDArray[np.float32]:
    """Depth (H, W) in metres, 0 where nothing was measured, of a 16-bit image; raw * depth_scale is mm.

    Raises:
        BopFormatError: where it is no readable 16-bit greyscale image.
    """
    raw = np.asarray(decoded_depth(path, path.name), dtype=np.float32)
    return raw * np.float32(depth_scale * METRES_PER_MILLIMETRE)


def read_color(path: Path) -> NDArray[np.uint8]:
    """Colours (H, W, 3) of a picture; grey ones get three equal channels.

    Raises:
        BopFormatError: where it is no readable image.
    """
    return np.asarray(in_8_bits(decoded(path, path.name), path.name).convert("RGB"), dtype=np.uint8)


def examined_depth(path: Path, name: str) -> ImageFile:
    """A depth image that was decoded whole."""
    image = decoded_depth(path, name)
    is_plain = image.format == "PNG" and image.mode == "I;16" and orientation_of(image) == UPRIGHT
    return ImageFile(path, *image.size, is_plain)


def examined_color(path: Path, name: str, size: tuple[int, int]) -> ImageFile:
    """A picture that was decoded whole, upright as the depth image of `size` (width, height) tells."""
    image = decoded(path, name)
    in_8_bits(image, name)
    return ImageFile(path, *upright(image, size).size, is_plain_picture(image))


def examined_picture(path: Path, name: str) -> ImageFile:
    """A picture that was decoded whole, of no depth image."""
    image = decoded(path, name)
    in_8_bits(image, name)
    return ImageFile(path, *image.size, is_plain_picture(image))


def is_plain_picture(image: Image.Image) -> bool:
    """Whether a picture is in the plain form as it is."""
    return (
        image.format in ("PNG", *JPEG_FORMATS)
        and image.mode in ("L", "RGB")
        and "transparency" not in image.info
        and orientation_of(image) == UPRIGHT
    )


def plain_depth(file: ImageFile) -> bytes:
    """The content of a depth image as a 16-bit PNG."""
    if file.is_plain:
        return file.path.read_bytes()
    raw = np.asarray(decoded_depth(file.path, file.path.name)).astype(np.uint16)
    return png(Image.fromarray(raw))


def plain_color(file: ImageFile) -> bytes:
    """The content of a picture as PNG or JPEG, opaque, upright, 8 bits a channel, grey or RGB."""
    if file.is_plain:
        return file.path.read_bytes()
    image = upright(decoded(file.path, file.path.name), (file.width, file.height))
    return png(in_8_bits(image, file.path.name).convert("L" if is_grey(image) else "RGB"))


def png(image: Image.Image) -> bytes:
    """An image's pixels as a PNG, without anything else that the image knew."""
    content = io.BytesIO()
    Image.fromarray(np.asarray(image)).save(content, format="PNG")
    return content.getvalue()


def is_grey(image: Image.Image) -> bool:
    """Whether an image has one channel."""
    return image.mode in GREY_MODES


def orientation_of(image: Image.Image) -> int:
    """The image's orientation tag, 1 to 8."""
    return int(image.getexif().get(ExifTag.Orientation, UPRIGHT))


def upright(image: Image.Image, size: tuple[int, int]) -> Image.Image:
    """The image as it lies on a depth image of `size`.

    Tools of the field read pixels as they are stored, so that is what they mean; only where they fit the
    depth image turned and not else was the tag meant.
    """
    if image.size == size or image.size[::-1] != size:
        return image
    return ImageOps.exif_transpose(image)


def in_8_bits(image: Image.Image, name: str) -> Image.Image:
    """The image with 8 bits a channel, as a camera of more would have taken it with 8."""
    if image.mode in DEPTH_MODES:
        raw = np.asarray(image)
        return Image.fromarray((raw >> 8 if raw.max(initial=0) > 255 else raw).astype(np.uint8))
    if image.mode == "F":
        raise BopFormatError(f"{name} holds floating point numbers; save it with 8 or 16 bits a channel")
    return image


def decoded(path: Path, name: str) -> Image.Image:
    """An image whose every pixel was decoded, so that a broken file shows here."""
    try:
        with Image.open(path) as image:
            image.load()
            return image
    except (OSError, SyntaxError, ValueError, Image.DecompressionBombError) as error:  # all broken files
        raise BopFormatError(f"{name} cannot be decoded as an image; replace the file") from error


def decoded_depth(path: Path, name: str) -> Image.Image:
    """The same for a depth image, which must be 16-bit greyscale."""
    image = decoded(path, name)
    if image.mode not in DEPTH_MODES:
        raise BopFormatError(
            f"{name} must be a 16-bit greyscale image; its pixels are of kind {image.mode}: save raw depth"
        )
    if image.mode == "I":
        raw = np.asarray(image)
        low, high = raw.min(), raw.max()
        if low < 0 or high > LARGEST_RAW_DEPTH:
            raise BopFormatError(
                f"{name} must hold numbers from 0 to {LARGEST_RAW_DEPTH}; it holds {low} to {high}: choose"
                " another depth_scale"
            )
    return image
