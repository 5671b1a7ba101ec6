"""Calibrated pinhole cameras and the photos that they took."""

from __future__ import annotations

from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._files import Fields

#: Largest side of a picture in px.
_MAX_SIDE_PX = 16_384


@dataclass(frozen=True, eq=False)
class Camera:
    """A pinhole camera. Its axes: x right, y down, z forward."""

    #: Width of the picture in px.
    width_px: int
    #: Height of the picture in px.
    height_px: int
    #: Focal lengths along x and y in px.
    focal_px: tuple[float, float]
    #: Principal point in px from the top-left corner of the top-left pixel.
    principal_px: tuple[float, float]
    #: `[3, 3]`, a rotation whose columns are the camera's right, down and forward axes in the world.
    world_from_camera: npt.NDArray[np.float64]
    #: `[3]`, the camera's center in the world, scene units.
    center: npt.NDArray[np.float64]

    @property
    def intrinsics(self) -> npt.NDArray[np.float64]:
        """`[3, 3]`, the calibration matrix K, px."""
        (fx, fy), (cx, cy) = self.focal_px, self.principal_px
        return np.array([[fx, 0, cx], [0, fy, cy], [0, 0, 1]])

    def project(self, points: npt.ArrayLike) -> tuple[npt.NDArray[np.float64], npt.NDArray[np.float64]]:
        """Where points are seen.

        Args:
            points: `[..., 3]`, points in the world, scene units.

        Returns:
            `[..., 2]`, places in px (x right, y down; NaN for points that are not in front of the camera), and
            `[...]`, depths along the forward axis in scene units.
        """
        at = (np.asarray(points, np.float64) - self.center) @ self.world_from_camera
        depth = at[..., 2]
        z = np.where(depth > 0, depth, np.nan)[..., None]
        return at[..., :2] / z * self.focal_px + self.principal_px, depth

    def to_json(self) -> dict[str, Any]:
        """What ``fmlgs render --camera`` and ``fmlgs query --camera`` read from a file."""
        return {
            "width_px": int(self.width_px),
            "height_px": int(self.height_px),
            "focal_px": [float(v) for v in self.focal_px],
            "principal_px": [float(v) for v in self.principal_px],
            "world_from_camera": np.asarray(self.world_from_camera, np.float64).T.ravel().tolist(),
            "center": np.asarray(self.center, np.float64).tolist(),
        }


@dataclass(frozen=True, eq=False)
class Photo:
    """A photo that the scene was trained on, or that was held out."""

    #: Its name in its dataset.
    name: str
    #: Its camera at full resolution; distortion is undone, so the file's own pixels may lie a little elsewhere.
    camera: Camera
    #: Whether it was held out from training.
    held_out: bool
    #: Its file, if it is still where the scene says.
    path: Path | None

    def pixels(self) -> npt.NDArray[np.uint8]:
        """`[height, width, 3]`, red, green, blue of the file as it is. Needs Pillow (``pip install pillow``)."""
        if self.path is None:
            raise FileNotFoundError(f"the photo '{self.name}' is not where the scene was trained from")
        from PIL import Image

        with Image.open(self.path) as image:
            return np.array(image.convert("RGB"), np.uint8)


def read_camera(fields: Fields) -> Camera:
    """The camera that a JSON object describes."""
    camera = Camera(
        width_px=fields.whole("width_px", 1, _MAX_SIDE_PX),
        height_px=fields.whole("height_px", 1, _MAX_SIDE_PX),
        focal_px=_pair(fields.numbers("focal_px", 2)),
        principal_px=_pair(fields.numbers("principal_px", 2)),
        # Axis after axis.
        world_from_camera=np.array(fields.numbers("world_from_camera", 9)).reshape(3, 3).T.copy(),
        center=np.array(fields.numbers("center", 3)),
    )
    if min(camera.focal_px) <= 0:
        fields.bad("a focal length is not positive")
    axes = camera.world_from_camera
    is_rotation = np.abs(axes).max() <= 1.01 and np.allclose(axes.T @ axes, np.eye(3), atol=1e-3)
    if not is_rotation or np.linalg.det(axes) < 0:
        fields.bad("'world_from_camera' is no rotation")
    return camera


def read_photos(scene: Fields, dataset: Path | None) -> tuple[Photo, ...]:
    """The photos that `scene.json` lists; `dataset` is the folder or file that they come from."""
    root = dataset.parent if dataset is not None and dataset.is_file() else dataset
    photos = []
    for fields in scene.objects("cameras"):
        name = fields.text("name")
        camera = read_camera(Fields(fields.path, fields.value.get("camera"), f"{fields.place} camera"))
        photos.append(Photo(name, camera, fields.value.get("held_out") is True, _find(root, name)))
    return tuple(photos)


def _find(root: Path | None, name: str) -> Path | None:
    """The file of a photo within its dataset; COLMAP's names are relative to `images`."""
    if root is None or "\0" in name:
        return None
    for folder in (root, root / "images"):
        try:
            path = (folder / name).resolve()
            if path.is_relative_to(root.resolve()) and path.is_file():
                return path
        except (OSError, RuntimeError):
            continue
    return None


def _pair(values: list[float]) -> tuple[float, float]:
    return values[0], values[1]
