"""Finding the program and running its commands."""

from __future__ import annotations

import os
import signal
import subprocess
import sys
import tempfile
import time
import unittest
from pathlib import Path
from unittest import mock

import fmlgs

from .support import PHOTOS


class ProgramTest(unittest.TestCase):
    """The real program."""

    def test_a_command_that_fails_says_why(self) -> None:
        with self.assertRaises(fmlgs.CommandError) as caught:
            fmlgs.run(["info", "/nowhere/at/all"])
        self.assertEqual(caught.exception.code, 1)
        self.assertIn("/nowhere/at/all", str(caught.exception))
        with self.assertRaises(fmlgs.CommandError) as caught:
            fmlgs.run(["no-such-command", "x"])
        self.assertEqual(caught.exception.code, 2)
        with self.assertRaises(TypeError):
            fmlgs.run("info x")
        self.assertIn("0.", fmlgs.run(["--version"]))

    @unittest.skipUnless(os.name == "posix", "links need rights elsewhere")
    def test_the_program_is_found_in_order(self) -> None:
        named = fmlgs.find_program()
        with tempfile.TemporaryDirectory() as folder:
            other = Path(folder, "fmlgs")
            other.symlink_to(named)
            with mock.patch.dict(os.environ, PATH=folder), mock.patch("sysconfig.get_path", return_value="/nowhere"):
                os.environ.pop("FMLGS_BINARY", None)
                self.assertEqual(fmlgs.find_program(), other)
                os.environ["PATH"] = "/nowhere"
                self.assertRaisesRegex(fmlgs.ProgramNotFound, "FMLGS_BINARY", fmlgs.find_program)
                with mock.patch("sysconfig.get_path", return_value=folder):
                    self.assertEqual(fmlgs.find_program(), other)
                    os.environ["FMLGS_BINARY"] = str(named)
                    self.assertEqual(fmlgs.find_program(), named)
                for wrong in ("/nowhere/fmlgs", folder, __file__):
                    os.environ["FMLGS_BINARY"] = wrong
                    self.assertRaisesRegex(fmlgs.ProgramNotFound, "no program", fmlgs.find_program)

    @unittest.skipUnless(os.name == "posix", "a script of the shell")
    def test_a_program_that_writes_no_json(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            other = Path(folder, "fmlgs")
            other.write_text("#!/bin/sh\necho hello\n")
            other.chmod(0o755)
            with mock.patch.dict(os.environ, FMLGS_BINARY=str(other)):
                self.assertRaisesRegex(fmlgs.FmlgsError, "wrote no JSON.*hello", fmlgs.run_json, ["info", "x"])

    @unittest.skipUnless(os.name == "posix", "signals of a terminal")
    def test_ctrl_c_stops_at_a_safe_point_that_is_saved(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            scene = Path(folder, "scene")
            wanted = ["train", str(PHOTOS), "--out", str(scene), "--backend", "cpu", "-q", "--checkpoint-secs", "1"]
            # Whoever runs the tests may ignore Ctrl-C, as a shell's jobs in the background do.
            script = "import signal; signal.signal(signal.SIGINT, signal.default_int_handler); "
            script += f"import fmlgs; fmlgs.run({[*wanted, '--steps', '1000000']!r})"
            process = subprocess.Popen(
                [sys.executable, "-c", script], start_new_session=True, stderr=subprocess.PIPE, text=True
            )
            until = time.monotonic() + 120
            while not (scene / "checkpoint.bin").exists() and process.poll() is None and time.monotonic() < until:
                time.sleep(0.1)
            self.assertFalse((scene / "scene.json").exists(), "it is written at the end, or when stopped")
            os.killpg(process.pid, signal.SIGINT)
            _, stderr = process.communicate(timeout=120)
            self.assertIn("KeyboardInterrupt", stderr)
            self.assertGreater(len(fmlgs.open_scene(scene).gaussians), 0, "what was done is saved")


if __name__ == "__main__":
    unittest.main()
