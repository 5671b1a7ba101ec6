"""Objects and their parts, from ``semantic_map.safetensors``."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import FileError
from ._files import Fields, open_file, parse_json

#: The number of no identity: what no object claims.
NO_IDENTITY = 0

_KEY = "fmlgs"
_VERSION = 1
_MAX_BYTES = 256 << 20
_MAX_HEADER_BYTES = 100_000_000
_VIEWS = 4
_TYPES = {"F32": "<f4", "F16": "<f2", "U32": "<u4"}


@dataclass(frozen=True)
class Identity:
    """An object or a part of one."""

    #: Its number, from 1.
    number: int
    #: ``"object"`` or ``"part"``.
    level: str
    #: The number of what it is a part of; `NO_IDENTITY` for objects. Smaller than its own number.
    parent: int
    #: What people or labels call it.
    names: tuple[str, ...]
    #: Its point in code space, each coordinate in 0 to 1.
    code: tuple[float, float, float]

    @property
    def name(self) -> str:
        """The first of its names, or its number: ``"#7"``."""
        return next((name for name in self.names if name.strip()), f"#{self.number}")


@dataclass(frozen=True, eq=False)
class Features:
    """What an image encoder makes of the `M` identities; row `i` is of identity `i + 1`."""

    #: The encoder's name.
    encoder: str
    #: `[M]`, how many views of each it has looked at, 0 to 4.
    views: npt.NDArray[np.uint32]
    #: `[M, 4, dimension]` float16, unit length; 0 beyond `views`.
    raw: npt.NDArray[np.float16]
    #: The same, those of parts mixed with their objects', which is what questions are compared with.
    deviated: npt.NDArray[np.float16]


@dataclass(frozen=True)
class SemanticMap:
    """The contents of the file."""

    identities: Mapping[int, Identity]
    features: Features | None
    state: str | None


def read_semantic_map(path: Path) -> SemanticMap:
    """Reads the file.

    Raises:
        FileError: If it cannot be read or is not what it should be.
    """
    file, size = open_file(path)
    with file:
        if size > _MAX_BYTES:
            raise FileError(path, f"{size:,} bytes; at most {_MAX_BYTES:,} are read")
        data = file.read(size)
    length = int.from_bytes(data[:8], "little")
    if len(data) < 8 or not 2 <= length <= min(_MAX_HEADER_BYTES, len(data) - 8):
        raise FileError(path, f"header: it cannot be {length:,} bytes long in a file of {len(data):,}")
    tensors = parse_json(path, data[8 : 8 + length], "header: ")
    metadata = tensors.get("__metadata__")
    text = metadata.get(_KEY) if isinstance(metadata, dict) else None
    if not isinstance(text, str):
        raise FileError(path, f"header: no metadata '{_KEY}': not a semantic map")
    fields = Fields(path, parse_json(path, text, "header: "), "header")
    fields.version(_VERSION)
    identities = _identities(fields)
    state = fields.value.get("state")
    encoder = fields.value.get("encoder")
    body = memoryview(data)[8 + length :]
    features = _features(path, tensors, body, encoder, len(identities)) if isinstance(encoder, str) else None
    return SemanticMap(identities, features, state if isinstance(state, str) else None)


def _identities(header: Fields) -> dict[int, Identity]:
    found: dict[int, Identity] = {}
    of = Fields(header.path, header.value.get("identities"), "header")
    for number, fields in enumerate(of.objects("list"), start=1):
        level = fields.text("level")
        if level not in ("object", "part"):
            fields.bad(f"the level {level[:40]!r} is neither 'object' nor 'part'")
        red, green, blue = fields.numbers("code", 3)
        parent = fields.whole("parent", 0, number - 1)
        found[number] = Identity(number, level, parent, fields.texts("names"), (red, green, blue))
    return found


def _features(path: Path, tensors: dict[str, Any], body: memoryview, encoder: str, count: int) -> Features:
    views = _tensor(path, tensors, body, "views", "U32", (count,))
    raw = _tensor(path, tensors, body, "raw", "F16", (count, _VIEWS, None))
    deviated = _tensor(path, tensors, body, "deviated", "F16", raw.shape)
    if (views > _VIEWS).any() or not (np.isfinite(raw).all() and np.isfinite(deviated).all()):
        raise FileError(path, "tensors 'views', 'raw', 'deviated': a value that cannot be")
    return Features(encoder, views, raw, deviated)


def _tensor(
    path: Path, tensors: dict[str, Any], body: memoryview, name: str, kind: str, shape: tuple[int | None, ...]
) -> npt.NDArray[Any]:
    fields = Fields(path, tensors.get(name), f"tensor '{name}'")
    found = fields.value.get("shape")
    fits = isinstance(found, list) and len(found) == len(shape)
    if not fits or not all(type(n) is int and n >= 0 and w in (None, n) for n, w in zip(found or [], shape)):
        fields.bad(f"its shape is not {list(shape)}".replace("None", "dimension"))
    if fields.text("dtype") != kind:
        fields.bad(f"its numbers are not of type {kind}")
    at = fields.value.get("data_offsets")
    dtype = np.dtype(_TYPES[kind])
    if not (isinstance(at, list) and len(at) == 2 and all(type(n) is int for n in at)):
        fields.bad("no 'data_offsets'")
    if not 0 <= at[0] <= at[1] <= len(body) or at[1] - at[0] != math.prod(found or []) * dtype.itemsize:
        fields.bad("its place is outside of the file, or of another size than its shape")
    # A copy: in the machine's own byte order, and writable.
    return np.frombuffer(body[at[0] : at[1]], dtype).reshape(found or []).astype(dtype.newbyteorder("="))
