"""Scene files as `penumbra mask` reads them: names relative to the file become parts of the request."""

from __future__ import annotations

import json
import os
import re
from typing import Any, Callable, Dict, Iterable, List, Tuple

from .file_places import FILE_PLACES

Scene = Dict[str, Any]
Rename = Callable[[str], str]


def load_scene_file(path: "str | os.PathLike[str]") -> Tuple[Scene, Dict[str, bytes]]:
    """The scene and the bytes of every file that it names, ready for Client.mask and Client.keep.

    Names lead from the scene file's folder and become names of parts: their last component, with what the service does not allow replaced
    by `_`. Of two files that would get one name the second becomes `name-2.exr`; the scene that is returned says so. A mesh is one file:
    companions of glTF (.bin) and OBJ (.mtl) do not travel. Raises OSError for files that are not there, ValueError for what is not JSON or
    has a key twice.
    """
    path = os.fspath(path)
    with open(path, "rb") as file:
        text = file.read()
    try:
        scene = json.loads(text.decode("utf-8"), object_pairs_hook=_unique, parse_constant=_no_constant)
    except (ValueError, RecursionError) as error:
        raise ValueError(f"{path}: {error}") from None
    if not isinstance(scene, dict):
        raise ValueError(f"{path}: is not a JSON object")

    folder = os.path.dirname(path)
    names: Dict[str, str] = {}  # by the file's real path
    images: Dict[str, bytes] = {}

    def part_for(name: str) -> str:
        real = os.path.realpath(os.path.join(folder, name))
        if real not in names:
            with open(os.path.join(folder, name), "rb") as image:
                data = image.read()
            names[real] = _free_name(name, images)
            images[names[real]] = data
        return names[real]

    rename_files(scene, part_for)
    return scene, images


def rename_files(scene: Scene, rename: Rename) -> None:
    """Replaces every file name in the scene, in place. What is no name where one belongs stays, for the service to refuse."""
    for holder, key in _places(scene):
        if isinstance(holder[key], str):
            holder[key] = rename(holder[key])


def _places(scene: Scene) -> Iterable[Tuple[Any, Any]]:
    found: List[Tuple[Any, Any]] = []
    for place in FILE_PLACES:
        holders: List[Tuple[Any, Any]] = [({"": scene}, "")]
        for step in re.findall(r"\w+|\[\]", place):
            values = [holder[key] for holder, key in holders]
            if step == "[]":
                holders = [(value, i) for value in values if isinstance(value, list) for i in range(len(value))]
            else:
                holders = [(value, step) for value in values if isinstance(value, dict) and step in value]
        found += holders
    return found


def _free_name(name: str, taken: Dict[str, bytes]) -> str:
    # At most 120 characters, so that a number still fits into the 128 that the service allows; the end decides a mesh's format.
    base = re.sub(r"[^A-Za-z0-9._-]", "_", os.path.basename(name))[-120:].lstrip(".") or "image"
    stem, extension = os.path.splitext(base)
    free, number = base, 1
    while free in taken or free == "scene":
        number += 1
        free = f"{stem}-{number}{extension}"
    return free


def _unique(pairs: List[Tuple[str, Any]]) -> Scene:
    result = dict(pairs)
    if len(result) != len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {next(key for key in keys if keys.count(key) > 1)!r} stands twice in one object")
    return result


def _no_constant(word: str) -> Any:
    raise ValueError(f"{word} is not JSON")
