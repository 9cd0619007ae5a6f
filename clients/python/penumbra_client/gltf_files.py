"""Which files a glTF names that count for shadows: its buffers, and the images that cut out what it draws."""

from __future__ import annotations

import json
import urllib.parse
from typing import Any, List

from .obj_files import NamedFile, without_mark


def files_of_gltf(data: bytes) -> List[NamedFile]:
    try:
        gltf = json.loads(_gltf_json(data))
    except (ValueError, RecursionError):
        return []  # the service says what is wrong with it
    holders = list(_list(_at(gltf, "buffers")))
    for index in _materials_in_use(gltf):
        material = _at(_at(gltf, "materials"), index)
        if _at(material, "alphaMode") == "MASK":
            texture = _at(_at(gltf, "textures"), _at(_at(_at(material, "pbrMetallicRoughness"), "baseColorTexture"), "index"))
            holders.append(_at(_at(gltf, "images"), _at(texture, "source")))
    uris = [_at(holder, "uri") for holder in holders]
    return [NamedFile(urllib.parse.unquote(uri, "utf-8", "surrogateescape"), True) for uri in uris
            if isinstance(uri, str) and uri and not uri.startswith("data:")]


def _gltf_json(data: bytes) -> bytes:
    """All of it, or the first chunk of a GLB, behind 12 bytes and the chunk's own 8."""
    return data[20:20 + int.from_bytes(data[12:16], "little")] if data.startswith(b"glTF") else without_mark(data)


def _materials_in_use(gltf: Any) -> List[int]:
    """Those that primitives have."""
    indices = [_at(primitive, "material") for mesh in _list(_at(gltf, "meshes")) for primitive in _list(_at(mesh, "primitives"))]
    return sorted({index for index in indices if isinstance(index, int)})


def _at(value: Any, key: Any) -> Any:
    """The member or element there; None where there is none. What a file has wrong is left to the service to refuse."""
    if isinstance(key, str):
        return value.get(key) if isinstance(value, dict) else None
    return value[key] if isinstance(value, list) and isinstance(key, int) and 0 <= key < len(value) else None


def _list(value: Any) -> List[Any]:
    return value if isinstance(value, list) else []
