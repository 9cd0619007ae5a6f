"""Which files a Wavefront OBJ names that count for shadows: its material libraries, and the images that cut out what it uses of them."""

from __future__ import annotations

import re
from typing import Callable, Iterator, List, NamedTuple, Optional, Set, Tuple

FindBytes = Callable[[str], Optional[bytes]]  # None: it is not there

_BLANKS = " \t\n\v\f\r"


class NamedFile(NamedTuple):
    """A file by the name that a mesh has for it, relative to the mesh. Without one that is not needed the service computes, and warns."""

    name: str
    needed: bool


def files_of_obj(data: bytes, find: FindBytes) -> List[NamedFile]:
    if b"mtllib" not in data:
        return []
    data = re.sub(rb"\\(\r\n|\r|\n)", b" ", re.sub(rb"#[^\r\n]*", b"", without_mark(data)))  # no comments, and joined lines
    used: Set[str] = set()
    libraries: List[str] = []
    for match in re.finditer(rb"(?:^|[\r\n])[ \t\v\f]*(mtllib|usemtl)[ \t\v\f]([^\r\n]*)", data):
        text = _text(match[2]).strip(_BLANKS)
        if match[1] == b"usemtl":
            used.add(text)
        elif text:
            libraries.append(text)
    files: List[NamedFile] = []
    for line in libraries:
        for name in _library_names(line, find):
            files.append(NamedFile(name, False))
            files += [NamedFile(image, False) for image in _maps_of(find(name) or b"", used)]
    return files


def without_mark(data: bytes) -> bytes:
    return data[3:] if data.startswith(b"\xef\xbb\xbf") else data


def _library_names(line: str, find: FindBytes) -> List[str]:
    """One name with spaces, or several names."""
    return [line] if find(line) is not None else re.findall(f"[^{_BLANKS}]+", line)


def _maps_of(library: bytes, used: Set[str]) -> Iterator[str]:
    """The images that a material library (MTL) cuts these materials out with."""
    material = ""
    for line in re.split(r"[\r\n]+", _text(without_mark(library))):
        key, rest = _take_word(line)
        if key.lower() == "newmtl":
            material = rest.strip(_BLANKS)
        if key.lower() == "map_d" and material in used and _map_name(rest):
            yield _map_name(rest)


def _map_name(rest: str) -> str:
    """The name in "-clamp on -s 2 2 1 leaf mask.png", which may have spaces."""
    while True:
        option, after = _take_word(rest)
        if not option.startswith("-"):
            return rest.strip(_BLANKS).replace("\\", "/")  # as Windows writes it
        if option in ("-o", "-s", "-t"):
            for _ in range(3):
                word, behind = _take_word(after)
                after = behind if _is_number(word) else after
        else:
            for _ in range(2 if option == "-mm" else 1):
                after = _take_word(after)[1]
        rest = after


def _take_word(rest: str) -> Tuple[str, str]:
    """The next word and what is behind it."""
    match = re.match(f"[{_BLANKS}]*([^{_BLANKS}]*)", rest)
    assert match is not None
    return match[1], rest[match.end():]


def _is_number(word: str) -> bool:
    try:
        float(word)
    except ValueError:
        return False
    return True


def _text(data: bytes) -> str:
    return data.decode("utf-8", "surrogateescape")  # a name of any bytes leads to its file
