"""The made-up scene that all samples show: 32 Gaussians in four clusters, two cameras, a phrase."""

import numpy as np

COUNT = 32
DIMENSION = 512
WIDTH, HEIGHT, FOCAL = 24, 18, 20.0
PHRASE = "striped kettle"
CANONICALS = ["object", "things", "stuff", "texture"]


def _unit(rows):
    return rows / np.linalg.norm(rows, axis=-1, keepdims=True)


class Scene:
    """Gaussians as 3DGS stores them (log scales, quaternions w x y z of any length, opacity logits; spherical
    harmonics [N, 16, 3], coefficient by coefficient), their clusters and the clusters' features."""

    def __init__(self):
        r = np.random.default_rng(43)
        centers = np.array([[-0.9, -0.5, 0.0], [0.9, -0.4, 0.2], [-0.5, 0.6, -0.2], [0.8, 0.6, 0.1]])
        self.cluster = np.arange(COUNT) % 4
        f32 = lambda a: a.astype(np.float32)  # noqa: E731
        self.source = "data/made_up"
        self.xyz = f32(centers[self.cluster] + r.normal(0, 0.2, (COUNT, 3)))
        self.log_scale = f32(np.log(0.14) + r.normal(0, 0.3, (COUNT, 3)))
        self.rotation = f32(_unit(r.normal(size=(COUNT, 4))) * r.uniform(0.5, 2.0, (COUNT, 1)))
        self.opacity = f32(r.uniform(-0.8, 3.0, (COUNT, 1)))
        self.sh = f32(np.concatenate([r.normal(0, 1.0, (COUNT, 1, 3)), r.normal(0, 0.1, (COUNT, 15, 3))], axis=1))
        # Text: the phrase, then the canonicals. Cluster 0 is what the phrase means, cluster 1 a little.
        self.texts = f32(_unit(r.normal(size=(5, DIMENSION))))
        mean = [1.0, 0.4, 0.0, 0.0]
        near = [0, 0, 1, 3]
        features = [
            mean[k] * self.texts[0] + 0.5 * self.texts[1 + near[k]] + r.normal(0, 1, DIMENSION) / DIMENSION**0.5
            for k in range(4)
        ]
        self.cluster_features = f32(_unit(np.array(features)))

    def features(self, seed, count=COUNT):
        """A unit vector a Gaussian near that of its cluster, f32 [count, 512]."""
        r = np.random.default_rng(seed)
        rows = self.cluster_features[self.cluster[:count]] + r.normal(0, 0.3 / DIMENSION**0.5, (count, DIMENSION))
        return _unit(rows).astype(np.float32)

    def cameras(self):
        """Two cameras: world_from_camera (columns right, down, forward) and center."""
        return [look_at([0.0, 0.0, -3.2]), look_at([1.6, -0.7, -2.8])]

    def photos(self):
        """The cameras as entries of `cameras.json`."""
        return [
            camera_entry(i, f"view_{i}", (WIDTH, HEIGHT), (FOCAL, FOCAL), camera)
            for i, camera in enumerate(self.cameras())
        ]


def look_at(center):
    """Camera at `center` that looks at the origin, y down."""
    center = np.array(center)
    forward = -center / np.linalg.norm(center)
    right = np.cross([0.0, 1.0, 0.0], forward)
    right /= np.linalg.norm(right)
    return np.stack([right, np.cross(forward, right), forward], axis=1), center


def camera_entry(number, name, size, focal, camera):
    """An entry of `cameras.json` as 3DGS writes it; `camera` is world_from_camera and center."""
    rotation, center = camera
    return {
        "id": number, "img_name": name, "width": size[0], "height": size[1],
        "position": center.tolist(), "rotation": rotation.tolist(), "fy": focal[1], "fx": focal[0],
    }


def cfg_args(name, source="data/made_up", degree=3, extra=""):
    """`cfg_args` as 3DGS writes it: one line of Python."""
    return (
        f"Namespace(data_device='cuda', eval=False, images='images', model_path='output/{name}', resolution=-1, "
        f"sh_degree={degree}, source_path={source!r}, white_background=False{extra})"
    )
