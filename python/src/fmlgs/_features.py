"""Features of Gaussians: what another method stores for each of them."""

from __future__ import annotations

import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._errors import FmlgsError
from ._gaussians import Gaussians
from ._ply import read_ply
from ._program import parse, run

#: Levels of a scene with objects, and the properties of their codes.
_OWN = {level: [f"fmlgs_{level}_code_{k}" for k in range(3)] for level in ("object", "part")}


@dataclass(frozen=True, eq=False)
class LevelFeatures:
    """Features of the `N` Gaussians of a level."""

    #: Name of the level.
    level: str
    #: Names of all levels.
    levels: tuple[str, ...]
    #: ``"embeddings"``, ``"classes"``, ``"clusters"``, ``"affinities"``, or ``"codes"`` of a scene with objects.
    kind: str
    #: The level's Gaussians, in the order of the rows. Those of the scene, unless the level has its own.
    gaussians: Gaussians
    #: `[N, K]` float32, the numbers that are stored for each Gaussian; `[N]` int64, the numbers of clusters, -1 for
    #: none.
    codes: npt.NDArray[np.generic]
    #: `[N, dimension]` float32, decoded from the codes, of unit length, 0 for a Gaussian without one; `None` if they
    #: were not wanted.
    embeddings: npt.NDArray[np.float32] | None
    #: Encoder whose embeddings can be compared with these; `None` if the method knows no language.
    encoder: str | None


def levels_of(scene: Path, options: Sequence[str]) -> tuple[str, ...]:
    """Names of a result's levels."""
    return tuple(_told(_ask(scene, [], options))[0])


def of_result(
    scene: Path, gaussians: Gaussians, level: int | str | None, decoded: bool, options: Sequence[str]
) -> LevelFeatures:
    """Runs ``fmlgs features``; see `Scene.features`."""
    chosen = [] if level is None else [f"--level={level}"]
    with tempfile.TemporaryDirectory(prefix="fmlgs-") as folder:
        codes, embeddings, own = (Path(folder, name) for name in ("codes.npy", "embeddings.npy", "level.ply"))
        flags = [f"--codes={codes}", *([f"--embeddings={embeddings}"] if decoded else [])]
        facts = _ask(scene, [*chosen, *flags], options)
        levels, name = _told(facts)
        if facts.get("own_gaussians"):
            _ask(scene, [*chosen, f"--gaussians={own}"], options)
            gaussians = read_ply(own)
        found = LevelFeatures(
            level=name,
            levels=tuple(levels),
            kind=str(facts.get("kind")),
            gaussians=gaussians,
            codes=_rows(codes),
            embeddings=np.asarray(_rows(embeddings), np.float32) if decoded else None,
            encoder=facts.get("encoder"),
        )
    if len(found.codes) != len(gaussians):
        raise FmlgsError(f"{scene}: it has changed since it was opened: {len(found.codes):,} codes; open it again")
    return found


def of_scene(scene: Path, gaussians: Gaussians, level: int | str | None, decoded: bool) -> LevelFeatures:
    """Codes of the objects and parts that this program found; see `Scene.features`."""
    levels = tuple(_OWN)
    wanted = "object" if level is None else level
    if wanted in (1, 2, "1", "2"):
        wanted = levels[int(wanted) - 1]
    if not isinstance(wanted, str) or wanted not in _OWN:
        raise FmlgsError(f"{scene}: there is no level {level!r}; the levels are 1 to 2: {', '.join(levels)}")
    if not all(name in gaussians.extras for name in _OWN[wanted]):
        text = "no features of Gaussians: it is no result of another method, and has no codes"
        raise FmlgsError(f"{scene}: {text} of {wanted}s ('fmlgs preprocess' finds objects and parts)")
    if decoded:
        text = "its codes tell identities apart and are not decoded; 'identity_features' has embeddings"
        raise FmlgsError(f"{scene}: {text}")
    codes = np.stack([np.asarray(gaussians.extras[name], np.float32) for name in _OWN[wanted]], axis=1)
    return LevelFeatures(wanted, levels, "codes", gaussians, codes, None, None)


def _ask(scene: Path, flags: Sequence[str], options: Sequence[str]) -> dict[str, Any]:
    arguments = ["features", *flags, *options, "--json", "--", os.fspath(scene)]
    facts = parse(arguments, run(arguments))
    if not isinstance(facts, dict):
        raise FmlgsError("this program's answer is not understood; is it of another version?")
    return facts


def _told(facts: dict[str, Any]) -> tuple[list[str], str]:
    """Names of the levels, and of the one that was chosen."""
    levels, level = facts.get("levels"), facts.get("level")
    if not isinstance(levels, list) or not isinstance(level, str):
        raise FmlgsError("this program's answer names no levels; is it of another version?")
    return [str(name) for name in levels], level


def _rows(path: Path) -> npt.NDArray[Any]:
    try:
        return np.asarray(np.load(path, allow_pickle=False))
    except (OSError, ValueError) as error:
        raise FmlgsError(f"this program's array is not understood ({error}); is it of another version?") from None
