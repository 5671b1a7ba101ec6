"""The program `fmlgs`: where it is, and running its commands."""

from __future__ import annotations

import json
import os
import shutil
import subprocess
import sysconfig
from collections.abc import Sequence
from pathlib import Path
from typing import Any

from ._errors import CommandError, FmlgsError, ProgramNotFound

_VARIABLE = "FMLGS_BINARY"
_NAME = "fmlgs.exe" if os.name == "nt" else "fmlgs"


def find_program() -> Path:
    """The program: what the environment variable ``FMLGS_BINARY`` names, else the one that was installed
    with this package, else the first in ``PATH``.

    Raises:
        ProgramNotFound: If there is none.
    """
    named = os.environ.get(_VARIABLE)
    if named:
        if not os.access(named, os.X_OK) or os.path.isdir(named):
            raise ProgramNotFound(f"{_VARIABLE} is {named!r}, which is no program that can be run")
        return Path(named).absolute()
    for scheme in (None, *(f"{name}_user" for name in ("posix", "nt", "osx_framework"))):
        schemes = sysconfig.get_scheme_names()
        if scheme is not None and scheme not in schemes:
            continue
        folder = sysconfig.get_path("scripts") if scheme is None else sysconfig.get_path("scripts", scheme)
        if folder and os.access(Path(folder) / _NAME, os.X_OK):
            return Path(folder) / _NAME
    found = shutil.which("fmlgs")
    if found is None:
        raise ProgramNotFound(
            f"the program 'fmlgs' was not found: install it, put its folder into PATH, or name it by {_VARIABLE}"
        )
    return Path(found).absolute()


def run(arguments: Sequence[str | os.PathLike[str]], *, show: bool = False) -> str:
    """Runs a command to its end, such as ``fmlgs.run(["train", "photos/", "--out", "scene/"])``.

    Ctrl-C asks it to stop at a safe point, waits for that, and raises `KeyboardInterrupt`.

    Args:
        arguments: Everything after ``fmlgs``.
        show: Whether progress and warnings go to this process's standard error as they come.

    Returns:
        What it wrote to standard output.

    Raises:
        CommandError: If it ends with another exit code than 0.
        ProgramNotFound: If there is no program.
    """
    code, stdout, stderr = _run(arguments, show)
    if code != 0:
        raise CommandError([os.fspath(a) for a in arguments], code, stdout, stderr)
    return stdout


def run_json(arguments: Sequence[str | os.PathLike[str]], *, show: bool = False) -> Any:
    """As :func:`run` with ``--json``: the document that the command writes, as Python objects."""
    return parse(arguments, run([*arguments, "--json"], show=show))


def parse(arguments: Sequence[str | os.PathLike[str]], stdout: str) -> Any:
    """The JSON document that a command wrote."""
    try:
        return json.loads(stdout)
    except (ValueError, RecursionError) as error:
        command = " ".join(os.fspath(a) for a in arguments)
        raise FmlgsError(f"'fmlgs {command}' wrote no JSON ({error}): {stdout[:200]!r}") from None


def _run(arguments: Sequence[str | os.PathLike[str]], show: bool) -> tuple[int, str, str]:
    if isinstance(arguments, str):
        raise TypeError("a list of arguments is expected, such as ['info', 'scene/']")
    command = [os.fspath(find_program()), *(os.fspath(a) for a in arguments)]
    streams = {"stdin": subprocess.DEVNULL, "stdout": subprocess.PIPE, "stderr": None if show else subprocess.PIPE}
    try:
        process = subprocess.Popen(command, **streams, encoding="utf-8", errors="replace")  # type: ignore[call-overload]
    except (OSError, ValueError) as error:
        raise FmlgsError(f"'{command[0]}' cannot be started: {error}") from None
    with process:
        try:
            stdout, stderr = process.communicate()
        except KeyboardInterrupt:
            # A terminal's Ctrl-C has reached the program as well: it stops at a safe point and saves.
            try:
                process.communicate()
            except KeyboardInterrupt:
                process.terminate()
            raise
        except BaseException:
            process.terminate()
            raise
    return process.returncode, stdout, stderr or ""
