"""Answers to questions about a scene."""

from __future__ import annotations

import json
import os
import tempfile
from collections.abc import Sequence
from dataclasses import dataclass
from pathlib import Path
from typing import Any

import numpy as np
import numpy.typing as npt

from ._camera import Camera
from ._errors import CommandError, FmlgsError
from ._program import _run, parse


@dataclass(frozen=True)
class Hit:
    """An identity that fits a question."""

    #: Its number.
    identity: int
    #: Its full name, its object after it: ``"lid · kettle"``.
    name: str
    #: How well it fits, 0 to 1.
    score: float
    #: By how much it fits better than others.
    margin: float


@dataclass(frozen=True, eq=False)
class Answer:
    """What a question finds in a view."""

    #: The question.
    text: str
    #: ``"found"``, ``"ambiguous"`` (the first hits fit alike) or ``"not found"``.
    verdict: str
    #: What fits, best first; where nothing was found, what comes nearest. None for embeddings of single Gaussians.
    hits: tuple[Hit, ...]
    #: `[height, width]` bool, the pixels of the answer; none of them where it is out of view or not found. Of
    #: embeddings of single Gaussians, those by the common rule.
    mask: npt.NDArray[np.bool_]
    #: `[height, width]` float32, relevancy of every pixel, 0 to 1.
    relevancy: npt.NDArray[np.float32]
    #: Everything that ``fmlgs query --json`` says.
    details: dict[str, Any]

    def __bool__(self) -> bool:
        return self.verdict != "not found"


@dataclass(frozen=True, eq=False)
class Relevancy:
    """How well a phrase fits each pixel of a view. NumPy takes it for the array `pixels`."""

    #: The phrase.
    text: str
    #: `[height, width]` float32, relevancy of every pixel, 0 to 1.
    pixels: npt.NDArray[np.float32]
    #: Name of the level that `pixels` are of; `None` for a scene with objects, which has one relevancy for all.
    level: str | None
    #: `[height, width]` bool, the mask by the method's own rule; `None` if it has none.
    own_mask: npt.NDArray[np.bool_] | None
    #: The own rule in words, or why there is none.
    own_rule: str
    #: `[height, width]` bool, the mask by the rule that is the same for all methods.
    common_mask: npt.NDArray[np.bool_]
    #: The common rule in words.
    common_rule: str
    #: Everything that ``fmlgs query --json`` says.
    details: dict[str, Any]

    def __array__(self, dtype: npt.DTypeLike = None, copy: bool | None = None) -> npt.NDArray[Any]:
        return np.array(self.pixels, dtype) if copy else np.asarray(self.pixels, dtype)


def ask(
    scene: Path,
    text: str,
    camera: int | str | Camera | None,
    max_side: int | None,
    kind: str,
    top: int,
    options: Sequence[str],
) -> Answer:
    """Runs ``fmlgs query``; see `Scene.query`."""
    with tempfile.TemporaryDirectory(prefix="fmlgs-") as folder:
        mask, heat = Path(folder, "mask.npy"), Path(folder, "heat.npy")
        flags = [f"--kind={kind}", f"--top={top}", f"--mask={mask}", f"--heat={heat}"]
        details = _query(scene, text, [*flags, *_view(folder, camera, max_side), *options])
        try:
            if "answer" in details:
                hits = tuple(Hit(h["identity"], h["name"], h["score"], h["margin"]) for h in details["hits"])
                verdict = details["answer"]
            else:
                # A result of another method, which was asked by its embeddings.
                hits, rules = (), (details["own_rule"], details["common_rule"])
                verdict = "found" if any(rule is not None and rule["pixels"] > 0 for rule in rules) else "not found"
            return Answer(text, verdict, hits, _array(mask, np.bool_), _array(heat, np.float32), details)
        except (KeyError, TypeError, ValueError, OSError) as error:
            raise _misunderstood(error) from None


def compare(
    scene: Path,
    text: str,
    camera: int | str | Camera | None,
    max_side: int | None,
    level: int | str | None,
    vectors: npt.ArrayLike | None,
    options: Sequence[str],
) -> Relevancy:
    """Runs ``fmlgs query --out``; see `Scene.relevancy`."""
    with tempfile.TemporaryDirectory(prefix="fmlgs-") as folder:
        out = Path(folder, "out")
        flags = [f"--out={out}", "--arrays", *_view(folder, camera, max_side)]
        if level is not None:
            flags.append(f"--level={level}")
        if vectors is not None:
            file = Path(folder, "vectors.npy")
            np.save(file, np.ascontiguousarray(vectors, np.float32), allow_pickle=False)
            flags.append(f"--vectors={file}")
        details = _query(scene, text, [*flags, *options])
        try:
            own, common = details["own_rule"], details["common_rule"]
            return Relevancy(
                text=text,
                pixels=_array(out / "relevancy.npy", np.float32),
                level=details.get("level"),
                own_mask=None if own is None else _array(out / "mask-own-rule.npy", np.bool_),
                own_rule=details["no_own_rule"] if own is None else own["rule"],
                common_mask=_array(out / "mask-common-rule.npy", np.bool_),
                common_rule=common["rule"],
                details=details,
            )
        except (KeyError, TypeError, ValueError, OSError) as error:
            raise _misunderstood(error) from None


def _view(folder: str, camera: int | str | Camera | None, max_side: int | None) -> list[str]:
    """Options of a view; a camera goes into a file in the folder."""
    flags = []
    if isinstance(camera, Camera):
        file = Path(folder, "camera.json")
        file.write_text(json.dumps(camera.to_json()), encoding="utf-8")
        camera = str(file)
    if camera is not None:
        flags.append(f"--camera={camera}")
    if max_side is not None:
        flags.append(f"--max-side={max_side}")
    return flags


def _query(scene: Path, text: str, flags: Sequence[str]) -> dict[str, Any]:
    # By "=" and after "--", so that no text is taken for an option.
    arguments = ["query", *flags, "--json", "--", os.fspath(scene), text]
    code, stdout, stderr = _run(arguments, show=False)
    # What is not found ends with 1 as well, but has an answer.
    if code not in (0, 1) or not stdout.strip():
        raise CommandError(arguments, code, stdout, stderr)
    details = parse(arguments, stdout)
    if not isinstance(details, dict):
        raise _misunderstood(TypeError("no object"))
    return details


def _misunderstood(error: Exception) -> FmlgsError:
    return FmlgsError(f"this program's answer is not understood ({error!r}); is it of another version?")


def _array(path: Path, kind: npt.DTypeLike) -> npt.NDArray[Any]:
    return np.asarray(np.load(path, allow_pickle=False), kind)
