"""3D Gaussians as arrays."""

from __future__ import annotations

import math
from collections.abc import Mapping
from dataclasses import dataclass

import numpy as np
import numpy.typing as npt

#: Value of the constant spherical harmonic.
_SH_0 = 0.28209479177387814


@dataclass(frozen=True, eq=False)
class Gaussians:
    """`N` Gaussians as they are stored; properties give what they mean."""

    #: `[N, 3]` float64, centers in the world, scene units.
    positions: npt.NDArray[np.float64]
    #: `[N, 3]` float32, natural logarithms of the standard deviations along the own axes, in scene units.
    log_scales: npt.NDArray[np.float32]
    #: `[N, 4]` float32, rotations as quaternions w, x, y, z of any length above 0.
    quaternions: npt.NDArray[np.float32]
    #: `[N]` float32, opacities before the sigmoid.
    opacity_logits: npt.NDArray[np.float32]
    #: `[N, (degree + 1)^2, 3]` float32, spherical harmonics of the color (red, green, blue).
    harmonics: npt.NDArray[np.float32]
    #: `[N]` each: further properties of the file by name, in its types.
    extras: Mapping[str, npt.NDArray[np.generic]]
    #: Comment lines of the file.
    comments: tuple[str, ...] = ()

    def __len__(self) -> int:
        return len(self.positions)

    def __repr__(self) -> str:
        return f"<{len(self):,} Gaussians, harmonics of degree {self.degree}, extras: {', '.join(self.extras) or '-'}>"

    @property
    def degree(self) -> int:
        """Degree of the spherical harmonics, 0 to 3."""
        return math.isqrt(self.harmonics.shape[1]) - 1

    @property
    def scales(self) -> npt.NDArray[np.float32]:
        """`[N, 3]`, standard deviations along the own axes, scene units."""
        return np.asarray(np.exp(self.log_scales), np.float32)

    @property
    def opacities(self) -> npt.NDArray[np.float32]:
        """`[N]`, opacities of the centers, 0 to 1."""
        # tanh never overflows.
        return np.asarray(0.5 * (1 + np.tanh(0.5 * self.opacity_logits)), np.float32)

    @property
    def colors(self) -> npt.NDArray[np.float32]:
        """`[N, 3]`, red, green, blue without the part that depends on the direction, 0 to 1."""
        return np.asarray(np.clip(0.5 + _SH_0 * self.harmonics[:, 0], 0, 1), np.float32)

    @property
    def rotations(self) -> npt.NDArray[np.float64]:
        """`[N, 3, 3]`, whose columns are the own axes in the world. A quaternion of length 0 turns nothing."""
        q = self.quaternions.astype(np.float64)
        length = np.linalg.norm(q, axis=1, keepdims=True)
        w, x, y, z = np.where(length > 0, q / np.where(length > 0, length, 1), [1.0, 0.0, 0.0, 0.0]).T
        rows = [
            [1 - 2 * (y * y + z * z), 2 * (x * y - w * z), 2 * (x * z + w * y)],
            [2 * (x * y + w * z), 1 - 2 * (x * x + z * z), 2 * (y * z - w * x)],
            [2 * (x * z - w * y), 2 * (y * z + w * x), 1 - 2 * (x * x + y * y)],
        ]
        return np.moveaxis(np.array(rows, np.float64), 2, 0)

    @property
    def covariances(self) -> npt.NDArray[np.float64]:
        """`[N, 3, 3]`, covariance matrices in the world, scene units squared."""
        axes = self.rotations * self.scales[:, None, :].astype(np.float64)
        return axes @ axes.transpose(0, 2, 1)
