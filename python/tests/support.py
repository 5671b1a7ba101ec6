"""A small scene that the program itself writes, once for all tests."""

from __future__ import annotations

import atexit
import functools
import shutil
import tempfile
from pathlib import Path

import fmlgs
import numpy as np

#: Eight photos of three boxes, 64 x 48 px.
PHOTOS = Path(__file__).resolve().parents[2] / "tests" / "data" / "first_version" / "photos"


@functools.cache
def folder() -> Path:
    """A folder that is removed at the end."""
    path = Path(tempfile.mkdtemp(prefix="fmlgs-python-"))
    atexit.register(shutil.rmtree, path, ignore_errors=True)
    return path


@functools.cache
def trained() -> Path:
    """A trained scene with its objects; not to be changed."""
    photos, scene = folder() / "photos", folder() / "scene"
    shutil.copytree(PHOTOS, photos)
    fmlgs.run(["train", photos, "--out", scene, "--steps", "120", "--backend", "cpu", "-q"])
    fmlgs.run(["preprocess", scene, "--masks", photos, "-q"])
    return scene


def copied(to: Path) -> Path:
    """A copy of the scene that may be changed."""
    shutil.copytree(trained(), to / "scene", ignore=shutil.ignore_patterns("checkpoint.bin"))
    return to / "scene"


#: Small results in the exact formats of other methods, with what they mean.
SAMPLES = PHOTOS.parents[1] / "results"


def sample(name: str) -> np.ndarray:
    """An array that is expected of the samples."""
    return np.load(SAMPLES / f"{name}.npy", allow_pickle=False)


def sample_copied(name: str, to: Path) -> Path:
    """A copy of a sample that may be changed."""
    shutil.copytree(SAMPLES / name, to / name)
    return to / name
