"""The files that meshes name, as parts of the request beside them."""

from __future__ import annotations

import errno
import json
import os
from typing import Any, Dict, List, Optional, Tuple

from .gltf_files import files_of_gltf
from .obj_files import NamedFile, files_of_obj
from .parts import Parts

MeshObject = Tuple[Dict[str, Any], str]  # of a scene, and the mesh's file
Table = Dict[str, str]


def meshes_of(scene: Dict[str, Any], folder: str) -> List[MeshObject]:
    """The objects that are meshes and say nothing about their files."""
    objects = scene.get("objects")
    return [(held, os.path.join(folder, held["mesh"])) for held in (objects if isinstance(objects, list) else [])
            if isinstance(held, dict) and isinstance(held.get("mesh"), str) and "files" not in held]


def add_mesh_files(meshes: List[MeshObject], parts: Parts) -> None:
    tables: Dict[str, Optional[Table]] = {}  # one mesh may stand in many places
    for held, mesh in meshes:
        if mesh not in tables:
            tables[mesh] = _file_table(mesh, parts)
        table = tables[mesh]
        if table is not None:
            held["files"] = dict(table)


def _file_table(mesh: str, parts: Parts) -> Optional[Table]:
    """What a mesh's `files` have to say: parts by the names that the mesh has for them. None where each name is the part's own, and a
    missing file's name is no part's, so that the service finds the same without."""
    table: Table = {}
    plain = True
    for named in _files_named_by(mesh, parts):
        part = _part_of(mesh, named.name, parts)
        if part is None and named.needed:
            number = errno.ENOENT if _is_utf_8(named.name) else errno.EILSEQ
            raise OSError(number, f"{mesh} names {json.dumps(named.name)}: {os.strerror(number)}")
        if part is not None:
            table[named.name] = part
        same = part == named.name if part is not None else parts.keep_free(named.name)
        plain = plain and same
    return None if plain else table


def _files_named_by(mesh: str, parts: Parts) -> List[NamedFile]:
    def find(name: str) -> Optional[bytes]:
        part = _part_of(mesh, name, parts)
        return None if part is None else parts.data[part]

    extension = os.path.splitext(mesh)[1].lower()
    if extension == ".obj":
        return files_of_obj(parts.data[parts.part_of(mesh)], find)
    if extension in (".gltf", ".glb"):
        return files_of_gltf(parts.data[parts.part_of(mesh)])
    return []


def _part_of(mesh: str, name: str, parts: Parts) -> Optional[str]:
    """The part that holds a file beside the mesh. JSON has no other names than UTF-8."""
    return parts.find(os.path.join(os.path.dirname(mesh), name)) if _is_utf_8(name) else None


def _is_utf_8(name: str) -> bool:
    try:
        name.encode()
    except UnicodeEncodeError:
        return False
    return True
