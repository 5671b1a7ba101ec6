"""The scenes of assets/eval: small files, only combinations that training never saw, and every part of
a thing with a name of its own, so that "PART of the COLOUR KIND" means exactly one.

    python eval_scenes.py ../../assets/eval
"""

import argparse
from pathlib import Path

import numpy as np

import palette
import scenes
import shapes
import things

SCENES = {
    "desk": ["controller", "controller", "mug", "lamp", "book", "camera", "robot", "bottle"],
    "kitchen": ["kettle", "teapot", "mug", "mug", "fruit bowl", "cake", "pan", "cookie jar", "bottle"],
    "shelf": ["toy car", "rocket", "house", "boat", "duck", "pot plant", "candle", "umbrella", "bag"],
}
LARGEST = 250_000


def single(parts):
    """Pairs that differ by their side only become one part: nothing in a picture tells them apart."""
    by = {}
    for p in parts:
        pair = p["name"] != p["base"]
        name = p["base"] + "s" if pair else p["name"]
        if name in by:
            by[name]["mesh"] = by[name]["mesh"] + p["mesh"]
        else:
            by[name] = dict(p, name=name)
    return list(by.values())


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("out", type=Path)
    ap.add_argument("--seed", type=int, default=77)
    a = ap.parse_args()
    a.out.mkdir(parents=True, exist_ok=True)
    for n, (name, kinds) in enumerate(SCENES.items()):
        path = a.out / f"{name}.glb"
        for detail in (.75, .65, .55, .48, .42, .38):
            shapes.DETAIL = detail
            rng, made, used = np.random.default_rng([a.seed, n]), [], set()
            for kind in kinds:
                while True:
                    thing = scenes.dress(rng, kind, things.KINDS[kind], True)
                    lettered = any(p["name"].startswith("button ") for p in thing["parts"])
                    if thing["name"] not in used and not lettered:
                        break
                used.add(thing["name"])
                made.append(dict(thing, parts=single(thing["parts"])))
            table = scenes.dress(rng, "table", things.table, True, surface="wooden")
            table["parts"] = single(table["parts"])
            scenes.write(path, rng, [(table, (0, 0, 0), 0)] + scenes.layout(rng, made), picture_px=24)
            path.with_suffix(".json").unlink()
            if path.stat().st_size <= LARGEST:
                break
        parts = sum(len(t["parts"]) for t in made)
        unseen = sum(palette.kept_part(t["kind"], p["base"], p["color"]) or p["color"] == t["color"] for t in made for p in t["parts"])
        print(path.name, path.stat().st_size, "bytes, detail", detail, len(made), "things,", parts, "parts,", unseen, "in unseen colours;",
              ", ".join(t["name"] for t in made))


if __name__ == "__main__":
    main()
