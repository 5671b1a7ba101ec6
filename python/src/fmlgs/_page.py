"""A scene as a page: in a cell of a notebook, or in a browser."""

from __future__ import annotations

import hashlib
import os
import re
import sys
import tempfile
import webbrowser
from collections.abc import Callable, Sequence
from dataclasses import dataclass
from html import escape
from pathlib import Path
from typing import Any
from urllib.parse import quote

from ._errors import FileError, FmlgsError
from ._program import run

#: Largest page that becomes a part of the notebook, bytes; larger ones are files beside it.
MAX_INLINE_BYTES = 16 << 20


@dataclass(frozen=True, eq=False)
class Page:
    """The page that ``fmlgs export --html`` writes: it needs no server and loads nothing."""

    #: Its title.
    title: str
    #: The whole page.
    html: str
    #: Height in a cell, px.
    height_px: int = 600

    def __repr__(self) -> str:
        return f"<page {self.title!r}: {self.size:,} bytes>"

    @property
    def size(self) -> int:
        """Its size in bytes."""
        return len(self.html.encode())

    @property
    def is_large(self) -> bool:
        """Whether it is too large to become a part of a notebook."""
        return self.size > MAX_INLINE_BYTES

    def save(self, path: str | os.PathLike[str]) -> Path:
        """Writes the page to a file.

        Raises:
            FileError: If it cannot be written.
        """
        path = Path(path)
        try:
            path.write_text(self.html, encoding="utf-8", newline="\n")
        except OSError as error:
            raise FileError(path, f"{error.strerror or error}; choose another place") from None
        return path

    def beside(self, folder: str | os.PathLike[str]) -> Path:
        """Writes the page into a folder, under a name of its title and content: the same page is one file."""
        words = "-".join(re.findall(r"\w+", self.title)).lower()[:40] or "scene"
        path = Path(folder, f"{words}-{hashlib.sha256(self.html.encode()).hexdigest()[:8]}.html")
        return path if path.exists() else self.save(path)

    def _repr_html_(self) -> str:
        if self.is_large:
            return notice(f"{self.title}: a page of {_megabytes(self.size)}, too large for a cell; scene.show() puts it beside")
        # A frame of its own origin, which reaches nothing of the notebook. Its dialog is closed by a form.
        style = f"width: 100%; height: {self.height_px}px; border: 0"
        flags = 'sandbox="allow-scripts allow-forms" allow="clipboard-write; fullscreen" loading="lazy"'
        return f'<iframe title="{escape(self.title)}" style="{style}" {flags} srcdoc="{escape(self.html)}"></iframe>'


def export(scene: Path, title: str, height_px: int, options: Sequence[str]) -> Page:
    """Runs ``fmlgs export --html``; see `Scene.page`."""
    with tempfile.TemporaryDirectory(prefix="fmlgs-") as folder:
        file = Path(folder, "page.html")
        run(["export", f"--html={file}", *options, "--quiet", "--", os.fspath(scene)])
        try:
            return Page(title, file.read_text(encoding="utf-8"), height_px)
        except (OSError, UnicodeDecodeError) as error:
            raise FmlgsError(f"this program's page cannot be read ({error}); is it of another version?") from None


def show(page: Page, file: str | os.PathLike[str] | None) -> Path | None:
    """Puts the page where the user looks; see `Scene.show`."""
    display = _display()
    if display is not None and file is None and not page.is_large:
        display(page)
        return None
    if file is not None:
        path = page.save(file)
    else:
        path = page.beside(Path.cwd() if display is not None else tempfile.mkdtemp(prefix="fmlgs-page-"))
    if display is None:
        webbrowser.open(path.resolve().as_uri())
        return path
    try:
        link = quote(path.resolve().relative_to(Path.cwd().resolve()).as_posix())
    except ValueError:
        link = path.resolve().as_uri()
    why = f", too large for a cell: it is the file {path}" if page.is_large else f": it is the file {path}"
    display(_Html(notice(f"{page.title}: a page of {_megabytes(page.size)}{why}", link)))
    return path


def notice(text: str, link: str | None = None) -> str:
    """A line of HTML, with a link to a file if there is one."""
    opening = "" if link is None else f' <a href="{escape(link)}" target="_blank">Open</a>'
    return f"<p>{escape(text)}{opening}</p>"


@dataclass(frozen=True)
class _Html:
    """HTML that a notebook shows."""

    text: str

    def _repr_html_(self) -> str:
        return self.text


def _display() -> Callable[[Any], object] | None:
    """The function that shows things in the notebook that runs this; `None` outside of one."""
    module = sys.modules.get("IPython")
    shell = module.get_ipython() if module is not None and hasattr(module, "get_ipython") else None
    if shell is None or not hasattr(shell, "kernel"):
        return None
    from IPython.display import display

    function: Callable[[Any], object] = display
    return function


def _megabytes(size: int) -> str:
    return f"{size / (1 << 20):.1f} MiB"
