#!/usr/bin/env python3
"""Writes a trained scene of this program as two other methods would have it, in their exact formats.

usage: tools/results/demo_as.py SCENE OUT

OUT/langsplat: codes of three numbers at three levels and the autoencoder that was fitted to the embeddings of the
scene's objects and parts. OUT/grouping: features of sixteen numbers, a classifier of the objects, and their names.
OUT/nameless: the scene itself without names, so that its embeddings answer, too. Geometry and colors are the scene's,
the identities too: so all begin from what this program found. Needs PyTorch, NumPy and plyfile; see README.md beside
this file.
"""

import pathlib
import sys

import numpy as np
import torch

import identity
import language
import torch_files
from sample import Sample
from trained import TrainedScene

NAME = "demo"
#: Hidden numbers of LangSplat's autoencoder.
ENCODER, DECODER = [256, 128, 64, 32, 3], [16, 32, 64, 128, 256, 256]
#: Cosine of every decoded embedding with the true one at which the fit ends, and steps after which it ends anyway.
COSINE, STEPS = 0.98, 20_000
#: Weight of the cosine in LangSplat's loss.
COSINE_WEIGHT = 0.001
FEATURES, CLASSES = 16, 256


def main():
    if len(sys.argv) != 3:
        raise SystemExit(__doc__)
    scene, out = TrainedScene(sys.argv[1]), pathlib.Path(sys.argv[2])
    for folder in ("langsplat", "grouping", "nameless"):
        if (out / folder).exists():
            raise SystemExit(f"{out / folder} is there already; choose another folder")
    # The networks are small: more threads wait for each other.
    torch.set_num_threads(1)
    scene.write_nameless(out / "nameless")
    langsplat(out, scene)
    grouping(out, scene)


def unit(x):
    """Rows of unit length."""
    return x / x.norm(dim=-1, keepdim=True)


class Autoencoder(torch.nn.Module):
    """Layers of LangSplat's autoencoder, for embeddings of any width."""

    def __init__(self, width):
        super().__init__()
        layers = [torch.nn.Linear(width, ENCODER[0])]
        for a, b in zip(ENCODER, ENCODER[1:]):
            layers += [torch.nn.BatchNorm1d(a), torch.nn.ReLU(), torch.nn.Linear(a, b)]
        self.encoder = torch.nn.Sequential(*layers)
        widths = [ENCODER[-1], *DECODER, width]
        layers = [torch.nn.Linear(widths[0], widths[1])]
        for a, b in zip(widths[1:], widths[2:]):
            layers += [torch.nn.ReLU(), torch.nn.Linear(a, b)]
        self.decoder = torch.nn.Sequential(*layers)

    def encode(self, x):
        return unit(self.encoder(x))

    def decode(self, codes):
        return unit(self.decoder(codes))


def fitted(vectors):
    """An autoencoder fitted to unit vectors by LangSplat's loss, and the cosine of each vector with what is decoded."""
    torch_files.seeded(43)
    model = Autoencoder(vectors.shape[1])
    optimizer = torch.optim.Adam(model.parameters(), lr=1e-3)
    schedule = torch.optim.lr_scheduler.CosineAnnealingLR(optimizer, STEPS, 1e-5)
    cosines = torch.zeros(len(vectors))
    for step in range(STEPS):
        model.train()
        decoded = model.decode(model.encode(vectors))
        cosine = (decoded * vectors).sum(-1)
        loss = ((decoded - vectors) ** 2).mean() + COSINE_WEIGHT * (1 - cosine.mean())
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
        schedule.step()
        if step % 500 == 499:
            model.eval()
            with torch.no_grad():
                cosines = (model.decode(model.encode(vectors)) * vectors).sum(-1)
            print(f"step {step + 1}: cosine at least {cosines.min():.4f}, mean {cosines.mean():.4f}", flush=True)
            if cosines.min() > COSINE:
                break
    return model.eval(), cosines


def langsplat(out, scene):
    """LangSplat: what its training converges to if every photo shows the scene's objects and parts as they are."""
    s = Sample(out, "langsplat", scene)
    embeddings = torch.from_numpy(scene.embeddings().astype(np.float32))
    known = embeddings.norm(dim=1) > 0
    model, cosines = fitted(embeddings[known])
    print(
        f"LangSplat: {int(known.sum())} embeddings of {embeddings.shape[1]} numbers by '{scene.encoder}'; decoded from 3 "
        f"numbers: cosine at least {cosines.min():.4f}, mean {cosines.mean():.4f}, {(cosines > COSINE).sum()} over {COSINE}"
    )
    codes = np.zeros((len(embeddings), 3), np.float32)
    with torch.no_grad():
        codes[known.numpy()] = model.encode(embeddings[known]).numpy()
    linear = lambda part: [  # noqa: E731
        (m.weight.detach(), m.bias.detach()) for m in part if isinstance(m, torch.nn.Linear)
    ]
    norms = [
        (m.weight.detach(), m.bias.detach(), m.running_mean, m.running_var)
        for m in model.encoder if isinstance(m, torch.nn.BatchNorm1d)
    ]
    language.save_autoencoder(s, NAME, linear(model.encoder), norms, linear(model.decoder))
    for level, of in enumerate(scene.levels(), start=1):
        language.save_level(s, NAME, level, codes[of])
        print(f"  level {level}: {len(np.unique(of[of > 0]))} identities, {int((of == 0).sum())} Gaussians of none")


def grouping(out, scene):
    """Gaussian Grouping: an object is a class, 0 is nothing. Features and classifier are fitted so that blends over nothing
    get the class of the largest weight."""
    s = Sample(out, "grouping", scene)
    objects = [i for i in scene.scene.identities.values() if not i.parent]
    if len(objects) >= CLASSES:
        raise SystemExit(f"{len(objects)} objects; Gaussian Grouping has {CLASSES} classes, the first of nothing")
    class_of = np.zeros(len(scene.scene.identities) + 1, np.int64)
    for k, i in enumerate(objects, start=1):
        class_of[i.number] = k
    classes = class_of[scene.levels()[2]]
    features, weight, bias = classifier(len(objects))
    identity.save_classes(s, features[classes], weight, bias)
    lines = [f"{k} {i.name}\n" for k, i in enumerate(objects, start=1)]
    s.text("".join(lines), "point_cloud", "iteration_30000", "class_names.txt")


def classifier(objects):
    """Feature of each class [objects + 1, 16], and weight and bias of the classifier."""
    r = torch_files.seeded(44)
    features = torch.nn.Parameter(torch.randn(objects, FEATURES))
    linear = torch.nn.Linear(FEATURES, CLASSES)
    optimizer = torch.optim.Adam([features, *linear.parameters()], lr=5e-3)

    def blends(count):
        # Three objects in front of each other, over nothing: alpha blending's weights. Every eighth is nothing alone.
        opacity = r.uniform(0, 1, (count, 3)) ** 0.25
        opacity[::8] = 0
        left = np.cumprod(np.concatenate([np.ones((count, 1)), 1 - opacity], axis=1), axis=1)
        weights, of = np.zeros((count, objects + 1)), r.integers(1, objects + 1, (count, 3))
        for k in range(3):
            np.add.at(weights, (np.arange(count), of[:, k]), opacity[:, k] * left[:, k])
        weights[:, 0] += left[:, 3]
        return torch.from_numpy(weights.astype(np.float32))

    def right(weights):
        with torch.no_grad():
            found = linear(weights[:, 1:] @ features).argmax(1)
        return float((found == weights.argmax(1)).float().mean())

    for _ in range(3_000):
        weights = blends(1024)
        loss = torch.nn.functional.cross_entropy(linear(weights[:, 1:] @ features), weights.argmax(1))
        optimizer.zero_grad()
        loss.backward()
        optimizer.step()
    alone = right(torch.eye(objects + 1))
    print(
        f"Gaussian Grouping: {objects} objects; the class of largest weight in {right(blends(20_000)):.4f} of blends of three "
        f"and in {alone:.4f} of objects alone"
    )
    whole = np.concatenate([np.zeros((1, FEATURES)), features.detach().numpy()]).astype(np.float32)
    return whole, linear.weight.detach().numpy(), linear.bias.detach().numpy()


if __name__ == "__main__":
    main()
