"""Checkpoints that are damaged or malicious: none may be executed, and none may take memory. Nothing here is ever loaded."""

import pickle
import struct
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import torch

import torch_files
from torch_files import archive, parameter


class _Calls:
    """Is pickled as a call."""

    def __init__(self, function, *arguments):
        self.call = function, arguments

    def __reduce__(self):
        return self.call


def _pickled(pkl, storage=bytes(64)):
    return archive([("x/data.pkl", pkl), ("x/version", b"3\n"), ("x/data/0", storage)])


def _tensor(shape, strides, offset=0, elements=16, kind="FloatStorage"):
    """Pickle of a tensor with any claims."""

    def number(n):
        return b"\x8a\x08" + struct.pack("<q", n)

    def row(numbers):
        return b"(" + b"".join(number(n) for n in numbers) + b"t"

    storage = b"(X\x07\0\0\0storagectorch\n" + kind.encode() + b"\nX\x01\0\0\x000X\x06\0\0\0cuda:0" + number(elements) + b"tQ"
    tensor = b"ctorch._utils\n_rebuild_tensor_v2\n(" + storage + number(offset) + row(shape) + row(strides)
    return tensor + b"\x89ccollections\nOrderedDict\n)RtR"


def _scene(count=2, **changed):
    """12-tuple of 3DGS, with some tensors exchanged."""
    arrays = {
        "xyz": np.zeros((count, 3)), "dc": np.zeros((count, 1, 3)), "rest": np.zeros((count, 15, 3)),
        "scale": np.full((count, 3), -2.0), "rotation": np.tile([1.0, 0, 0, 0], (count, 1)), "opacity": np.ones((count, 1)),
    }
    parts = [parameter(a) for a in (arrays | changed).values()]
    counters = [torch.zeros(count), torch.zeros(count, 1), torch.zeros(count, 1)]
    content = (3, *parts, *counters, torch_files.adam([("xyz", parts[0], 1e-3)]), np.float64(3.5))
    with tempfile.TemporaryDirectory() as folder:
        path = Path(folder) / "chkpnt7.pth"
        torch_files.save((content, 7), path, old_numpy=True)
        return path.read_bytes()


def files():
    """Names and bytes."""
    import os

    two = _scene()
    nan = np.zeros((2, 3))
    nan[1, 2] = np.nan
    bomb = Path(tempfile.mkdtemp()) / "bomb"
    with zipfile.ZipFile(bomb, "w", zipfile.ZIP_DEFLATED) as file:
        file.writestr(zipfile.ZipInfo("x/data.pkl", (1980, 1, 1, 0, 0, 0)), b"N" * (9 << 20), zipfile.ZIP_DEFLATED)
    laughs = b"\x80\x02]q\0" + b"".join(b"]q" + bytes([i]) + b"(" + (b"h" + bytes([i - 1])) * 20 + b"e" for i in range(1, 60)) + b"."
    scalar = torch_files._SCALAR
    inner = pickle.dumps(_Calls(os.system, "true"), protocol=2)
    huge = 1 << 60
    return {
        "two.pth": two,
        "tensor.pth": _pickled(b"\x80\x02" + _tensor((4, 4), (4, 1)) + b"."),
        "system.pth": _pickled(pickle.dumps(_Calls(os.system, "true"), protocol=2)),
        "system_protocol_4.pth": _pickled(pickle.dumps(_Calls(os.system, "true"), protocol=4)),
        "eval_in_dictionary.pth": _pickled(pickle.dumps({"a": 1, "b": _Calls(eval, "1")}, protocol=2)),
        "scalar_of_objects.pth": _pickled(pickle.dumps(_Calls(scalar, np.dtype("O"), inner), protocol=2)),
        "scalar_too_long.pth": _pickled(pickle.dumps(_Calls(scalar, np.dtype("f8"), bytes(4096)), protocol=2)),
        "codec.pth": _pickled(b"\x80\x02c_codecs\nencode\nX\x01\0\0\0aX\x03\0\0\0zip\x86R."),
        "list_in_itself.pth": _pickled(b"\x80\x02]q\0h\0a."),
        "deep.pth": _pickled(b"\x80\x02" + b"]" * 20000 + b"a" * 19999 + b"."),
        "laughs.pth": _pickled(laughs),
        "huge_storage.pth": _pickled(b"\x80\x02" + _tensor((huge,), (1,), elements=huge) + b"."),
        "huge_shape.pth": _pickled(b"\x80\x02" + _tensor((huge, huge), (0, 0)) + b"."),
        "repeated_row.pth": _pickled(b"\x80\x02" + _tensor((1 << 40, 4), (0, 1)) + b"."),
        "negative_offset.pth": _pickled(b"\x80\x02" + _tensor((4,), (1,), offset=-4) + b"."),
        "negative_stride.pth": _pickled(b"\x80\x02" + _tensor((4,), (-1,)) + b"."),
        "storage_of_other_size.pth": _pickled(b"\x80\x02" + _tensor((16,), (1,)) + b".", bytes(12)),
        "wrong_shape.pth": _scene(xyz=np.zeros((2, 2))),
        "other_count.pth": _scene(opacity=np.ones((3, 1))),
        "not_a_number.pth": _scene(xyz=nan),
        "truncated.pth": two[: len(two) * 6 // 10],
        "without_end.pth": two[:-20],
        "bomb.pth": bomb.read_bytes(),
        "two_pickles.pth": archive([("x/data.pkl", b"\x80\x02N."), ("y/data.pkl", b"\x80\x02N.")]),
        "no_pickle.pth": archive([("x/data/0", bytes(64))]),
    }


def write(folder):
    folder.mkdir(parents=True, exist_ok=True)
    for name, data in files().items():
        (folder / name).write_bytes(data)
