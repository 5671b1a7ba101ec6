"""A trained scene of this program with the attributes of `scene.Scene`, so that the samples' writers write it."""

import json
import pathlib
import shutil
import sys

import numpy as np

sys.path.insert(0, str(pathlib.Path(__file__).resolve().parents[2] / "python/src"))

import fmlgs  # noqa: E402

from scene import camera_entry  # noqa: E402

#: Coefficients of harmonics of degree 3, which the methods train.
HARMONICS = 16


class TrainedScene:
    """Gaussians, photos, and the object, part and embedding of each Gaussian."""

    def __init__(self, folder):
        scene = fmlgs.open_scene(folder)
        if scene.features is None:
            raise SystemExit(f"{folder}: its objects have no embeddings; 'fmlgs preprocess' makes them")
        self.scene, gaussians = scene, scene.gaussians
        self.xyz = gaussians.positions.astype(np.float32)
        self.log_scale, self.rotation = gaussians.log_scales, gaussians.quaternions
        self.opacity = gaussians.opacity_logits[:, None]
        self.sh = np.zeros((len(gaussians), HARMONICS, 3), np.float32)
        self.sh[:, : gaussians.harmonics.shape[1]] = gaussians.harmonics
        data = scene.info.get("dataset")
        self.source = str((scene.folder / data["path"]).resolve()) if data else ""

    def photos(self):
        """The photos as entries of `cameras.json`, whose names have no folder and no ending."""
        return [
            camera_entry(
                i, pathlib.PurePosixPath(p.name).stem, (p.camera.width_px, p.camera.height_px), p.camera.focal_px,
                (p.camera.world_from_camera, p.camera.center),
            )
            for i, p in enumerate(self.scene.photos)
        ]

    def write_nameless(self, folder):
        """Writes a copy of the scene whose identities have no names."""
        folder.mkdir(parents=True)
        own = self.scene.folder
        shutil.copy(own / "point_cloud.ply", folder)
        info = json.loads((own / "scene.json").read_text())
        if self.source:
            info["dataset"]["path"] = self.source
        (folder / "scene.json").write_text(json.dumps(info))
        data = (own / "semantic_map.safetensors").read_bytes()
        end = 8 + int.from_bytes(data[:8], "little")
        header = json.loads(data[8:end])
        content = json.loads(header["__metadata__"]["fmlgs"])
        for known in content["identities"]["list"]:
            known["names"] = []
        header["__metadata__"]["fmlgs"] = json.dumps(content)
        text = json.dumps(header).encode()
        text += b" " * (-len(text) % 8)
        (folder / "semantic_map.safetensors").write_bytes(len(text).to_bytes(8, "little") + text + data[end:])

    @property
    def encoder(self):
        """Name of the encoder of its embeddings."""
        return self.scene.features.encoder

    def embeddings(self):
        """[identities + 1, dimension], the unit mean over the views of each identity; zeros for those never seen."""
        features = self.scene.features
        mean = features.raw.astype(np.float64).sum(axis=1)
        length = np.linalg.norm(mean, axis=1, keepdims=True)
        mean = np.divide(mean, length, out=np.zeros_like(mean), where=length > 0)
        return np.concatenate([np.zeros_like(mean[:1]), mean])

    def objects(self):
        """[identities + 1], the object that each identity is or belongs to; 0 for none."""
        of = np.zeros(len(self.scene.identities) + 1, np.int64)
        for number, identity in self.scene.identities.items():
            # Parents come before their parts.
            of[number] = of[identity.parent] if identity.parent else number
        return of

    def levels(self, share=0.25):
        """The identity of each Gaussian at the levels small, medium and large: its part, its part if that has this share
        of the object's Gaussians, else the object, and its object."""
        small, objects = self.scene.assignment.astype(np.int64), self.objects()
        large = objects[small]
        count = np.bincount(small, minlength=len(objects))
        of_object = np.bincount(large, minlength=len(objects))
        medium = np.where(count[small] >= share * of_object[large], small, large)
        return [small, medium, large]
