#!/usr/bin/env python3
"""Copies a data set with errors of known size put in: to measure 'fmlgs train --refine-poses' and '--exposure'.

usage: tools/perturb.py PHOTOS OUT [--move PERCENT] [--turn DEGREES] [--stops STOPS] [--tint FACTOR] [--all] [--seed N]

PHOTOS has a transforms.json. Places are moved by PERCENT of the scene's radius and turned by DEGREES (deviations along
and about each axis); exposures change by up to STOPS each way, and red and blue by up to FACTOR more against one
another. Photos that training holds out (those listed as test, else every eighth) stay as they are, unless --all is
given. OUT/truth.json has the poses and the exposures of every photo. Needs NumPy and Pillow.
"""

import argparse
import json
import pathlib
import shutil

import numpy as np
from PIL import Image

#: A stop doubles light, which sRGB stores about by this power.
GAMMA = 2.2
#: The program's radius is so much more than the largest distance from the mean of all places.
RADIUS = 1.1


def turn(axis_angle):
    """Rotation matrix of a vector: axis times angle in radians."""
    angle = np.linalg.norm(axis_angle)
    if angle == 0:
        return np.eye(3)
    x, y, z = axis_angle / angle
    k = np.array([[0, -z, y], [z, 0, -x], [-y, x, 0]])
    return np.eye(3) + np.sin(angle) * k + (1 - np.cos(angle)) * k @ k


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("photos", type=pathlib.Path)
    parser.add_argument("out", type=pathlib.Path)
    parser.add_argument("--move", type=float, default=0.0)
    parser.add_argument("--turn", type=float, default=0.0)
    parser.add_argument("--stops", type=float, default=0.0)
    parser.add_argument("--tint", type=float, default=1.0)
    parser.add_argument("--all", action="store_true")
    parser.add_argument("--seed", type=int, default=0)
    args = parser.parse_args()
    if args.out.exists():
        raise SystemExit(f"{args.out} is there already; choose another folder")
    data = json.loads((args.photos / "transforms.json").read_text())
    frames = sorted(data["frames"], key=lambda frame: frame["file_path"])
    listed = data.get("test_filenames", [])
    places = np.array([np.array(frame["transform_matrix"])[:3, 3] for frame in frames])
    radius = RADIUS * np.linalg.norm(places - places.mean(axis=0), axis=1).max()
    rng = np.random.default_rng(args.seed)
    truth = []
    for i, frame in enumerate(frames):
        name = frame["file_path"]
        held_out = name in listed if listed else i % 8 == 0
        pose = np.array(frame["transform_matrix"], dtype=float)
        # Drawn for every photo, so that what is held out changes no other.
        move = rng.normal(size=3) * args.move / 100 * radius
        axis_angle = rng.normal(size=3) * np.radians(args.turn)
        stops, tint = rng.uniform(-args.stops, args.stops), rng.uniform(-1, 1)
        gain = 2.0 ** (stops / GAMMA) * args.tint ** (np.array([0.5, 0.0, -0.5]) * tint)
        is_changed = args.all or not held_out
        if is_changed:
            changed = pose.copy()
            changed[:3, 3] += pose[:3, :3] @ move
            changed[:3, :3] = pose[:3, :3] @ turn(axis_angle)
            frame["transform_matrix"] = changed.tolist()
        target = args.out / name
        target.parent.mkdir(parents=True, exist_ok=True)
        if is_changed and (args.stops or args.tint != 1.0):
            image = Image.open(args.photos / name)
            pixels = np.asarray(image.convert("RGBA" if "A" in image.mode else "RGB")).astype(float)
            pixels[..., :3] = np.clip(np.round(pixels[..., :3] * gain), 0, 255)
            Image.fromarray(pixels.astype(np.uint8)).save(target, **({} if name.endswith(".png") else {"quality": 95}))
        else:
            shutil.copyfile(args.photos / name, target)
            gain = np.ones(3)
        truth.append({"name": name, "held_out": held_out, "transform_matrix": pose.tolist(), "gain": gain.tolist()})
    if data.get("ply_file_path"):
        shutil.copyfile(args.photos / data["ply_file_path"], args.out / data["ply_file_path"])
    (args.out / "transforms.json").write_text(json.dumps(data))
    (args.out / "truth.json").write_text(json.dumps({"radius": radius, "photos": truth}))


if __name__ == "__main__":
    main()
