"""What can go wrong, each with a message that names the place and what to do."""

from __future__ import annotations

import os
from collections.abc import Sequence


class FmlgsError(Exception):
    """Any error of this package."""


class FileError(FmlgsError):
    """A file that cannot be read or is not what it should be."""

    def __init__(self, path: str | os.PathLike[str], reason: str) -> None:
        #: The file.
        self.path = os.fspath(path)
        #: The place in it, what is wrong there, and what can be done.
        self.reason = reason
        super().__init__(f"{self.path}: {reason}")


class ProgramNotFound(FmlgsError):
    """There is no ``fmlgs`` program to run."""


class CommandError(FmlgsError):
    """A command that failed, with what it said."""

    def __init__(self, arguments: Sequence[str], code: int, stdout: str, stderr: str) -> None:
        #: The arguments, without the program.
        self.arguments = list(arguments)
        #: 1 failed, 2 invalid arguments, 130 canceled; negative: ended by that signal.
        self.code = code
        #: Standard output.
        self.stdout = stdout
        #: Standard error.
        self.stderr = stderr
        said = stderr.strip() or "it said nothing"
        super().__init__(f"'fmlgs {' '.join(self.arguments)}' ended with exit code {code}: {said}")
