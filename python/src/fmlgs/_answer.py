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
    #: What fits, best first; where nothing was found, what comes nearest.
    hits: tuple[Hit, ...]
    #: `[height, width]` bool, the pixels of the answer; none of them where it is out of view or not found.
    mask: npt.NDArray[np.bool_]
    #: `[height, width]` float32, relevancy of every pixel, 0 to 1.
    relevancy: npt.NDArray[np.float32]
    #: Everything that ``fmlgs query --json`` says.
    details: dict[str, Any]

    def __bool__(self) -> bool:
        return self.verdict != "not found"


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
        # By "=" and after "--", so that no text is taken for an option.
        flags = [f"--kind={kind}", f"--top={top}", f"--mask={mask}", f"--heat={heat}", "--json"]
        if isinstance(camera, Camera):
            file = Path(folder, "camera.json")
            file.write_text(json.dumps(camera.to_json()), encoding="utf-8")
            camera = str(file)
        if camera is not None:
            flags.append(f"--camera={camera}")
        if max_side is not None:
            flags.append(f"--max-side={max_side}")
        arguments = ["query", *flags, *options, "--", os.fspath(scene), text]
        code, stdout, stderr = _run(arguments, show=False)
        # What is not found ends with 1 as well, but has an answer.
        if code not in (0, 1) or not stdout.strip():
            raise CommandError(arguments, code, stdout, stderr)
        details = parse(arguments, stdout)
        try:
            hits = tuple(Hit(h["identity"], h["name"], h["score"], h["margin"]) for h in details["hits"])
            return Answer(text, details["answer"], hits, _array(mask, np.bool_), _array(heat, np.float32), details)
        except (KeyError, TypeError, ValueError, OSError) as error:
            raise FmlgsError(f"this program's answer is not understood ({error}); is it of another version?") from None


def _array(path: Path, kind: npt.DTypeLike) -> npt.NDArray[Any]:
    return np.asarray(np.load(path, allow_pickle=False), kind)
