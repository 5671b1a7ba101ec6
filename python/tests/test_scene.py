"""What the program wrote is what the arrays say."""

from __future__ import annotations

import json
import shutil
import tempfile
import unittest
from pathlib import Path

import fmlgs
import numpy as np

from .support import PHOTOS, copied, trained


class SceneTest(unittest.TestCase):
    """A scene that was trained just now."""

    def setUp(self) -> None:
        self.scene = fmlgs.open_scene(trained())

    def test_counts_are_those_that_the_program_tells(self) -> None:
        told = fmlgs.run_json(["info", trained()])
        self.assertEqual(told["gaussians"], len(self.scene.gaussians))
        self.assertEqual(len(told["cameras"]), len(self.scene.photos))
        self.assertEqual([p.name for p in self.scene.photos], [c["name"] for c in told["cameras"]])
        self.assertTrue(any(p.held_out for p in self.scene.photos))

    def test_shapes_and_types(self) -> None:
        g, n = self.scene.gaussians, len(self.scene.gaussians)
        self.assertGreater(n, 100)
        shapes = {
            "positions": (n, 3), "log_scales": (n, 3), "quaternions": (n, 4), "opacity_logits": (n,),
            "harmonics": (n, (g.degree + 1) ** 2, 3), "scales": (n, 3), "opacities": (n,), "colors": (n, 3),
            "rotations": (n, 3, 3), "covariances": (n, 3, 3),
        }  # fmt: skip
        for name, shape in shapes.items():
            self.assertEqual(getattr(g, name).shape, shape, name)
        self.assertEqual((g.positions.dtype, g.scales.dtype, g.colors.dtype), (np.float64, np.float32, np.float32))
        self.assertEqual((self.scene.assignment.shape, self.scene.assignment.dtype), ((n,), np.uint32))
        self.assertEqual((self.scene.margins.shape, self.scene.margins.dtype), ((n,), np.float32))
        self.assertIn("fmlgs_object_code_0", g.extras)
        variances = np.linalg.eigvalsh(g.covariances)
        np.testing.assert_allclose(variances, np.sort(g.scales.astype(float) ** 2, axis=1), rtol=1e-4)

    def test_objects_are_the_three_boxes(self) -> None:
        scene = self.scene
        names = {i.name for i in scene.identities.values() if i.level == "object"}
        self.assertEqual(names, {"box 0", "box 1", "box 2"})
        [box] = scene.named("Box 1")
        self.assertIn(box, scene.children(fmlgs.NO_IDENTITY))
        members = scene.members(box)
        self.assertTrue(set(scene.assignment[members]) <= set(scene.descendants(box)))
        self.assertEqual(len(scene.members(99)), 0)
        # Their Gaussians lie where the boxes were when the photos were made, and are red, green and blue as they are.
        g = scene.gaussians
        boxes = np.array([[-0.8, 0.5, 0.0], [0.3, 0.5, 0.7], [0.6, 0.5, -0.7]])
        for color, center in enumerate(boxes):
            members = scene.members(scene.named(f"box {color}")[0])
            sure = members[(scene.margins[members] > 0.5) & (g.opacities[members] > 0.3)]
            at = np.median(g.positions[sure], axis=0)
            self.assertEqual(int(np.argmin(np.linalg.norm(boxes - at, axis=1))), color)
            self.assertLess(np.abs(at - center).max(), 0.6)
            self.assertEqual(int(np.argmax(np.median(g.colors[sure], axis=0))), color)

    def test_features_of_an_encoder(self) -> None:
        features = self.scene.identity_features
        assert features is not None
        count = len(self.scene.identities)
        self.assertEqual((features.encoder, features.raw.shape[:2]), ("demo", (count, 4)))
        seen = np.arange(4) < features.views[:, None]
        lengths = np.linalg.norm(features.raw.astype(float), axis=2)
        np.testing.assert_allclose(lengths[seen], 1, atol=1e-2)
        self.assertTrue((lengths[~seen] == 0).all())

    def test_gaussians_of_an_object_are_seen_in_its_mask(self) -> None:
        scene = self.scene
        [box], [other] = scene.named("box 1"), scene.named("box 2")

        def share(number: int, mask: np.ndarray, camera: fmlgs.Camera) -> float:
            at, depth = camera.project(scene.gaussians.positions[scene.members(number)])
            self.assertTrue((depth > 0).all())
            x, y = np.floor(at).astype(int).T
            inside = (x >= 0) & (y >= 0) & (x < camera.width_px) & (y < camera.height_px)
            return float(mask[y[inside], x[inside]].mean())

        for index in (1, 4):
            camera = scene.photos[index].camera
            answer = scene.query("box 1", camera=index)
            self.assertEqual((answer.verdict, answer.hits[0].identity), ("found", box))
            self.assertEqual((answer.mask.dtype, answer.mask.shape), (bool, (camera.height_px, camera.width_px)))
            self.assertEqual(answer.relevancy.shape, answer.mask.shape)
            self.assertEqual(answer.mask.sum(), answer.details["pixels"])
            self.assertGreater(share(box, answer.mask, camera), 0.6)
            self.assertLess(share(other, answer.mask, camera), 0.4)
            self.assertGreater(answer.relevancy[answer.mask].mean(), answer.relevancy[~answer.mask].mean())

    def test_a_camera_of_ones_own_draws_what_the_photos_does(self) -> None:
        photo = self.scene.photos[1]
        by_name = self.scene.query("box 1", camera=photo.name)
        by_camera = self.scene.query("box 1", camera=photo.camera)
        np.testing.assert_array_equal(by_name.mask, by_camera.mask)
        elsewhere = self.scene.query("box 1", camera=self.scene.photos[5].camera)
        self.assertFalse(np.array_equal(by_name.mask, elsewhere.mask))
        self.assertEqual(self.scene.query("box 1", camera=1, max_side=32).mask.shape, (24, 32))

    def test_what_is_not_there_is_no_answer(self) -> None:
        answer = self.scene.query("zyxgh", camera=1)
        self.assertEqual((bool(answer), answer.verdict, answer.mask.sum()), (False, "not found", 0))
        self.assertEqual(answer.details["unknown_words"], ["zyxgh"])
        # A text that looks like an option is a text.
        self.assertFalse(self.scene.query("--version", camera=1))
        with self.assertRaisesRegex(fmlgs.CommandError, "no photo and no file"):
            self.scene.query("box 1", camera="nowhere.jpg")

    def test_photos_are_found_and_read(self) -> None:
        photo = self.scene.photos[3]
        assert photo.path is not None
        self.assertTrue(photo.path.is_file())
        try:
            import PIL  # noqa: F401
        except ImportError:
            self.skipTest("no Pillow")
        self.assertEqual(photo.pixels().shape, (48, 64, 3))

    def test_a_plain_export_is_read_too(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            fmlgs.run(["export", trained(), "--out", Path(folder, "a.ply"), "--no-measure", "-q"])
            again = fmlgs.read_ply(Path(folder, "a.ply"))
        np.testing.assert_array_equal(again.positions, self.scene.gaussians.positions)
        np.testing.assert_array_equal(again.harmonics, self.scene.gaussians.harmonics)

    def test_positions_far_from_zero_keep_their_precision(self) -> None:
        big = "property double x\nproperty double y\nproperty double z\n"
        names = ["f_dc_0", "f_dc_1", "f_dc_2", "opacity", *(f"scale_{k}" for k in range(3)), *(f"rot_{k}" for k in range(4))]
        rest = "".join(f"property float {n}\n" for n in names)
        row = np.array([1e6 + 0.125, 2, 3], ">f8").tobytes() + np.array([0, 0, 0, np.inf, 0, 0, 0, 1, 0, 0, 0], ">f4").tobytes()
        with tempfile.TemporaryDirectory() as folder:
            path = Path(folder, "big.ply")
            text = f"ply\nformat binary_big_endian 1.0\nelement vertex 1\n{big}{rest}end_header\n"
            path.write_bytes(text.encode() + row)
            g = fmlgs.read_ply(path)
        self.assertEqual(g.positions.tolist(), [[1e6 + 0.125, 2, 3]])
        self.assertAlmostEqual(float(g.opacities[0]), 0.999999, places=5)
        self.assertEqual(g.rotations[0].tolist(), np.eye(3).tolist())

    def test_a_scene_of_the_first_version_and_one_without_objects(self) -> None:
        first = fmlgs.open_scene(PHOTOS.parent / "scene")
        self.assertEqual((len(first.gaussians), len(first.identities)), (196, 3))
        with tempfile.TemporaryDirectory() as folder:
            scene = copied(Path(folder))
            (scene / "semantic_map.safetensors").unlink()
            plain = fmlgs.open_scene(scene)
            self.assertEqual((len(plain.identities), plain.identity_features, plain.assignment.max()), (0, None, 0))
            shutil.rmtree(scene)

    def test_parts_belong_to_objects(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            scene = copied(Path(folder))
            path = scene / "semantic_map.safetensors"
            data = path.read_bytes()
            size = int.from_bytes(data[:8], "little")
            header = json.loads(data[8 : 8 + size])
            told = json.loads(header["__metadata__"]["fmlgs"])
            told["identities"]["list"][2].update(level="part", parent=1)
            told.pop("findings", None)
            header["__metadata__"]["fmlgs"] = json.dumps(told)
            text = json.dumps(header).encode()
            path.write_bytes(len(text).to_bytes(8, "little") + text + data[8 + size :])
            changed = fmlgs.open_scene(scene)
            self.assertEqual((changed.children(0), changed.children(1), changed.descendants(1)), ([1, 2], [3], [1, 3]))
            both = np.concatenate([self.scene.members(1), self.scene.members(3)])
            np.testing.assert_array_equal(changed.members(1), np.sort(both))


if __name__ == "__main__":
    unittest.main()
