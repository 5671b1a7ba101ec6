"""Gaussians from a binary ``.ply`` in the layout of the 3D Gaussian Splatting reference code."""

from __future__ import annotations

import os
from pathlib import Path
from typing import BinaryIO, NamedTuple

import numpy as np
import numpy.typing as npt

from ._errors import FileError
from ._files import open_file
from ._gaussians import Gaussians

_MAX_HEADER_BYTES = 1 << 20
_MAX_PROPERTIES = 1024
_TYPES = {
    **dict.fromkeys(("char", "int8"), "i1"),
    **dict.fromkeys(("uchar", "uint8"), "u1"),
    **dict.fromkeys(("short", "int16"), "i2"),
    **dict.fromkeys(("ushort", "uint16"), "u2"),
    **dict.fromkeys(("int", "int32"), "i4"),
    **dict.fromkeys(("uint", "uint32"), "u4"),
    **dict.fromkeys(("float", "float32"), "f4"),
    **dict.fromkeys(("double", "float64"), "f8"),
}
_ORDERS = {"binary_little_endian": "<", "binary_big_endian": ">"}
#: Of an opacity of 0.999999.
_MOST_LOGIT = 13.8155
_RESIDUALS = ("x_residual", "y_residual", "z_residual")
_REMEDY = "'fmlgs export' makes one of any splat that the program opens"


class _Header(NamedTuple):
    """What the header says of the vertices, which come first."""

    dtype: np.dtype[np.void]
    vertices: int
    comments: tuple[str, ...]


def read_ply(path: str | os.PathLike[str]) -> Gaussians:
    """The Gaussians of a binary splat ``.ply``, unknown properties included.

    Args:
        path: The file.

    Raises:
        FileError: If it cannot be read, is no such file, or holds a number that is not finite.
    """
    path = Path(path)
    file, size = open_file(path)
    with file:
        header = _header(path, file)
        possible = (size - file.tell()) // header.dtype.itemsize
        if header.vertices > possible:
            raise FileError(path, f"{header.vertices:,} vertices are claimed, but its size allows {possible:,}")
        rows = np.fromfile(file, header.dtype, header.vertices)
    if len(rows) != header.vertices:
        raise FileError(path, f"it ends after {len(rows):,} of {header.vertices:,} vertices; it changed while being read")
    return _gaussians(path, rows, header.comments)


def _header(path: Path, file: BinaryIO) -> _Header:
    def bad(reason: str) -> FileError:
        return FileError(path, f"header line {number}: {reason}")

    order: str | None = None
    element: str | None = None
    count, fields, comments, used = 0, dict[str, str](), list[str](), 0
    number = 0
    while True:
        number += 1
        line = file.readline(_MAX_HEADER_BYTES - used)
        used += len(line)
        if number == 1 and line.split() != [b"ply"]:
            raise bad("a PLY file starts with the line 'ply'")
        if not line.endswith(b"\n"):
            raise bad("the header has no end")
        try:
            text = line.decode().strip()
        except UnicodeDecodeError:
            raise bad("not text") from None
        words = text.split()
        match words:
            case ["ply"] if number == 1:
                pass
            case ["end_header"]:
                break
            case ["comment" | "obj_info", *_]:
                comments.append(text.partition(" ")[2].strip())
            case ["format", name, *_]:
                if name not in _ORDERS:
                    raise bad(f"the format {name!r} is not read, only binary ones; {_REMEDY}")
                order = _ORDERS[name]
            case ["element", name, claimed, *_]:
                if element is None and name != "vertex":
                    raise bad(f"{name!r} comes before the vertices, so these are no plain Gaussians; {_REMEDY}")
                if element is None and not (claimed.isascii() and claimed.isdigit() and len(claimed) < 19):
                    raise bad(f"{claimed[:40]!r} is not a count")
                count, element = (int(claimed), "vertex") if element is None else (count, name)
            case ["property", *rest] if element == "vertex":
                if len(rest) != 2 or rest[0] not in _TYPES or order is None:
                    raise bad(f"{text[:60]!r} is not understood")
                if rest[1] in fields or len(fields) == _MAX_PROPERTIES:
                    raise bad(f"the property {rest[1]!r} comes twice, or there are over {_MAX_PROPERTIES}")
                fields[rest[1]] = order + _TYPES[rest[0]]
            case ["property", *_] if element is not None:
                pass
            case []:
                pass
            case _:
                raise bad(f"{text[:60]!r} is not understood")
    if not fields:
        raise bad("no vertices")
    return _Header(np.dtype(list(fields.items())), count, tuple(comments))


def _gaussians(path: Path, rows: npt.NDArray[np.void], comments: tuple[str, ...]) -> Gaussians:
    known = set(rows.dtype.names or ())
    used: set[str] = {"nx", "ny", "nz"}

    def columns(names: list[str], kind: npt.DTypeLike) -> npt.NDArray[np.generic]:
        out = np.empty((len(rows), len(names)), kind)
        for k, name in enumerate(names):
            if name not in known:
                raise FileError(path, f"vertices without the property '{name}' (points or a mesh, not Gaussians)")
            used.add(name)
            with np.errstate(over="ignore", invalid="ignore"):
                out[:, k] = rows[name]
            # Other programs make infinite opacities of 0 and 1.
            if name == "opacity":
                out[:, k] = np.nan_to_num(out[:, k], nan=np.nan, posinf=_MOST_LOGIT, neginf=-_MOST_LOGIT)
            finite = np.isfinite(out[:, k])
            if not finite.all():
                raise FileError(path, f"vertex {int(np.argmin(finite))}: '{name}' is not a finite number")
        return out

    positions = np.asarray(columns(["x", "y", "z"], np.float64), np.float64)
    if known.issuperset(_RESIDUALS):
        positions += np.asarray(columns(list(_RESIDUALS), np.float32), np.float32)
    harmonics = np.asarray(columns(["f_dc_0", "f_dc_1", "f_dc_2"], np.float32), np.float32)[:, None, :]
    rest = sum(name.startswith("f_rest_") for name in known)
    if rest not in (0, 9, 24, 45):
        raise FileError(path, f"{rest} properties f_rest_*, expected 0, 9, 24 or 45")
    if rest:
        # All of red, then of green, then of blue.
        higher = np.asarray(columns([f"f_rest_{k}" for k in range(rest)], np.float32), np.float32)
        by_color = higher.reshape(len(rows), 3, rest // 3).transpose(0, 2, 1)
        harmonics = np.ascontiguousarray(np.concatenate([harmonics, by_color], axis=1))

    def singles(names: list[str]) -> npt.NDArray[np.float32]:
        return np.asarray(columns(names, np.float32), np.float32)

    return Gaussians(
        positions=positions,
        log_scales=singles(["scale_0", "scale_1", "scale_2"]),
        quaternions=singles(["rot_0", "rot_1", "rot_2", "rot_3"]),
        opacity_logits=singles(["opacity"])[:, 0],
        harmonics=harmonics,
        extras={name: _native(rows[name]) for name in rows.dtype.names or () if name not in used},
        comments=comments,
    )


def _native(values: npt.NDArray[np.generic]) -> npt.NDArray[np.generic]:
    """A copy in the machine's own byte order."""
    return values.astype(values.dtype.newbyteorder("="))
