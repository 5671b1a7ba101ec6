"""Broken and hostile files: a clear error, in bounded memory, and never another exception."""

from __future__ import annotations

import json
import random
import tempfile
import tracemalloc
import unittest
from collections.abc import Callable
from pathlib import Path

import fmlgs

from .support import copied

FILES = ("scene.json", "point_cloud.ply", "semantic_map.safetensors")
#: What an attempt may set aside beyond what the whole scene takes, bytes.
MOST_BYTES = 8 << 20


class HostileTest(unittest.TestCase):
    """Files of a scene, one of them changed."""

    def setUp(self) -> None:
        self.folder = tempfile.TemporaryDirectory()
        self.addCleanup(self.folder.cleanup)
        self.scene = copied(Path(self.folder.name))
        self.good = {name: (self.scene / name).read_bytes() for name in FILES}

    def attempt(self, name: str, data: bytes) -> str | None:
        """Opens the scene with other bytes in a file; the error's text, `None` if it opens."""
        (self.scene / name).write_bytes(data)
        tracemalloc.start()
        try:
            fmlgs.open_scene(self.scene)
            return None
        except fmlgs.FileError as error:
            self.assertTrue(str(error).startswith(str(self.scene)), str(error))
            return error.reason
        finally:
            peak = tracemalloc.get_traced_memory()[1]
            tracemalloc.stop()
            (self.scene / name).write_bytes(self.good[name])
            self.assertLess(peak, MOST_BYTES, name)

    def refused(self, name: str, data: bytes, reason: str) -> None:
        self.assertRegex(self.attempt(name, data) or "it was accepted", reason)

    def test_files_cut_off_anywhere(self) -> None:
        self.assertIsNone(self.attempt(FILES[0], self.good[FILES[0]]), "the control")
        for name in FILES:
            good = self.good[name]
            for length in {0, 1, 7, 8, 9, 100, len(good) // 3, len(good) // 2, len(good) - 2}:
                self.assertIsNotNone(self.attempt(name, good[:length]), f"{name} of {length} bytes")

    def test_bytes_changed_anywhere(self) -> None:
        chance = random.Random(21)
        accepted = 0
        for round in range(240):
            name = FILES[round % 3]
            data = bytearray(self.good[name])
            for _ in range(chance.choice([1, 1, 4, 30])):
                # Mostly in the headers, where claims are.
                most = len(data) if chance.random() < 0.3 else min(len(data), 2500)
                data[chance.randrange(most)] = chance.choice([0, 9, 34, 48, 57, 91, 123, 128, 255, chance.randrange(256)])
            # Scenes of other saves are tried anew for half a second: not what is looked at here.
            with self.subTest(round=round, name=name):
                accepted += self.attempt_once(name, bytes(data)) is None
        self.assertTrue(0 < accepted < 240, f"{accepted} were accepted")

    def attempt_once(self, name: str, data: bytes) -> str | None:
        import fmlgs._scene as module

        tries, module._TRIES = module._TRIES, 1
        try:
            return self.attempt(name, data)
        finally:
            module._TRIES = tries

    def test_lying_counts_of_the_cloud(self) -> None:
        good = self.good["point_cloud.ply"]
        count = good.split(b"element vertex ")[1].split(b"\n")[0]
        claim = b"element vertex " + count

        def claimed(text: bytes) -> bytes:
            return good.replace(claim, b"element vertex " + text, 1)

        self.refused("point_cloud.ply", claimed(b"999999999999999"), "999,999,999,999,999 vertices are claimed")
        self.refused("point_cloud.ply", claimed(b"9" * 30), "is not a count")
        self.refused("point_cloud.ply", claimed(b"-1"), "is not a count")
        many = b"".join(b"property float p%d\n" % k for k in range(2000))
        self.refused("point_cloud.ply", good.replace(b"property float x\n", many + b"property float x\n", 1), "over 1024")
        self.refused("point_cloud.ply", good.replace(b"property float y\n", b"property float x\n", 1), "comes twice")
        self.refused("point_cloud.ply", good.replace(b"float y\n", b"list uchar int y\n", 1), "not understood")
        self.refused("point_cloud.ply", good.replace(b"property float rot_0\n", b"property float rot_9\n", 1), "'rot_0'")
        self.refused("point_cloud.ply", b"ply\n" + b"comment " + b"x" * (2 << 20), "no end")
        self.refused("point_cloud.ply", b"ply\nformat ascii 1.0\n", "fmlgs export")
        self.refused("point_cloud.ply", b"\x89PNG\r\n", "starts with the line 'ply'")

    def test_numbers_that_are_none_are_told_by_vertex(self) -> None:
        good = self.good["point_cloud.ply"]
        body = good.index(b"end_header\n") + len(b"end_header\n")
        nan = good[:body] + b"\x00\x00\xc0\x7f" + good[body + 4 :]
        self.refused("point_cloud.ply", nan, "vertex 0: 'x' is not a finite number")

    def test_lying_semantic_maps(self) -> None:
        name = "semantic_map.safetensors"
        good = self.good[name]
        size = int.from_bytes(good[:8], "little")

        def changed(change: Callable[[dict], object]) -> bytes:
            header = json.loads(good[8 : 8 + size])
            change(header)
            text = json.dumps(header).encode()
            return len(text).to_bytes(8, "little") + text + good[8 + size :]

        def told(change: Callable[[dict], object]) -> bytes:
            def within(header: dict) -> None:
                inner = json.loads(header["__metadata__"]["fmlgs"])
                change(inner)
                header["__metadata__"]["fmlgs"] = json.dumps(inner)

            return changed(within)

        self.assertIsNone(self.attempt(name, changed(lambda h: None)), "the control")
        self.refused(name, (1 << 62).to_bytes(8, "little") + good[8:], "header: it cannot be")
        self.refused(name, changed(lambda h: h["raw"].update(shape=[3, 4, 1 << 60])), "'raw'.*outside|'raw'.*another size")
        self.refused(name, changed(lambda h: h["raw"].update(shape=[1 << 40, 4, 8])), "'raw'.*shape")
        self.refused(name, changed(lambda h: h["raw"].update(data_offsets=[0, 1 << 62])), "'raw'.*outside")
        self.refused(name, changed(lambda h: h["views"].update(data_offsets=[-12, 0])), "'views'")
        self.refused(name, changed(lambda h: h.pop("deviated")), "'deviated'")
        self.refused(name, changed(lambda h: h.pop("__metadata__")), "not a semantic map")
        self.refused(name, told(lambda t: t.update(version=9)), "version 9.*update")
        self.refused(name, told(lambda t: t["identities"]["list"][0].update(parent=2)), "'parent'")
        self.refused(name, told(lambda t: t["identities"]["list"].pop()), "does not have|shape")
        self.refused(name, told(lambda t: t["identities"]["list"][1].update(code=[0, 1e999, 0])), "no number|finite")
        deep = b'{"a":' + b"[" * 200_000 + b"]" * 200_000 + b"}"
        self.refused(name, len(deep).to_bytes(8, "little") + deep, "header: nested too deeply|not valid JSON")

    def test_lying_descriptions(self) -> None:
        def told(change: Callable[[dict], object]) -> bytes:
            value = json.loads(self.good["scene.json"])
            change(value)
            return json.dumps(value).encode()

        def camera(**fields: object) -> bytes:
            return told(lambda s: s["cameras"][1]["camera"].update(fields))

        self.assertIsNone(self.attempt("scene.json", told(lambda s: s.update(later="x"))), "the control")
        self.refused("scene.json", camera(width_px=10**9), r"cameras\[1\] camera: 'width_px'")
        self.refused("scene.json", camera(width_px=True), "'width_px'")
        self.refused("scene.json", camera(focal_px=[0, 1]), "focal length")
        self.refused("scene.json", camera(center=[1, 2]), "'center'")
        self.refused("scene.json", camera(world_from_camera=[2, 0, 0, 0, 2, 0, 0, 0, 2]), "no rotation")
        self.refused("scene.json", told(lambda s: s.update(cameras=3)), "'cameras' is no list")
        self.refused("scene.json", told(lambda s: s.update(version=2)), "version 2")
        self.refused("scene.json", b'{"version": NaN}', "NaN is no number")
        self.refused("scene.json", b"[" * 100_000, "nested too deeply|not valid JSON")
        self.refused("scene.json", b'{"version": ' + b"9" * 10_000 + b"}", "not valid JSON|'version'")
        self.refused("scene.json", b"\xff\xfe", "not valid JSON")

    def test_photos_outside_of_their_folder_are_not_named(self) -> None:
        value = json.loads(self.good["scene.json"])
        photos = self.scene.parent / "photos"
        photos.mkdir()
        (photos / "a.png").touch()
        value["cameras"][0]["name"] = "a.png"
        (self.scene / "scene.json").write_text(json.dumps(value))
        self.assertEqual(fmlgs.open_scene(self.scene).photos[0].path, (photos / "a.png").resolve(), "the control")
        for name in ("../scene/scene.json", "/etc/passwd", "a\0b"):
            value["cameras"][0]["name"] = name
            (self.scene / "scene.json").write_text(json.dumps(value))
            self.assertIsNone(fmlgs.open_scene(self.scene).photos[0].path, name)

    def test_files_of_different_saves(self) -> None:
        value = json.loads(self.good["scene.json"])
        self.refused("scene.json", json.dumps({**value, "state": "0" * 32}).encode(), "another save")
        (self.scene / ".fmlgs_commit.json").write_text("{}")
        self.assertRaisesRegex(fmlgs.FileError, "interrupted.*fmlgs info", fmlgs.open_scene, self.scene)

    def test_what_is_no_scene_at_all(self) -> None:
        empty = Path(self.folder.name, "empty")
        empty.mkdir()
        for path, reason in ((empty, f"^{empty}: ."), ("/nowhere/at/all", "no such file")):
            self.assertRaisesRegex(fmlgs.FileError, reason, fmlgs.open_scene, path)
        self.assertRaisesRegex(fmlgs.FileError, "not a regular file", fmlgs.read_ply, self.folder.name)


if __name__ == "__main__":
    unittest.main()
