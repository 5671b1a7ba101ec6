#!/usr/bin/env python3
"""Writes a small result of each method, in its exact format, with the arrays that a reader has to give.

usage: tools/results/write_samples.py [FOLDER [METHOD...]]
       tools/results/write_samples.py --hostile

FOLDER is tests/data/results unless given; --hostile writes tests/corpus/torch. Needs PyTorch, NumPy and plyfile; see README.md beside this file.
"""

import pathlib
import shutil
import sys

import numpy as np

import hostile
import identity
import language
import plain
from reference import weights
from scene import Scene

MOST_BYTES, MOST_TOTAL = 60_000, 1_500_000


def main():
    tests = pathlib.Path(__file__).resolve().parents[2] / "tests"
    if sys.argv[1:] == ["--hostile"]:
        hostile.write(tests / "corpus/torch")
        return
    default = tests / "data/results"
    root = pathlib.Path(sys.argv[1]) if len(sys.argv) > 1 else default
    chosen = set(sys.argv[2:])
    scene = Scene()
    shutil.rmtree(root / "scene", ignore_errors=True)
    whole = root / "scene"
    whole.mkdir(parents=True)
    arrays = {
        "xyz": scene.xyz, "log_scale": scene.log_scale, "rotation": scene.rotation, "opacity": scene.opacity,
        "sh": scene.sh, "cluster": scene.cluster.astype(np.int64), "texts": scene.texts,
    }
    for name, array in arrays.items():
        np.save(whole / f"{name}.npy", array)
    for i, camera in enumerate(scene.cameras()):
        drawn = weights(camera, scene.xyz, scene.log_scale, scene.rotation, scene.opacity).sum(-1)
        np.save(whole / f"alpha_{i}.npy", drawn.astype(np.float32))
    for write in plain.ALL + language.ALL + identity.ALL:
        if not chosen or write.__name__ in chosen:
            write(root, scene)
            print(write.__name__)
    files = [p for p in root.rglob("*") if p.is_file()]
    large = [str(p) for p in files if p.stat().st_size > MOST_BYTES]
    total = sum(p.stat().st_size for p in files)
    print(f"{len(files)} files, {total} bytes; larger than {MOST_BYTES}: {large}")
    if large or total > MOST_TOTAL:
        sys.exit("too large for the repository")


if __name__ == "__main__":
    main()
