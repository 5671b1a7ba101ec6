"""A scene: the folder that ``fmlgs train`` writes, or whatever else the program opens."""

from __future__ import annotations

import os
import tempfile
import time
import warnings
from collections.abc import Mapping, Sequence
from dataclasses import dataclass, replace
from functools import cached_property
from pathlib import Path
from types import MappingProxyType
from typing import Any

import numpy as np
import numpy.typing as npt

from . import _features, _page
from ._answer import Answer, Relevancy, ask, compare
from ._camera import Camera, Photo, read_photos
from ._errors import CommandError, FileError, FmlgsError
from ._features import LevelFeatures
from ._files import Fields, read_json
from ._gaussians import Gaussians
from ._identities import NO_IDENTITY, Features, Identity, read_semantic_map
from ._page import Page
from ._ply import read_ply
from ._program import _run, parse

_SCENE, _CLOUD, _MAP, _JOURNAL = "scene.json", "point_cloud.ply", "semantic_map.safetensors", ".fmlgs_commit.json"
_VERSION = 1
_STATE = "fmlgs state "
#: A save takes milliseconds once its files are written.
_TRIES, _PAUSE_SECS = 20, 0.025


@dataclass(frozen=True, eq=False)
class Scene:
    """A scene as it was when it was opened."""

    #: Its folder; of what other programs wrote, the path that was opened.
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
    identity_features: Features | None
    #: Length of a scene unit in meters, if that is known.
    meters_per_unit: float | None
    #: Everything that ``scene.json`` says: settings, history of the training.
    info: Mapping[str, Any]
    #: The method whose result it is; `None` for scenes of this program, plain trainings and splats.
    method: str | None = None
    #: Options of commands that its files need.
    options: tuple[str, ...] = ()

    def __repr__(self) -> str:
        counts = f"{len(self.gaussians):,} Gaussians, {len(self.photos)} photos, {len(self.identities)} identities"
        kind = "scene" if self.method is None else f"result of {self.method}"
        return f"<{kind} {self.name!r}: {counts}>"

    def _repr_html_(self) -> str:
        """What a notebook shows of it: its page, or a line that says why there is none."""
        try:
            return self._page._repr_html_()
        except FmlgsError as error:
            return _page.notice(f"{self!r} (no page: {error})")

    @cached_property
    def _page(self) -> Page:
        return self.page()

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
        return ask(self.folder, text, camera, max_side, kind, top, [*self.options, *options])

    def relevancy(
        self,
        phrase: str,
        camera: int | str | Camera | None = None,
        *,
        level: int | str | None = None,
        vectors: npt.ArrayLike | None = None,
        max_side: int | None = None,
        options: Sequence[str] = (),
    ) -> Relevancy:
        """How well a phrase fits each pixel of a view, with the masks by the method's own rule and by the common one.

        Args:
            phrase: What to look for, such as ``"red apple"``.
            camera: A photo by index or name, or a camera; without it, the first photo.
            level: Level of another method's result, by name or by number from 1; without it, that of the largest
                relevancy.
            vectors: `[1 + C, dimension]`, embeddings of the phrase and of the `C` canonical phrases, in place of the
                method's text encoder. Of results of other methods only.
            max_side: Shrinks the view to at most so many px along its longer side; without it, 1008.
            options: Further options of ``fmlgs query``.

        Raises:
            CommandError: If the command fails: without the text encoder, without language, without objects.
            ProgramNotFound: If there is no program.
        """
        return compare(self.folder, phrase, camera, max_side, level, vectors, [*self.options, *options])

    @cached_property
    def levels(self) -> tuple[str, ...]:
        """Names of the levels of another method's result; none of other scenes."""
        return () if self.method is None else _features.levels_of(self.folder, self.options)

    def features(self, level: int | str | None = None, *, decoded: bool = False) -> LevelFeatures:
        """What another method stores for each Gaussian; of a scene of this program, the codes of its objects or parts.

        Args:
            level: Level by name or by number from 1; without it, the first.
            decoded: Whether to decode the codes into embeddings: `N` times 512 numbers.

        Raises:
            CommandError: If the command fails: there is no such level, or the method knows no language.
            FmlgsError: If there are no features.
            ProgramNotFound: If there is no program.
        """
        if self.method is None:
            return _features.of_scene(self.folder, self.gaussians, level, decoded)
        return _features.of_result(self.folder, self.gaussians, level, decoded, self.options)

    def page(self, *, title: str | None = None, height_px: int = 600, options: Sequence[str] = ()) -> Page:
        """The scene as a page with its objects to click, which a notebook shows in a cell.

        Args:
            title: The page's title; without it, the scene's name.
            height_px: Height in a cell.
            options: Further options of ``fmlgs export``, such as ``["--sh-degree=0"]``.

        Raises:
            CommandError: If the command fails.
            ProgramNotFound: If there is no program.
        """
        flags = [] if title is None else [f"--title={title}"]
        return _page.export(self.folder, title or self.name or self.folder.name, height_px, [*flags, *options])

    def show(
        self, *, file: str | os.PathLike[str] | None = None, height_px: int = 600, options: Sequence[str] = ()
    ) -> Path | None:
        """Shows the scene's page: in the notebook's cell, or in the browser outside of a notebook.

        A page over 16 MiB does not become a part of the notebook: it is a file in the working folder, and the cell has
        the link.

        Args:
            file: The file that the page is put into, in every case.
            height_px: Height in a cell.
            options: Further options of ``fmlgs export``.

        Returns:
            The page's file; `None` if the page is in the cell.

        Raises:
            CommandError: If the command fails.
            FileError: If the file cannot be written.
            ProgramNotFound: If there is no program.
        """
        page = replace(self._page, height_px=height_px) if not options else self.page(height_px=height_px, options=options)
        return _page.show(page, file)


def open_scene(
    path: str | os.PathLike[str], *, decoder: str | os.PathLike[str] | None = None, top_k: int | None = None
) -> Scene:
    """Opens a scene of this program, or anything else that the program opens as Gaussians.

    Scenes of this program are read as they are. All else is read by the program (``fmlgs import`` into a folder that
    is removed): splat files, trainings of 3DGS, gsplat, splatfacto, 2DGS and Mip-Splatting, and results of LangSplat
    and other methods, whose classes and clusters become `identities`.

    Args:
        path: The folder that ``fmlgs train`` wrote; a folder or file of another program.
        decoder: Classifier, decoder, codebook or index of another method's result, if it is not beside it.
        top_k: Entries of the codebook for each Gaussian of LangSplatV2, if it was trained with others than 4.

    Raises:
        FileError: If a file is missing, broken, of another save than the others, or nothing that can be opened.
        ProgramNotFound: If it is no scene of this program and there is no program.
    """
    path = Path(path)
    if path.is_file() and (path.parent / _SCENE).is_file():
        path = path.parent
    is_other = path.exists() and not (path / _SCENE).exists()
    return _open_other(path, decoder, top_k) if is_other else _open_own(path)


def _open_other(path: Path, decoder: str | os.PathLike[str] | None, top_k: int | None) -> Scene:
    """Opens what another program wrote."""
    options = [] if decoder is None else [f"--decoder={os.fspath(decoder)}"]
    options += [] if top_k is None else [f"--top-k={top_k}"]
    with tempfile.TemporaryDirectory(prefix="fmlgs-") as folder:
        made = Path(folder, "scene")
        arguments = ["import", *options, f"--out={made}", "--json", "--", os.fspath(path)]
        code, stdout, stderr = _run(arguments, show=False)
        said = stderr.strip()
        if code == 1:
            raise FileError(path, said.rpartition("error: ")[2] or "the program does not open it")
        if code != 0:
            raise CommandError(arguments, code, stdout, stderr)
        done = parse(arguments, stdout)
        method = done.get("method") if isinstance(done, dict) else None
        scene = _open_once(made)
    if said:
        warnings.warn(said, stacklevel=3)
    return replace(scene, folder=path, method=method, options=tuple(options))


def _open_own(folder: Path) -> Scene:
    """Opens a scene of this program."""
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
        identity_features=features,
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
