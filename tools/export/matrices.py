"""Resizing as two products with constant matrices.

Engines differ in what their resize operators can do (anti-aliasing above all) and in how they round
coordinates. `rows @ picture @ columns^T` is the same operation, since resizing is linear and
separable, and every engine has a matrix product.
"""

import torch
import torch.nn.functional as F


def resizing(inputs, outputs, antialias, mode="bilinear"):
    """[outputs, inputs]: half-pixel centres, as torch.nn.functional.interpolate does it."""
    eye = torch.eye(inputs)[None, None]  # columns are unit impulses; only the first axis is resized
    return F.interpolate(eye, size=(outputs, inputs), mode=mode, align_corners=False, antialias=antialias)[0, 0].contiguous()


class Separable(torch.nn.Module):
    """A table [h*w,C] each of whose channels depends on the row alone or on the column alone, made of one row and one
    column of it when it is asked: a graph that is filled with weights later is to be small."""

    def __init__(self, table, h, w):
        super().__init__()
        grid = table.reshape(h, w, -1)
        by_row = (grid == grid[:, :1]).all(1).all(0)
        self.register_buffer("rows", (grid[:, :1] * by_row).contiguous())
        self.register_buffer("columns", (grid[:1] * ~by_row).contiguous())
        if not torch.equal(self(), table.reshape(h * w, -1)):
            raise SystemExit("a table of positions is not separable")

    def forward(self):
        return (self.rows + self.columns).reshape(self.rows.shape[0] * self.columns.shape[1], -1)
