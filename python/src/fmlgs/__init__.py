"""Scenes of FMLGS as NumPy arrays, and its commands.

A scene is a folder that the program ``fmlgs`` has written: 3D Gaussians trained from photos, the
photos' cameras, and the objects and parts that were found. Reading it needs NumPy alone. Asking
questions, running commands, and opening splats, trainings of other programs and results of other
methods needs the program (see :func:`find_program`).

    >>> import fmlgs
    >>> scene = fmlgs.open_scene("scene/")
    >>> scene.gaussians.positions.shape
    (59981, 3)
    >>> answer = scene.query("the lid of the kettle", camera=3)
    >>> answer.mask.shape
    (300, 400)
    >>> result = fmlgs.open_scene("langsplat/output/ramen")
    >>> result.relevancy("chopsticks", camera=3, level="small").pixels.shape
    (731, 988)
    >>> result.features("small").codes.shape
    (1204821, 3)

Conventions: cameras look along +z with x right and y down; pixel centers are at half integers;
lengths are in scene units; arrays of a picture are ``[height, width]``.
"""

from ._answer import Answer, Hit, Relevancy
from ._camera import Camera, Photo
from ._errors import CommandError, FileError, FmlgsError, ProgramNotFound
from ._features import LevelFeatures
from ._gaussians import Gaussians
from ._identities import NO_IDENTITY, Features, Identity
from ._page import Page
from ._ply import read_ply
from ._program import find_program, run, run_json
from ._scene import Scene, open_scene

__version__ = "0.1.0"

__all__ = [
    "NO_IDENTITY",
    "Answer",
    "Camera",
    "CommandError",
    "Features",
    "FileError",
    "FmlgsError",
    "Gaussians",
    "Hit",
    "Identity",
    "LevelFeatures",
    "Page",
    "Photo",
    "ProgramNotFound",
    "Relevancy",
    "Scene",
    "find_program",
    "open_scene",
    "read_ply",
    "run",
    "run_json",
]
