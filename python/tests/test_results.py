"""Trainings of other programs and results of other methods, compared with plain references."""

from __future__ import annotations

import os
import tempfile
import unittest
import warnings
from pathlib import Path
from unittest import mock

import fmlgs
import numpy as np

from .support import SAMPLES, sample, sample_copied, trained

#: Largest difference from the reference.
TOLERANCE = 1e-4
#: What another level, view or phrase differs by at least.
OTHER = 1e-3


def opened(name: str) -> fmlgs.Scene:
    """A sample, opened. Its photos are not here, which is a warning."""
    with warnings.catch_warnings():
        warnings.simplefilter("ignore")
        return fmlgs.open_scene(SAMPLES / name)


def apart(a: object, b: object) -> float:
    """Largest difference of numbers."""
    return float(np.abs(np.asarray(a, np.float64) - np.asarray(b, np.float64)).max())


class OpenTest(unittest.TestCase):
    """Everything that the program opens."""

    def test_trainings_have_the_gaussians_that_were_written(self) -> None:
        for name in ("3dgs", "3dgs/chkpnt30000.pth", "gsplat", "gsplat/ckpts/ckpt_29999_rank1.pt"):
            with self.subTest(name):
                scene = opened(name)
                self.assertEqual((scene.method, scene.folder, len(scene.identities)), (None, SAMPLES / name, 0))
                g = scene.gaussians
                self.assertLess(apart(g.positions, sample("scene/xyz")), 1e-6)
                np.testing.assert_array_equal(g.log_scales, sample("scene/log_scale"))
                np.testing.assert_array_equal(g.quaternions, sample("scene/rotation"))
                np.testing.assert_array_equal(g.opacity_logits, sample("scene/opacity").ravel())
                np.testing.assert_array_equal(g.harmonics.reshape(32, -1), sample("scene/sh").reshape(32, -1))
        self.assertEqual(len(opened("3dgs/point_cloud/iteration_7000").gaussians), 12, "the control: an earlier iteration")
        self.assertEqual([p.name for p in opened("3dgs").photos], ["view_0", "view_1"])

    def test_disks_filters_and_other_worlds(self) -> None:
        disks, mip, world = (opened(name).gaussians for name in ("2dgs", "mip_splatting", "splatfacto"))
        np.testing.assert_array_equal(disks.log_scales[:, :2], sample("scene/log_scale")[:, :2])
        np.testing.assert_allclose(mip.scales, sample("mip_splatting/expected/scales_with_filter"), rtol=1e-5)
        filtered = sample("mip_splatting/expected/opacity_with_filter").ravel()
        np.testing.assert_allclose(mip.opacities, filtered, rtol=1e-5)
        self.assertGreater(apart(mip.scales, np.exp(sample("scene/log_scale"))), OTHER, "the control: without the filter")
        self.assertLess(apart(world.positions, sample("splatfacto/expected/world_xyz")), 1e-5)
        self.assertGreater(apart(world.positions, sample("splatfacto/expected/means")), 0.1, "the control: as trained")

    def test_results_have_their_methods_cameras_and_gaussians(self) -> None:
        methods = {
            "gaussian_grouping": "Gaussian Grouping",
            "opengaussian": "OpenGaussian",
            "thgs": "THGS",
            "saga": "SAGA",
            "langsplat/output": "LangSplat",
            "langsplat_v2/output": "LangSplatV2",
            "legaussians/output": "LEGaussians",
            "dr_splat": "Dr.Splat",
            "occams_lgs": "Occam's LGS",
        }
        for name, method in methods.items():
            with self.subTest(name):
                scene = opened(name)
                self.assertEqual((scene.method, len(scene.photos)), (method, 2))
                self.assertLess(apart(scene.gaussians.positions, sample("scene/xyz")), 1e-6)
                self.assertIn(method, repr(scene))
        for name, method in {"ludvig": "LUDVIG", "feature_3dgs/lseg": "Feature 3DGS"}.items():
            self.assertEqual(opened(name).method, method)

    def test_classes_and_clusters_are_identities(self) -> None:
        grouping = opened("gaussian_grouping")
        classes = sample("gaussian_grouping/expected/classes_gaussians").ravel()
        names = {number: identity.name for number, identity in grouping.identities.items()}
        self.assertEqual(set(names.values()), {"class 3", "class 7", "class 200"})
        # Class 0 is nothing.
        found = [names.get(int(number), "class 0") for number in grouping.assignment]
        self.assertEqual(found, [f"class {c}" for c in classes])
        answer = grouping.query("class 7", camera=0)
        self.assertEqual((answer.verdict, answer.hits[0].name), ("found", "class 7"))
        self.assertGreater(answer.mask.sum(), 0)
        self.assertFalse(grouping.query("giraffe", camera=0))
        thgs = opened("thgs")
        levels = [i.level for i in thgs.identities.values()]
        self.assertEqual((levels.count("object"), levels.count("part")), (4, 8))

    def test_splat_files_of_other_formats(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            for ending in (".ply", ".splat", ".spz", ".compressed.ply"):
                file = Path(folder, f"a{ending}")
                fmlgs.run(["export", SAMPLES / "3dgs", "--out", file, "--no-measure", "-q"])
                scene = fmlgs.open_scene(file)
                self.assertEqual((len(scene.gaussians), scene.photos), (32, ()), ending)

    def test_a_file_of_a_scene_opens_the_scene(self) -> None:
        scene = fmlgs.open_scene(trained() / "point_cloud.ply")
        self.assertEqual((scene.folder, len(scene.identities)), (trained(), 3))

    def test_what_cannot_be_opened_is_named_with_the_remedy(self) -> None:
        with tempfile.TemporaryDirectory() as folder:
            clusters = sample_copied("opengaussian", Path(folder))
            self.assertEqual(len(fmlgs.open_scene(clusters).identities), 12, "the control")
            (clusters / "cluster_lang.npz").unlink()
            with self.assertRaises(fmlgs.FileError) as caught:
                fmlgs.open_scene(clusters)
            self.assertEqual(caught.exception.path, str(clusters))
            self.assertIn("cluster_lang.npz", caught.exception.reason)
            named = fmlgs.open_scene(clusters, decoder=SAMPLES / "opengaussian" / "cluster_lang.npz")
            self.assertEqual(len(named.identities), 12, "a file that is named")
            checkpoint = Path(folder, "chkpnt30000.pth")
            good = (SAMPLES / "3dgs" / "chkpnt30000.pth").read_bytes()
            for length in (0, 1, 100, len(good) // 2, len(good) - 1):
                checkpoint.write_bytes(good[:length])
                self.assertRaisesRegex(fmlgs.FileError, "chkpnt30000.pth", fmlgs.open_scene, checkpoint)
            checkpoint.write_bytes(b"cos\nsystem\n(S'true'\ntR.")
            self.assertRaisesRegex(fmlgs.FileError, "chkpnt30000.pth", fmlgs.open_scene, checkpoint)
            empty = Path(folder, "empty")
            empty.mkdir()
            self.assertRaisesRegex(fmlgs.FileError, str(empty), fmlgs.open_scene, empty)
        with mock.patch.dict(os.environ, FMLGS_BINARY="/nowhere/fmlgs"):
            self.assertRaises(fmlgs.ProgramNotFound, opened, "3dgs")
            self.assertEqual(len(fmlgs.open_scene(trained()).identities), 3, "a scene of the program needs none")
        with self.assertRaises(fmlgs.CommandError) as caught_command:
            fmlgs.open_scene(SAMPLES / "langsplat_v2" / "output", top_k=0)
        self.assertEqual(caught_command.exception.code, 2)

    def test_warnings_of_the_program_are_warnings(self) -> None:
        def told(path: Path) -> list[tuple[str, str]]:
            with warnings.catch_warnings(record=True) as caught:
                warnings.simplefilter("always")
                fmlgs.open_scene(path)
            return [(str(w.message), w.filename) for w in caught]

        # Its photos are not here; told where the scene is opened.
        [(text, file)] = told(SAMPLES / "3dgs")
        self.assertEqual((file, "data/made_up" in text), (__file__, True), text)
        self.assertEqual(told(SAMPLES / "ludvig" / "gaussians.ply"), [], "the control")


class FeaturesTest(unittest.TestCase):
    """Codes and embeddings of single Gaussians."""

    def test_codes_and_embeddings_of_each_level(self) -> None:
        scene = opened("langsplat/output")
        self.assertEqual(scene.levels, ("small", "medium", "large"))
        for k, name in enumerate(scene.levels, start=1):
            features, other = scene.features(name, decoded=True), k % 3 + 1
            self.assertEqual((features.level, features.kind, features.encoder), (name, "embeddings", "clip-vit-b16"))
            np.testing.assert_array_equal(features.codes, sample(f"langsplat/expected/codes_{k}"))
            self.assertFalse(np.array_equal(features.codes, sample(f"langsplat/expected/codes_{other}")), "the control")
            assert features.embeddings is not None
            rows = sample(f"langsplat/expected/decoded_first_rows_{k}")
            self.assertLess(apart(features.embeddings[: len(rows)], rows), TOLERANCE)
            wrong = sample(f"langsplat/expected/decoded_first_rows_{other}")
            self.assertGreater(apart(features.embeddings[: len(rows)], wrong), OTHER, "the control: another level")
            self.assertEqual((features.embeddings.dtype, features.embeddings.shape), (np.float32, (32, 512)))
            self.assertIs(features.gaussians, scene.gaussians)
        self.assertEqual(scene.features(2).level, "medium")
        first = scene.features()
        self.assertEqual((first.level, first.embeddings), ("small", None))

    def test_weights_classes_clusters_and_affinities(self) -> None:
        weights = opened("langsplat_v2/output").features("large").codes
        self.assertLess(apart(weights, sample("langsplat_v2/expected/weights_3")), 1e-6)
        fewer = fmlgs.open_scene(SAMPLES / "langsplat_v2" / "output", top_k=3).features("large").codes
        self.assertGreater(apart(fewer, weights), OTHER, "the control: fewer weights")
        features = opened("gaussian_grouping").features()
        np.testing.assert_array_equal(features.codes, sample("gaussian_grouping/expected/features"))
        self.assertEqual((features.kind, features.encoder), ("classes", None))
        leaves = opened("opengaussian").features(decoded=True)
        np.testing.assert_array_equal(leaves.codes, sample("opengaussian/expected/leaf_of").ravel())
        self.assertEqual((leaves.codes.dtype, leaves.kind), (np.int64, "clusters"))
        assert leaves.embeddings is not None
        lengths = np.linalg.norm(leaves.embeddings, axis=1)
        # A cluster that was seen too seldom has none.
        self.assertTrue(((np.abs(lengths - 1) < 1e-5) | (lengths == 0)).all() and (lengths > 0).any())
        thgs = opened("thgs")
        for k in (1, 2, 3):
            np.testing.assert_array_equal(thgs.features(k).codes, sample(f"thgs/expected/labels_{k}").ravel())
        np.testing.assert_array_equal(opened("saga").features().codes, sample("saga/expected/features"))
        vectors = opened("dr_splat").features().codes
        self.assertLess(apart(vectors, sample("dr_splat/expected/vectors")), 1e-6)

    def test_a_level_may_have_gaussians_of_its_own(self) -> None:
        scene = opened("occams_lgs")
        for k in (1, 2, 3):
            features, rows = scene.features(k), sample(f"occams_lgs/expected/rows_{k}").ravel()
            self.assertEqual((len(features.gaussians), len(features.codes)), (len(rows), len(rows)))
            self.assertLess(apart(features.gaussians.positions, sample("scene/xyz")[rows]), 1e-6)
            first = sample(f"occams_lgs/expected/features_first_rows_{k}")
            self.assertLess(apart(features.codes[: len(first)], first), OTHER)
        self.assertEqual(len(scene.gaussians), 32)

    def test_codes_of_a_scene_of_this_program(self) -> None:
        scene = fmlgs.open_scene(trained())
        features = scene.features()
        self.assertEqual((features.level, features.kind, scene.levels), ("object", "codes", ()))
        np.testing.assert_array_equal(features.codes[:, 1], scene.gaussians.extras["fmlgs_object_code_1"])
        for level, decoded, reason in (("small", False, "object, part"), (None, True, "identity_features")):
            with self.assertRaisesRegex(fmlgs.FmlgsError, reason):
                scene.features(level, decoded=decoded)
        with self.assertRaisesRegex(fmlgs.FmlgsError, "fmlgs preprocess"):
            opened("3dgs").features()

    def test_what_there_is_not_is_named(self) -> None:
        with self.assertRaisesRegex(fmlgs.CommandError, "small, medium, large"):
            opened("langsplat/output").features("huge")
        with self.assertRaisesRegex(fmlgs.CommandError, "Gaussian Grouping knows no language"):
            opened("gaussian_grouping").features(decoded=True)
        with tempfile.TemporaryDirectory() as folder:
            run = sample_copied("langsplat", Path(folder))
            scene = fmlgs.open_scene(run / "output")
            autoencoder = run / "autoencoder" / "ckpt" / "made_up" / "best_ckpt.pth"
            elsewhere = autoencoder.rename(Path(folder, "decoder.pth"))
            with self.assertRaisesRegex(fmlgs.CommandError, "autoencoder"):
                scene.features()
            named = fmlgs.open_scene(run / "output", decoder=elsewhere)
            np.testing.assert_array_equal(named.features().codes, sample("langsplat/expected/codes_1"))
            elsewhere.write_bytes(elsewhere.read_bytes()[:1000])
            with self.assertRaises(fmlgs.CommandError) as caught:
                named.features()
            self.assertIn("decoder.pth", caught.exception.stderr)


class RelevancyTest(unittest.TestCase):
    """Relevancy of pixels and the masks, by vectors that take the place of an encoder's."""

    TEXTS = sample("scene/texts")

    def test_each_level_is_as_the_reference_says(self) -> None:
        for name in ("langsplat", "langsplat_v2", "occams_lgs"):
            scene = opened(name if name == "occams_lgs" else f"{name}/output")
            for k, level in enumerate(("small", "medium", "large"), start=1):
                found = scene.relevancy("kettle", 0, level=level, vectors=self.TEXTS)
                self.assertEqual((found.pixels.shape, found.pixels.dtype, found.level), ((18, 24), np.float32, level))
                wanted, other = (sample(f"{name}/expected/relevancy_pixels_{n}").reshape(18, 24) for n in (k, k % 3 + 1))
                # Occam's embeddings are kept in half the memory.
                self.assertLess(apart(found, wanted), 1e-3 if name == "occams_lgs" else TOLERANCE, name)
                self.assertGreater(apart(found, other), OTHER, "the control: another level")

    def test_single_levels_and_other_phrases_and_views(self) -> None:
        for name, place, texts in (
            ("legaussians", "legaussians/output", "scene/texts"),
            ("dr_splat", "dr_splat", "dr_splat/expected/texts"),
        ):
            scene, vectors = opened(place), sample(texts)
            wanted = sample(f"{name}/expected/relevancy_pixels").reshape(18, 24)
            self.assertLess(apart(scene.relevancy("kettle", 0, vectors=vectors), wanted), TOLERANCE)
            view = scene.relevancy("kettle", "view_1", vectors=vectors)
            self.assertGreater(apart(view, wanted), OTHER, "the control: another view")
            turned = scene.relevancy("kettle", 0, vectors=vectors[[1, 0, 2, 3, 4]])
            self.assertGreater(apart(turned, wanted), OTHER, "the control: another phrase")
            own = scene.relevancy("kettle", scene.photos[0].camera, vectors=vectors)
            self.assertLess(apart(own, wanted), TOLERANCE, "a camera of one's own")
            double = scene.relevancy("kettle", 0, vectors=(2.0 * vectors.astype(np.float64)).tolist())
            self.assertLess(apart(double, wanted), TOLERANCE, "lengths of vectors do not count")

    def test_the_common_mask_is_over_a_fifth_of_lerfs_scale(self) -> None:
        levels = np.stack([sample(f"langsplat/expected/relevancy_pixels_{k}").reshape(18, 24) for k in (1, 2, 3)])
        best = int(levels.max(axis=(1, 2)).argmax())
        scale = (levels[best] - 0.5) / (levels[best].max() - 0.5)
        found = opened("langsplat/output").relevancy("kettle", 0, vectors=self.TEXTS)
        self.assertEqual((found.common_mask.dtype, found.level), (np.bool_, ("small", "medium", "large")[best]))
        # On the border itself, rounding decides.
        sure = np.abs(scale - 0.2) > 1e-3
        np.testing.assert_array_equal(found.common_mask[sure], scale[sure] > 0.2)
        self.assertTrue(found.common_mask.any() and not found.common_mask.all())
        self.assertIn("20 %", found.common_rule)
        assert found.own_mask is not None
        self.assertFalse(np.array_equal(found.own_mask, found.common_mask), "the control: another rule")

    def test_masks_by_the_methods_own_rules(self) -> None:
        found = opened("opengaussian").relevancy("kettle", 0, vectors=self.TEXTS)
        silhouette = sample("opengaussian/expected/silhouette_pixels").reshape(18, 24)
        np.testing.assert_array_equal(found.own_mask, silhouette > 0.7)
        self.assertTrue((silhouette > 0.7).any())
        self.assertIn("silhouette", found.own_rule)
        found = opened("legaussians/output").relevancy("kettle", 0, vectors=self.TEXTS)
        hot = sample("legaussians/expected/relevancy_pixels_temperature_100").reshape(18, 24)
        # Where nothing is, and where rounding decides, the reference says nothing.
        sure = (sample("scene/alpha_0").reshape(18, 24) > 0) & (np.abs(hot - 0.5) > 1e-2)
        assert found.own_mask is not None
        np.testing.assert_array_equal(found.own_mask[sure], hot[sure] >= 0.5)
        # The control: a phrase that changes places with one that is nowhere more alike.
        other = opened("legaussians/output").relevancy("object", 0, vectors=self.TEXTS[[1, 0, 2, 3, 4]])
        assert other.own_mask is not None
        self.assertFalse(other.own_mask[sure & (hot > 0.5)].any())
        camera = opened("saga").photos[0].camera
        found = opened("ludvig").relevancy("kettle", camera, vectors=self.TEXTS)
        self.assertLess(apart(found, sample("ludvig/expected/relevancy_pixels").reshape(18, 24)), TOLERANCE)
        self.assertIsNone(found.own_mask)
        self.assertIn("LUDVIG has no rule", found.own_rule)

    def test_a_query_has_the_mask_by_the_common_rule(self) -> None:
        scene = opened("langsplat_v2/output")
        with tempfile.TemporaryDirectory() as folder:
            file = Path(folder, "vectors.npy")
            np.save(file, self.TEXTS)
            answer = scene.query("kettle", camera=0, options=[f"--vectors={file}"])
        found = scene.relevancy("kettle", 0, vectors=self.TEXTS)
        self.assertEqual((answer.verdict, answer.hits), ("found", ()))
        np.testing.assert_array_equal(answer.mask, found.common_mask)
        np.testing.assert_array_equal(answer.relevancy, found.pixels)
        self.assertFalse(np.array_equal(scene.relevancy("kettle", 1, vectors=self.TEXTS).common_mask, answer.mask))

    def test_what_cannot_be_compared_is_named(self) -> None:
        scene = opened("langsplat/output")
        with self.assertRaisesRegex(fmlgs.CommandError, "clip-vit-b16.*24 numbers.*512"):
            scene.relevancy("kettle", vectors=sample("dr_splat/expected/texts"))
        for vectors, reason in (
            (self.TEXTS[0], "shape"),
            (self.TEXTS[:1], "canonical"),
            (np.zeros((5, 512)), "row 0"),
            (np.full((5, 512), np.nan), "row 0"),
        ):
            with self.assertRaisesRegex(fmlgs.CommandError, reason):
                scene.relevancy("kettle", vectors=vectors)
        with self.assertRaisesRegex(fmlgs.CommandError, "small, medium, large"):
            scene.relevancy("kettle", level=4, vectors=self.TEXTS)
        with self.assertRaisesRegex(fmlgs.CommandError, "no photo and no file"):
            scene.relevancy("kettle", "nowhere", vectors=self.TEXTS)
        with self.assertRaisesRegex(fmlgs.CommandError, "SAGA.*fmlgs import"):
            opened("saga").relevancy("kettle")
        with self.assertRaisesRegex(fmlgs.CommandError, "are for results of other methods"):
            fmlgs.open_scene(trained()).relevancy("box 1", vectors=self.TEXTS)
        with tempfile.TemporaryDirectory() as folder, mock.patch.dict(os.environ, FMLGS_MODELS=folder):
            with self.assertRaisesRegex(fmlgs.CommandError, "clip-vit-b16"):
                scene.relevancy("kettle")

    def test_scenes_of_this_program_have_relevancy_and_both_masks(self) -> None:
        scene = fmlgs.open_scene(trained())
        found, answer = scene.relevancy("box 1", 1), scene.query("box 1", camera=1)
        self.assertEqual((found.level, found.own_rule), (None, "pixels of the object or part that is the answer"))
        np.testing.assert_array_equal(found.pixels, answer.relevancy)
        np.testing.assert_array_equal(found.own_mask, answer.mask)
        self.assertEqual(np.asarray(found).shape, answer.mask.shape)
        inside = found.common_mask & answer.mask
        self.assertGreater(inside.sum() / (found.common_mask | answer.mask).sum(), 0.5)
        other = scene.relevancy("box 2", 1)
        assert other.own_mask is not None
        self.assertFalse((other.own_mask & answer.mask).any(), "the control: another object")
        self.assertFalse(np.array_equal(scene.relevancy("box 1", 4).pixels, found.pixels), "the control: another view")
        nothing = scene.relevancy("zyxgh", 1)
        assert nothing.own_mask is not None
        self.assertEqual((nothing.own_mask.sum(), nothing.details["answer"]), (0, "not found"))


if __name__ == "__main__":
    unittest.main()
