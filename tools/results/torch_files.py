"""PyTorch files as a training on a GPU leaves them, written without one."""

import io
import pickle
import random
import zipfile

import numpy as np
import torch

_SCALAR = np.float64(0).__reduce__()[0]


class _OldNumPyPickler(pickle._Pickler):
    """Pickler with the names of NumPy 1."""

    def save_global(self, obj, name=None):
        if obj is _SCALAR:
            self.write(b"cnumpy.core.multiarray\nscalar\n")
            self.memoize(obj)
        else:
            super().save_global(obj, name)


class _OldNumPy:
    """Stands in for the module `pickle`."""

    __name__ = "pickle"
    Pickler = _OldNumPyPickler


def save(obj, path, on_gpu=True, old_numpy=False):
    """Writes `obj` with `torch.save`; storages are tagged `cuda:0` as on a GPU."""
    path.parent.mkdir(parents=True, exist_ok=True)
    tag = torch.serialization.location_tag
    if on_gpu:
        torch.serialization.location_tag = lambda storage: "cuda:0"
    try:
        torch.save(obj, path, pickle_module=_OldNumPy if old_numpy else pickle)
    finally:
        torch.serialization.location_tag = tag


def adam(groups, step=7):
    """State of Adam after a step with made-up gradients; the parameters stay as they are."""
    optimizer = torch.optim.Adam(
        [{"params": [tensor], "lr": rate, "name": name} for name, tensor, rate in groups], lr=0.0, eps=1e-15
    )
    generator = torch.Generator().manual_seed(step)
    for _, tensor, _ in groups:
        tensor.grad = torch.randn(tensor.shape, generator=generator) * 1e-3
    kept = [tensor.detach().clone() for _, tensor, _ in groups]
    optimizer.step()
    for (_, tensor, _), values in zip(groups, kept):
        tensor.data.copy_(values)
        tensor.grad = None
    return optimizer.state_dict()


def parameter(array):
    """Parameter with these values."""
    return torch.nn.Parameter(torch.from_numpy(np.array(array, np.float32)))


def archive(entries):
    """Bytes of a zip file, uncompressed and with a fixed date, of names and bytes."""
    out = io.BytesIO()
    with zipfile.ZipFile(out, "w", zipfile.ZIP_STORED) as file:
        for name, data in entries:
            file.writestr(zipfile.ZipInfo(name, (1980, 1, 1, 0, 0, 0)), data)
    return out.getvalue()


def seeded(seed):
    """Random numbers of a sample, the same in each run."""
    random.seed(seed)
    torch.manual_seed(seed)
    return np.random.default_rng(seed)
