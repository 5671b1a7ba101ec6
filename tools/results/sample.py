"""What the samples share: folders, the `.ply` of 3DGS, the checkpoint's tuple, the expected arrays."""

import json

import numpy as np
from plyfile import PlyData, PlyElement

import reference
import torch_files
from scene import cfg_args
from torch_files import parameter


def channel_major(sh):
    """The rest of the harmonics as a `.ply` stores it: all coefficients of red, then green, then blue."""
    return sh[:, 1:].transpose(0, 2, 1).reshape(len(sh), -1)


class Sample:
    """Folder of a method's result, with `expected/`."""

    def __init__(self, root, name, scene):
        self.folder, self.name, self.scene = root / name, name, scene

    def path(self, *parts):
        """Path below the folder, whose own folder is made."""
        path = self.folder.joinpath(*parts)
        path.parent.mkdir(parents=True, exist_ok=True)
        return path

    def text(self, text, *parts):
        self.path(*parts).write_text(text)

    def expect(self, name, array):
        """Saves an expected array; fractions as f32."""
        array = np.asarray(array)
        if array.dtype == np.float64:
            array = array.astype(np.float32)
        np.save(self.path("expected", f"{name}.npy"), np.ascontiguousarray(array))

    def model_folder(self, *parts, degree=3, extra=""):
        """The files that every training of 3DGS leaves beside its Gaussians."""
        self.text(cfg_args(self.name, self.scene.source, degree, extra), *parts, "cfg_args")
        self.text(json.dumps(self.scene.photos()), *parts, "cameras.json")

    def ply(self, *parts, rows=None, before=(), after_harmonics=(), after_opacity=(), after=(), last=(), scales=3,
            harmonics=True):
        """Writes a `.ply` of 3DGS; further columns are pairs of names and an array of as many columns."""
        s, rows = self.scene, slice(None) if rows is None else rows
        columns = [(["x", "y", "z"], s.xyz[rows]), (["nx", "ny", "nz"], np.zeros_like(s.xyz[rows])), *before]
        if harmonics:
            columns += [
                ([f"f_dc_{i}" for i in range(3)], s.sh[rows, 0]),
                ([f"f_rest_{i}" for i in range(45)], channel_major(s.sh[rows])),
            ]
        columns += [
            *after_harmonics,
            (["opacity"], s.opacity[rows]),
            *after_opacity,
            ([f"scale_{i}" for i in range(scales)], s.log_scale[rows, :scales]),
            ([f"rot_{i}" for i in range(4)], s.rotation[rows]),
            *after,
        ]
        kinds, values = [], []
        for names, array in [*columns, *last]:
            kind = "u1" if array.dtype == np.uint8 else "f4"
            kinds += [(name, kind) for name in names]
            values += list(array.T)
        vertices = np.empty(len(values[0]), kinds)
        for (name, _), column in zip(kinds, values):
            vertices[name] = column
        PlyData([PlyElement.describe(vertices, "vertex")]).write(str(self.path(*parts)))

    def plain_parts(self, rows=slice(None), scales=3):
        """Parameters of the Gaussians, in the order of the checkpoint's tuple from 1 to 6."""
        s = self.scene
        arrays = [
            s.xyz[rows], s.sh[rows, :1], s.sh[rows, 1:], s.log_scale[rows, :scales], s.rotation[rows], s.opacity[rows]
        ]
        return [parameter(a) for a in arrays]

    def counters(self, rows=slice(None)):
        """max_radii2D, xyz_gradient_accum and denom of the checkpoint's tuple."""
        import torch

        n, r = len(self.scene.xyz[rows]), np.random.default_rng(5)
        return [torch.from_numpy(r.uniform(0, 9, size).astype(np.float32)) for size in ((n,), (n, 1), (n, 1))]

    def checkpoint(self, parts, tensors, groups, *path, iteration=30000, rows=slice(None), scale=None, **how):
        """Writes `chkpntN.pth`: degree, tensors, counters, Adam's state, the scale of the learning rate."""
        scale = np.float32(3.52) if scale is None else scale
        content = (3, *parts, *tensors, *self.counters(rows), torch_files.adam(groups), scale)
        torch_files.save((content, iteration), self.path(*path), **how)

    def blended(self, values, rows=slice(None), camera=0):
        """Values of Gaussians blended at each pixel of a camera, [H, W, C]."""
        return self.weights(rows, camera) @ np.asarray(values, np.float64)

    def weights(self, rows=slice(None), camera=0):
        s = self.scene
        return reference.weights(s.cameras()[camera], s.xyz[rows], s.log_scale[rows], s.rotation[rows], s.opacity[rows])
