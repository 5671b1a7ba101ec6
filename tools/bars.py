#!/usr/bin/env python3
"""Identity unseen: objects and parts of eight scenes from one labeled photo each, in views that training did not see.

usage: tools/bars.py [--program PATH] [--out DIR] [--keep] [--write] [NAME...]

Trains each scene, finds its objects from one photo's labels, and compares all names with the labels of other views
(`fmlgs eval --protocol limits`). Fails if objects or parts are more than 0.01 below docs/results/bars.csv.
Scenes without a row there are told, not compared. --keep takes scenes that an earlier run trained; --write writes
their rows. `make bars` builds the program and runs all.
"""

import argparse
import csv
import datetime
import json
import os
import pathlib
import shutil
import subprocess
import sys
import time
import zipfile

ROOT = pathlib.Path(__file__).resolve().parent.parent
DATA = pathlib.Path(os.environ.get("FMLGS_DATA", ROOT.parent / "shared/data"))
TABLE = ROOT / "docs/results/bars.csv"
ORIGIN = "# tools/bars.py --write; two CPU cores without a GPU; mean IoU of names in unseen views, one labeled photo; limit: true labels of all views with the same Gaussians; recorded "
COLUMNS = ["scene", "objects", "parts", "large_parts", "objects_limit", "parts_limit", "large_parts_limit"]
LARGEST_FALL = 0.01
KINDS = ["objects", "parts", "large parts"]
# File in the folders that this tool may replace.
MARK = ".bars"
RENDERED = ["--size", "400x300", "--view-count", "48", "--samples", "2"]


def rendered(path):
    """Renders photos of a glTF scene, with the ids of every pixel as labels."""
    return lambda run, folder: run("synth", path, "--out", folder / "photos", *RENDERED)


def demo(_, folder):
    """Unpacks the photos of the demo that ships with the program."""
    with zipfile.ZipFile(ROOT / "assets/demo/demo.zip") as archive:
        archive.extractall(folder, [n for n in archive.namelist() if n.startswith("photos/")])


GLTF = DATA / "gltf"
# Photos, or how they are made; labels of one photo and of the others, None = the photos' own; longer side, steps;
# options of evaluation.
SCENES = {
    "plush": (DATA / "plush", DATA / "plush_labels/seed", ROOT / "tests/data/plush_labels", "378", "1000", ["--held-out-every", "0"]),
    "demo": (demo, None, None, "400", "1000", []),
    "desk": (rendered(ROOT / "assets/eval/desk.glb"), None, None, "400", "800", []),
    "kitchen": (rendered(ROOT / "assets/eval/kitchen.glb"), None, None, "400", "800", []),
    "shelf": (rendered(ROOT / "assets/eval/shelf.glb"), None, None, "400", "800", []),
    "truck": (rendered(GLTF / "CesiumMilkTruck/CesiumMilkTruck.glb"), None, None, "400", "600", []),
    "motorcycle": (rendered(GLTF / "kenney_vehicles/vehicle-motorcycle.glb"), None, None, "400", "600", []),
    "chair": (rendered(GLTF / "SheenChair/SheenChair.gltf"), None, None, "400", "600", []),
}

# Scenes of data that does not come with the project.
REAL = {"plush", "truck", "motorcycle", "chair"}


def measure(name, program, out, keep):
    """Row of the table."""
    source, seed, labels, side, steps, options = SCENES[name]
    folder = out / name
    photos = folder / "photos" if callable(source) else source

    def run(*args):
        done = subprocess.run([program, "-q", *map(str, args)], capture_output=True, text=True)
        if done.returncode:
            sys.exit(f"{name}: fmlgs {args[0]}: {done.stderr.strip()}")
        return done.stdout

    scene = folder / "scene"
    if not (keep and (scene / "point_cloud.ply").exists()):
        if folder.exists():
            if not (folder / MARK).exists():
                sys.exit(f"{folder} is not of an earlier run; choose another --out")
            shutil.rmtree(folder)
        folder.mkdir(parents=True)
        (folder / MARK).touch()
        if callable(source):
            source(run, folder)
        run("train", photos, "--out", scene, "--max-side", side, "--steps", steps, "--eval-every", "0")
    run("preprocess", scene, "--masks", seed or photos, "--max-seeds", "1", "--encoder", "none", "--replace-all")
    scores = run("eval", scene, "--masks", labels or photos, "--protocol", "limits", "--json", *options)
    rows = {row["labels"]: row for row in json.loads(scores)["rows"]}
    value = lambda kind, key: f"{key(rows[kind]):.3f}" if kind in rows else ""
    return [name, *(value(k, lambda r: r["iou"]) for k in KINDS), *(value(k, lambda r: r["limits"][0]) for k in KINDS)]


def falls(row, known):
    """What is worse than in the table, in words."""
    pairs = [(c, float(n), float(k)) for c, n, k in zip(COLUMNS[1:4], row[1:4], known[1:4]) if n and k]
    return [f"{c} {n:.3f}, {k:.3f} before" for c, n, k in pairs if n < k - LARGEST_FALL]


def write(known):
    """Writes the table, whole or not at all."""
    rows = [known[name] for name in SCENES if name in known]
    lines = [ORIGIN + datetime.date.today().isoformat(), ",".join(COLUMNS), *(",".join(row) for row in rows)]
    new = TABLE.with_suffix(".tmp")
    new.write_text("\n".join(lines) + "\n")
    new.replace(TABLE)


def main():
    parser = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    parser.add_argument("names", nargs="*", choices=[[], *SCENES], metavar="NAME")
    parser.add_argument("--program", default=ROOT / "target/release/fmlgs")
    parser.add_argument("--out", type=pathlib.Path, default=ROOT / "out/bars")
    parser.add_argument("--keep", action="store_true")
    parser.add_argument("--write", action="store_true")
    args = parser.parse_args()
    known = {}
    if TABLE.exists():
        known = {row[0]: row for row in csv.reader(TABLE.read_text().splitlines()[2:])}
    print(",".join([*COLUMNS, "secs"]), flush=True)
    bad = []
    for name in args.names or SCENES:
        if name in REAL and not DATA.exists():
            print(f"skipped: {name}: its photos are not here")
            continue
        started = time.monotonic()
        row = measure(name, args.program, args.out, args.keep)
        print(",".join([*row, f"{time.monotonic() - started:.0f}"]), flush=True)
        if args.write:
            # Each row at once, so that a stop loses one scene.
            known[name] = row
            write(known)
        elif name in known:
            bad += [f"{name}: {text}" for text in falls(row, known[name])]
        else:
            print(f"not compared: {name} has no row in {TABLE.name}", flush=True)
    if bad:
        sys.exit("worse than docs/results/bars.csv:\n" + "\n".join(bad))


main()
