"""Images between Python and the service: arrays travel as portable float maps (PFM), which hold float32 exactly."""

from __future__ import annotations

import math
import os
import re
import sys
from array import array
from typing import Any, Mapping, Optional, Sequence, Tuple, Union

try:
    import numpy
except ImportError:
    numpy = None  # type: ignore[assignment]

# A path, the bytes of a file, a numpy array, nested lists, or (array('f'), shape).
ImageLike = Union[str, "os.PathLike[str]", bytes, bytearray, memoryview, Sequence[Any], Any]
Shape = Tuple[int, ...]

_PART_NAME = re.compile(r"[A-Za-z0-9_-][A-Za-z0-9._-]{0,127}\Z")


def check_part_name(name: str) -> None:
    """Raises ValueError for a name that the service would not take for an image."""
    if not isinstance(name, str) or not _PART_NAME.match(name) or name == "scene":
        raise ValueError(f"image {name!r}: expected 1 to 128 of A-Z a-z 0-9 . _ - with no . at the start, and not \"scene\"")


def encode_parts(images: Optional[Mapping[str, ImageLike]]) -> "list[tuple[str, bytes]]":
    """The bytes to send for each image, by name. Raises ValueError, TypeError, OSError naming the image."""
    parts = []
    for name, image in (images or {}).items():
        check_part_name(name)
        parts.append((name, encode_image(image, name)))
    return parts


def encode_image(image: ImageLike, name: str = "image") -> bytes:
    """The bytes to send for one image. Files and bytes go as they are, arrays as PFM.

    Arrays are (height, width), or (height, width, 3) for a light's emission; row 0 is the top. float32 and float16 go unchanged, Python's
    numbers and float64 are rounded to float32, in which the service computes; a finite number that float32 cannot hold is an error, and so
    are integer arrays, whose meaning (an encoding) only a file carries.
    """
    if isinstance(image, (str, os.PathLike)):
        with open(image, "rb") as file:
            data = file.read()
    elif isinstance(image, (bytes, bytearray)):
        data = bytes(image)
    else:
        return _encode_array(image, name)
    if not data:
        raise ValueError(f"image {name}: is empty")
    return data


def _encode_array(image: Any, name: str) -> bytes:
    if numpy is not None and isinstance(image, numpy.ndarray):
        return _encode_numpy(image, name)
    if isinstance(image, tuple) and len(image) == 2 and isinstance(image[0], array):
        samples, shape = image[0], tuple(image[1])
        if samples.typecode != "f":
            raise TypeError(f"image {name}: is array('{samples.typecode}'), expected array('f')")
    elif isinstance(image, (list, tuple)):
        samples, shape = _flatten(image, name)
    else:
        raise TypeError(f"image {name}: is {type(image).__name__}, expected a path, bytes, a numpy array, nested lists or (array('f'), shape)")
    _check_shape(shape, name)
    if len(samples) != math.prod(shape):
        raise ValueError(f"image {name}: has {len(samples)} samples, expected {math.prod(shape)} for shape {shape}")
    row = math.prod(shape[1:])
    rows = [samples[y * row:(y + 1) * row].tobytes() for y in reversed(range(shape[0]))]
    return _header(shape, sys.byteorder == "little") + b"".join(rows)


def _encode_numpy(image: Any, name: str) -> bytes:
    if image.dtype.kind != "f":
        raise TypeError(f"image {name}: is {image.dtype}, expected floating point (send integer depth as a PNG or TIFF, or convert it)")
    _check_shape(image.shape, name)
    with numpy.errstate(over="ignore"):
        samples = image.astype("<f4")
    if numpy.any(numpy.isinf(samples) & numpy.isfinite(image)):
        raise ValueError(f"image {name}: has a finite value that float32 cannot hold")
    return _header(image.shape, True) + samples[::-1].tobytes()


def _check_shape(shape: Shape, name: str) -> None:
    if len(shape) not in (2, 3) or min(shape) < 1 or (len(shape) == 3 and shape[2] != 3):
        raise ValueError(f"image {name}: has shape {shape}, expected (height, width) or (height, width, 3)")


def _flatten(rows: Sequence[Any], name: str) -> "tuple[array[float], Shape]":
    shape: Shape = (len(rows), _length(rows, name)) if rows else (0, 0)
    if rows and shape[1] and isinstance(rows[0][0], (list, tuple)):
        shape += (len(rows[0][0]),)
    samples = array("f")
    for y, row in enumerate(rows):
        if not isinstance(row, (list, tuple)) or len(row) != shape[1]:
            raise ValueError(f"image {name}: row {y} is not a list of {shape[1]} values as row 0 is")
        for pixel in row:
            values = pixel if len(shape) == 3 else (pixel,)
            if len(shape) == 3 and (not isinstance(pixel, (list, tuple)) or len(pixel) != shape[2]):
                raise ValueError(f"image {name}: row {y} has a pixel that is not a list of {shape[2]} values as the first is")
            try:
                samples.extend(values)
            except TypeError:
                raise TypeError(f"image {name}: row {y} has a value that is no number") from None
            if any(math.isinf(held) and math.isfinite(given) for held, given in zip(samples[-len(values):], values)):
                raise ValueError(f"image {name}: row {y} has a finite value that float32 cannot hold")
    return samples, shape


def _length(rows: Sequence[Any], name: str) -> int:
    if not isinstance(rows[0], (list, tuple)):
        raise ValueError(f"image {name}: is a flat list, expected a list of rows")
    return len(rows[0])


def _header(shape: Shape, little: bool) -> bytes:
    return f"{'PF' if len(shape) == 3 else 'Pf'}\n{shape[1]} {shape[0]}\n{'-1.0' if little else '1.0'}\n".encode()


def decode_pfm(data: bytes) -> "tuple[Any, Shape]":
    """Pixels and shape of a portable float map, row 0 at the top. A numpy float32 array of that shape; without numpy array('f').

    Raises ValueError for anything that is not a whole PFM.
    """
    words = re.match(rb"(PF|Pf)\s+(\d{1,9})\s+(\d{1,9})\s+([-+.0-9eE]+)\s", data)
    if not words:
        raise ValueError("is not a portable float map")
    try:
        scale = float(words[4])
    except ValueError:
        scale = 0.0
    width, height = int(words[2]), int(words[3])
    if not width or not height or not scale or not math.isfinite(scale):
        raise ValueError("is a portable float map with a broken header")
    shape: Shape = (height, width, 3) if words[1] == b"PF" else (height, width)
    row = 4 * math.prod(shape[1:])
    if len(data) - words.end() != row * height:
        raise ValueError(f"is a portable float map with {len(data) - words.end()} bytes of samples, expected {row * height}")
    if numpy is not None:
        samples = numpy.frombuffer(data, "<f4" if scale < 0 else ">f4", offset=words.end()).reshape(shape)
        return samples[::-1].astype(numpy.float32), shape
    pixels = array("f")
    for y in reversed(range(height)):
        pixels.frombytes(data[words.end() + y * row:words.end() + (y + 1) * row])
    if (scale < 0) != (sys.byteorder == "little"):
        pixels.byteswap()
    return pixels, shape
