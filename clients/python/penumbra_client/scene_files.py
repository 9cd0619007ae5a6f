"""Scene files as `penumbra mask` reads them: names relative to the file become parts of the request."""

from __future__ import annotations

import json
import os
import re
from typing import Any, Callable, Dict, Iterable, List, Tuple

from .file_places import FILE_PLACES
from .mesh_files import add_mesh_files, meshes_of
from .parts import Parts

Scene = Dict[str, Any]
Rename = Callable[[str], str]


def load_scene_file(path: "str | os.PathLike[str]") -> Tuple[Scene, Dict[str, bytes]]:
    """The scene and the bytes of every file that it names, ready for Client.mask and Client.keep.

    Names lead from the scene file's folder and become names of parts: their last component, with what the service does not allow replaced
    by `_`. Of two files that would get one name the second becomes `name-2.exr`; the scene that is returned says so. The files that meshes
    name (OBJ's .mtl and what that cuts out with, glTF's .bin and cut-outs) go with them; where their parts have other names the mesh's
    `files` says so. Raises OSError for files that are not there, ValueError for what is not JSON or has a key twice.
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
    parts = Parts()
    meshes = meshes_of(scene, folder)
    rename_files(scene, lambda name: parts.part_of(os.path.join(folder, name)))
    add_mesh_files(meshes, parts)
    return scene, parts.data


def rename_files(scene: Scene, rename: Rename) -> None:
    """Replaces every file name in the scene, in place. What is no name where one belongs stays, for the service to refuse."""
    for holder, key in _places(scene):
        if isinstance(holder[key], str):
            holder[key] = rename(holder[key])


def _places(scene: Scene) -> Iterable[Tuple[Any, Any]]:
    found: List[Tuple[Any, Any]] = []
    for place in FILE_PLACES:
        holders: List[Tuple[Any, Any]] = [({"": scene}, "")]
        for step in re.findall(r"\w+|\[\]|{}", place):
            values = [holder[key] for holder, key in holders]
            if step == "[]":
                holders = [(value, i) for value in values if isinstance(value, list) for i in range(len(value))]
            elif step == "{}":
                holders = [(value, key) for value in values if isinstance(value, dict) for key in value]
            else:
                holders = [(value, step) for value in values if isinstance(value, dict) and step in value]
        found += holders
    return found


def _unique(pairs: List[Tuple[str, Any]]) -> Scene:
    result = dict(pairs)
    if len(result) != len(pairs):
        keys = [key for key, _ in pairs]
        raise ValueError(f"the key {next(key for key in keys if keys.count(key) > 1)!r} stands twice in one object")
    return result


def _no_constant(word: str) -> Any:
    raise ValueError(f"{word} is not JSON")
