"""Files with bounds: nothing is believed that the file's real size does not allow."""

from __future__ import annotations

import json
import os
from pathlib import Path
from typing import Any, BinaryIO, NoReturn

from ._errors import FileError

#: Largest JSON file that is read, bytes.
MAX_JSON_BYTES = 512 << 20


def open_file(path: Path) -> tuple[BinaryIO, int]:
    """A regular file, opened, and its size in bytes."""
    try:
        if not path.is_file():
            raise FileError(path, "there is no such file" if not path.exists() else "not a regular file")
        file = path.open("rb")
        return file, os.fstat(file.fileno()).st_size
    except OSError as error:
        raise FileError(path, error.strerror or str(error)) from None


def read_json(path: Path) -> dict[str, Any]:
    """The object that a JSON file holds."""
    file, size = open_file(path)
    with file:
        if size > MAX_JSON_BYTES:
            raise FileError(path, f"{size:,} bytes; at most {MAX_JSON_BYTES:,} are read")
        return parse_json(path, file.read(size), "")


def parse_json(path: Path, text: bytes | str, place: str) -> dict[str, Any]:
    """The object that a text holds; `place` names it within the file."""

    def refuse(constant: str) -> NoReturn:
        raise ValueError(f"{constant} is no number")

    try:
        value = json.loads(text, parse_constant=refuse)
    except RecursionError:
        raise FileError(path, f"{place}nested too deeply") from None
    except (ValueError, UnicodeDecodeError) as error:
        raise FileError(path, f"{place}not valid JSON: {error}") from None
    if not isinstance(value, dict):
        raise FileError(path, f"{place}an object is expected")
    return value


class Fields:
    """The fields of a JSON object; what is missing or of another type is told by its place."""

    def __init__(self, path: Path, value: Any, place: str = "") -> None:
        self.path, self.place = path, place
        self.value: dict[str, Any] = value if isinstance(value, dict) else self.bad("an object is expected")

    def bad(self, reason: str) -> NoReturn:
        """Refuses the object."""
        raise FileError(self.path, f"{self.place}: {reason}" if self.place else reason)

    def text(self, name: str) -> str:
        """A string."""
        value = self.value.get(name)
        return value if isinstance(value, str) else self.bad(f"'{name}' is no text")

    def texts(self, name: str) -> tuple[str, ...]:
        """A list of strings; none if it is missing."""
        value = self.value.get(name, [])
        if not isinstance(value, list) or not all(isinstance(v, str) for v in value):
            self.bad(f"'{name}' is no list of texts")
        return tuple(value)

    def whole(self, name: str, low: int, high: int) -> int:
        """A whole number from `low` to `high`."""
        value = self.value.get(name)
        if not isinstance(value, int) or isinstance(value, bool) or not low <= value <= high:
            self.bad(f"'{name}' is no whole number from {low} to {high}")
        return value

    def numbers(self, name: str, count: int) -> list[float]:
        """`count` finite numbers."""
        value = self.value.get(name)
        if not isinstance(value, list) or len(value) != count:
            self.bad(f"'{name}' is not a list of {count} numbers")
        if not all(isinstance(v, (int, float)) and not isinstance(v, bool) and abs(v) < 1e300 for v in value):
            self.bad(f"'{name}' holds something that is no finite number")
        return [float(v) for v in value]

    def objects(self, name: str) -> list[Fields]:
        """A list of objects; none if it is missing."""
        value = self.value.get(name, [])
        if not isinstance(value, list):
            self.bad(f"'{name}' is no list")
        return [Fields(self.path, v, f"{self.place} {name}[{i}]".strip()) for i, v in enumerate(value)]

    def version(self, highest: int) -> None:
        """Refuses what a later version wrote."""
        found = self.whole("version", 0, 1 << 53)
        if not 1 <= found <= highest:
            self.bad(f"version {found} of the format; this package reads up to {highest}: update it")
