"""Pages in notebooks: valid HTML, with everything escaped that could leave its place."""

from __future__ import annotations

import json
import os
import sys
import tempfile
import types
import unittest
from collections.abc import Iterator
from contextlib import contextmanager
from html.parser import HTMLParser
from pathlib import Path
from unittest import mock

import fmlgs

from .support import SAMPLES, copied

HOSTILE = "Tom's \"best\" </title></iframe><script>alert(1)</script> & <b>co"


class Read(HTMLParser):
    """Elements of a text with their attributes, its text, and whether every element is closed in its turn."""

    def __init__(self, html: str) -> None:
        super().__init__(convert_charrefs=True)
        self.elements: list[tuple[str, dict[str, str | None]]] = []
        self.text, self.open, self.is_nested = "", list[str](), True
        self.feed(html)
        self.close()

    def handle_starttag(self, tag: str, attrs: list[tuple[str, str | None]]) -> None:
        self.elements.append((tag, dict(attrs)))
        self.is_nested &= len({name for name, _ in attrs}) == len(attrs)
        self.open.append(tag)

    def handle_endtag(self, tag: str) -> None:
        self.is_nested &= bool(self.open) and self.open.pop() == tag

    def handle_data(self, data: str) -> None:
        self.text += data


class Title(Read):
    """The title of a page."""

    title = ""

    def handle_data(self, data: str) -> None:
        if self.open and self.open[-1] == "title":
            self.title += data


@contextmanager
def notebook() -> Iterator[list[object]]:
    """A notebook in a folder of its own; what it shows."""
    shown: list[object] = []
    display = types.ModuleType("IPython.display")
    display.display = shown.append  # type: ignore[attr-defined]
    module = types.ModuleType("IPython")
    module.get_ipython = lambda: types.SimpleNamespace(kernel=object())  # type: ignore[attr-defined]
    before = Path.cwd()
    modules = {"IPython": module, "IPython.display": display}
    with tempfile.TemporaryDirectory() as folder, mock.patch.dict(sys.modules, modules):
        os.chdir(folder)
        try:
            yield shown
        finally:
            os.chdir(before)


class FrameTest(unittest.TestCase):
    """What a cell gets."""

    PAGE = fmlgs.Page(HOSTILE, "<!DOCTYPE html><title>a \"b\" 'c' &lt; &amp; é</title><p>it's</p></iframe>", 420)

    def test_the_frame_holds_the_page_and_nothing_leaves_it(self) -> None:
        read = Read(self.PAGE._repr_html_())
        [(tag, attributes)] = read.elements
        self.assertEqual((tag, read.open, read.text, read.is_nested), ("iframe", [], "", True))
        self.assertEqual((attributes["srcdoc"], attributes["title"]), (self.PAGE.html, HOSTILE))
        self.assertIn("420px", attributes["style"] or "")
        self.assertEqual(attributes["sandbox"], "allow-scripts allow-forms")
        # The control: the same text without escapes is read as something else.
        raw = Read(f'<iframe title="{HOSTILE}" srcdoc="{self.PAGE.html}"></iframe>')
        self.assertTrue(len(raw.elements) > 1 or not raw.is_nested)

    def test_a_page_is_shown_in_the_cell(self) -> None:
        with notebook() as shown, mock.patch("fmlgs._scene.Scene._page", self.PAGE):
            scene = fmlgs.open_scene(copied(Path.cwd()))
            self.assertIsNone(scene.show(height_px=300))
            [page] = shown
            assert isinstance(page, fmlgs.Page)
            self.assertEqual((page.html, page.height_px), (self.PAGE.html, 300))
            self.assertEqual(scene._repr_html_(), self.PAGE._repr_html_())

    def test_a_large_page_is_a_file_beside(self) -> None:
        with notebook() as shown, mock.patch("fmlgs._page.MAX_INLINE_BYTES", 10):
            read = Read(self.PAGE._repr_html_())
            self.assertEqual([tag for tag, _ in read.elements], ["p"])
            self.assertIn("scene.show()", read.text)
            self.assertTrue(HOSTILE in read.text and read.is_nested)
            self.assertEqual(list(Path.cwd().iterdir()), [], "looking writes nothing")
            path = fmlgs._page.show(self.PAGE, None)
            assert path is not None
            self.assertEqual(path.read_text(encoding="utf-8"), self.PAGE.html)
            self.assertEqual(path.parent, Path.cwd())
            told = Read(shown[0]._repr_html_())  # type: ignore[attr-defined]
            self.assertEqual([tag for tag, _ in told.elements], ["p", "a"])
            self.assertEqual(told.elements[1][1]["href"], path.name)
            self.assertIn(path.name, told.text)
            # The same page is the same file, another page another one.
            self.assertEqual(fmlgs._page.show(self.PAGE, None), path)
            other = fmlgs._page.show(fmlgs.Page(HOSTILE, "<p>another page</p>"), None)
            self.assertNotEqual(other, path)
            self.assertEqual(len(list(Path.cwd().iterdir())), 2)

    def test_outside_of_a_notebook_the_browser_opens(self) -> None:
        with mock.patch("webbrowser.open") as browser, mock.patch.dict(sys.modules):
            sys.modules.pop("IPython", None)
            path = fmlgs._page.show(self.PAGE, None)
        assert path is not None
        self.addCleanup(path.parent.rmdir)
        self.addCleanup(path.unlink)
        browser.assert_called_once_with(path.resolve().as_uri())
        self.assertEqual(path.read_text(encoding="utf-8"), self.PAGE.html)

    def test_a_file_is_written_where_it_is_wanted(self) -> None:
        with notebook() as shown:
            path = fmlgs._page.show(self.PAGE, "my page.html")
            self.assertEqual((path, len(shown)), (Path("my page.html"), 1))
            href = Read(shown[0]._repr_html_()).elements[1][1]["href"]  # type: ignore[attr-defined]
            self.assertEqual(href, "my%20page.html")
            self.assertRaisesRegex(fmlgs.FileError, "nowhere.*another place", self.PAGE.save, "nowhere/a.html")


class SceneTest(unittest.TestCase):
    """Pages that the program writes."""

    def test_a_scene_is_its_page(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            path = copied(Path(folder))
            told = json.loads((path / "scene.json").read_text())
            (path / "scene.json").write_text(json.dumps({**told, "name": HOSTILE}))
            scene = fmlgs.open_scene(path)
            [(tag, attributes)] = Read(scene._repr_html_()).elements
        self.assertEqual((tag, attributes["title"]), ("iframe", HOSTILE))
        page = attributes["srcdoc"] or ""
        self.assertTrue(page.startswith("<!DOCTYPE html>") and "box 1" in page and "Content-Security-Policy" in page)
        self.assertEqual(Title(page).title, HOSTILE)

    def test_results_of_other_methods_have_pages_too(self) -> None:
        scene = fmlgs.open_scene(SAMPLES / "gaussian_grouping")
        grouping, title = scene.page(), scene.page(title="Mine").html
        self.assertTrue("class 7" in grouping.html and Title(title).title == "Mine")
        plain = fmlgs.open_scene(SAMPLES / "2dgs").page().html
        self.assertTrue(plain.startswith("<!DOCTYPE html>") and "class 7" not in plain, "the control")
        with self.assertRaises(fmlgs.CommandError):
            scene.page(options=["--no-such-option"])

    def test_a_scene_without_the_program_is_a_line(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            scene = fmlgs.open_scene(copied(Path(folder)))
            with mock.patch.dict(os.environ, FMLGS_BINARY="/nowhere/<fmlgs>"):
                read = Read(scene._repr_html_())
                self.assertEqual([tag for tag, _ in read.elements], ["p"])
                self.assertIn("/nowhere/<fmlgs>", read.text)
                self.assertRaises(fmlgs.ProgramNotFound, scene.show)


if __name__ == "__main__":
    unittest.main()
