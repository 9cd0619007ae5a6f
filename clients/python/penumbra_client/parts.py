"""Files under the names that they have in a request."""

from __future__ import annotations

import os
import re
from typing import Dict, Optional, Set


class Parts:
    """`data` is the bytes of each file that was asked for, by the name of its part."""

    def __init__(self) -> None:
        self.data: Dict[str, bytes] = {}
        self._names: Dict[str, str] = {}  # by the file's real path
        self._kept_free: Set[str] = set()

    def part_of(self, path: str) -> str:
        """The part that holds a file: its last name; of two files that would get one name, the second becomes `name-2.exr`."""
        real = os.path.realpath(path)
        if real not in self._names:
            with open(path, "rb") as file:
                data = file.read()
            self._names[real] = self._free_name(path)
            self.data[self._names[real]] = data
        return self._names[real]

    def find(self, path: str) -> Optional[str]:
        """The same; None for a file that cannot be read or has nothing in it, which is no part."""
        try:
            return self.part_of(path) if os.path.isfile(path) and os.path.getsize(path) > 0 else None
        except (OSError, ValueError):
            return None

    def keep_free(self, name: str) -> bool:
        """No part gets this name from now on. False: one has it."""
        self._kept_free.add(name)
        return name not in self.data

    def _free_name(self, path: str) -> str:
        # At most 120 characters, so that a number still fits into the 128 that the service allows; the end decides a mesh's format.
        base = re.sub(r"[^A-Za-z0-9._-]", "_", os.path.basename(path))[-120:].lstrip(".") or "image"
        stem, extension = os.path.splitext(base)
        free, number = base, 1
        while free in self.data or free in self._kept_free or free == "scene":
            number += 1
            free = f"{stem}-{number}{extension}"
        return free
