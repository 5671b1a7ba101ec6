"""A trained scene: the folder that ``fmlgs train`` writes."""

from __future__ import annotations

import os
import time
from collections.abc import Mapping, Sequence
from dataclasses import dataclass
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from ._answer import Answer, ask
from ._camera import Camera, Photo, read_photos
from ._errors import FileError
from ._files import Fields, read_json
from ._gaussians import Gaussians
from ._identities import NO_IDENTITY, Features, Identity, read_semantic_map
from ._ply import read_ply

_SCENE, _CLOUD, _MAP, _JOURNAL = "scene.json", "point_cloud.ply", "semantic_map.safetensors", ".fmlgs_commit.json"
_VERSION = 1
_STATE = "fmlgs state "
#: A save takes milliseconds once its files are written.
_TRIES, _PAUSE_SECS = 20, 0.025


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene as it was when it was opened."""

    #: Its folder.
    folder: Path
    #: Its name.
    name: str
    #: The `N` Gaussians.
    gaussians: Gaussians
    #: The photos in their dataset's order.
    photos: tuple[Photo, ...]
    #: Objects and parts by their numbers, parents before their parts; empty where none were found yet.
    identities: Mapping[int, Identity]
    #: `[N]` uint32, the number of the innermost identity of each Gaussian; `NO_IDENTITY` for none.
    assignment: npt.NDArray[np.uint32]
    #: `[N]` float32, how clearly each Gaussian belongs there, 0 to 1. Nobody's with 0: nothing is known of it.
    margins: npt.NDArray[np.float32]
    #: What an encoder makes of the identities, if one has looked.
    features: Features | None
    #: Length of a scene unit in meters, if that is known.
    meters_per_unit: float | None
    #: Everything that ``scene.json`` says: settings, history of the training.
    info: Mapping[str, Any]

    def __repr__(self) -> str:
        counts = f"{len(self.gaussians):,} Gaussians, {len(self.photos)} photos, {len(self.identities)} identities"
        return f"<scene {self.name!r}: {counts}>"

    def children(self, number: int) -> list[int]:
        """Numbers of the parts of an identity; of `NO_IDENTITY`, those of the objects."""
        return [i.number for i in self.identities.values() if i.parent == number]

    def descendants(self, number: int) -> list[int]:
        """Its own number, those of its parts, of their parts, and so on, rising."""
        inside = {number} if number in self.identities else set[int]()
        for i in self.identities.values():
            if i.parent in inside and i.parent != NO_IDENTITY:
                inside.add(i.number)
        return sorted(inside)

    def named(self, name: str) -> list[int]:
        """Numbers of the identities that have this very name, whatever the case of its letters."""
        wanted = name.strip().casefold()
        return [i.number for i in self.identities.values() if any(n.strip().casefold() == wanted for n in i.names)]

    def members(self, number: int) -> npt.NDArray[np.int64]:
        """`[K]`, indices of the Gaussians of an identity and its parts, rising."""
        return np.flatnonzero(np.isin(self.assignment, self.descendants(number)))

    def query(
        self,
        text: str,
        *,
        camera: int | str | Camera | None = None,
        max_side: int | None = None,
        kind: str = "auto",
        top: int = 1,
        options: Sequence[str] = (),
    ) -> Answer:
        """Asks for an object or a part in a view, by ``fmlgs query``.

        Args:
            text: What to look for, such as ``"the lid of the kettle"``.
            camera: A photo by index or name, or a camera; without it, the first photo.
            max_side: Shrinks the view to at most so many px along its longer side; without it, 1008.
            kind: ``"auto"``, ``"object"`` or ``"part"``.
            top: How many answers' pixels go into the mask at most.
            options: Further options of ``fmlgs query``, such as ``["--recipe=paper"]``.

        Returns:
            The answer, false where nothing was found. The scene is asked as it is in its folder now.

        Raises:
            CommandError: If the command fails.
            ProgramNotFound: If there is no program.
        """
        return ask(self.folder, text, camera, max_side, kind, top, options)


def open_scene(folder: str | os.PathLike[str]) -> Scene:
    """Opens a trained scene.

    Args:
        folder: The folder that ``fmlgs train`` wrote.

    Raises:
        FileError: If a file is missing, broken, or of another save than the others.
    """
    folder = Path(folder)
    for last in range(_TRIES):
        try:
            scene = _open_once(folder)
            if not (folder / _JOURNAL).exists():
                return scene
            reason = "a save was interrupted; 'fmlgs info' of this folder finishes it"
            error = FileError(folder, reason)
        except _Torn as torn:
            error = torn
        # Somebody may be saving at this moment.
        if last < _TRIES - 1:
            time.sleep(_PAUSE_SECS)
    raise error


class _Torn(FileError):
    """Files of different saves."""


def _open_once(folder: Path) -> Scene:
    path = folder / _SCENE
    if folder.is_dir() and not path.exists():
        raise FileError(folder, f"no trained scene: it has no {_SCENE} ('fmlgs train' writes one)")
    fields = Fields(path, read_json(path))
    fields.version(_VERSION)
    state = fields.value.get("state")
    dataset = fields.value.get("dataset")
    name = dataset.get("path") if isinstance(dataset, dict) else None
    gaussians = read_ply(folder / _CLOUD)
    _same(folder / _CLOUD, state, next((c[len(_STATE) :] for c in gaussians.comments if c.startswith(_STATE)), None))
    count = len(gaussians)
    identities: dict[int, Identity] = {}
    assignment, margins = np.zeros(count, np.uint32), np.zeros(count, np.float32)
    features = None
    if (folder / _MAP).exists():
        semantic_map = read_semantic_map(folder / _MAP)
        _same(folder / _MAP, state, semantic_map.state)
        identities, features = dict(semantic_map.identities), semantic_map.features
        assignment = _assignment(folder / _CLOUD, gaussians, len(identities))
        margins = np.asarray(gaussians.extras.get("fmlgs_margin", margins), np.float32)
    units = fields.value.get("metres_per_unit")
    title = fields.value.get("name")
    return Scene(
        folder=folder,
        name=title if isinstance(title, str) else "",
        gaussians=gaussians,
        photos=read_photos(fields, folder / name if isinstance(name, str) and "\0" not in name else None),
        identities=MappingProxyType(identities),
        assignment=assignment,
        margins=margins,
        features=features,
        meters_per_unit=float(units) if isinstance(units, (int, float)) and 0 < units < 1e300 else None,
        info=MappingProxyType(fields.value),
    )


def _same(path: Path, state: Any, other: str | None) -> None:
    """Refuses a file of another save than the scene's."""
    if isinstance(state, str) and state != other:
        raise _Torn(path, f"it is of another save than {_SCENE}; put back the file that was")


def _assignment(path: Path, gaussians: Gaussians, count: int) -> npt.NDArray[np.uint32]:
    numbers = gaussians.extras.get("fmlgs_identity")
    if numbers is None:
        raise _Torn(path, f"it has no property 'fmlgs_identity', which {_MAP} needs; put back the file that was")
    values = np.asarray(numbers, np.float64)
    # NaN is neither.
    fits = (values >= 0) & (values <= count) & (values == np.floor(values))
    if not fits.all():
        raise _Torn(path, f"vertex {int(np.argmin(fits))} belongs to an identity that {_MAP} does not have")
    return values.astype(np.uint32)
