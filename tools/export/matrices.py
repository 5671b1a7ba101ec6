"""Resizing as two products with constant matrices.

Engines differ in what their resize operators can do (anti-aliasing above all) and in how they round
coordinates. `rows @ picture @ columns^T` is the same operation, since resizing is linear and
separable, and every engine has a matrix product.
"""

import torch
import torch.nn.functional as F


def resizing(inputs, outputs, antialias):
    """[outputs, inputs]: bilinear, half-pixel centres, as torch.nn.functional.interpolate does it."""
    eye = torch.eye(inputs)[None, None]  # columns are unit impulses; only the first axis is resized
    return F.interpolate(eye, size=(outputs, inputs), mode="bilinear", align_corners=False, antialias=antialias)[0, 0].contiguous()
