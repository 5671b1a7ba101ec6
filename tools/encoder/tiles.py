"""Tiles: a masked thing on black, its bounding box padded to a square and resized; the same arithmetic
as src/models/tile.rs.

    python tiles.py SCENES OUT.npz [--jitter] [--from N] [--to N]
"""

import argparse
import json
from pathlib import Path

import numpy as np
from PIL import Image

SIDE = 64
LEAST_PX = {"object": 150, "part": 16}


def weights(source, target):
    """Rows of a triangle filter, widened where it shrinks: source pixels -> target pixels."""
    scale = source / target
    support = max(scale, 1.0)
    centre = (np.arange(target) + .5) * scale
    w = 1 - np.abs(np.arange(source)[None] + .5 - centre[:, None]) / support
    w = np.maximum(w, 0)
    return (w / w.sum(1, keepdims=True)).astype(np.float32)


def cut(rgb, mask, side=SIDE):
    """`rgb` [h, w, 3] in 0..1, `mask` [h, w]; None for an empty mask."""
    ys, xs = np.flatnonzero(mask.any(1)), np.flatnonzero(mask.any(0))
    if not len(ys):
        return None
    y0, y1, x0, x1 = ys[0], ys[-1] + 1, xs[0], xs[-1] + 1
    h, w = y1 - y0, x1 - x0
    s = max(h, w)
    square = np.zeros((s, s, 3), np.float32)
    top, left = (s - h) // 2, (s - w) // 2
    square[top:top + h, left:left + w] = rgb[y0:y1, x0:x1] * mask[y0:y1, x0:x1, None]
    k = weights(s, side)
    rows = (k @ square.reshape(s, -1)).reshape(side, s, 3)
    return np.matmul(k, rows)


def grow(mask):
    out = mask.copy()
    out[1:] |= mask[:-1]; out[:-1] |= mask[1:]; out[:, 1:] |= mask[:, :-1]; out[:, :-1] |= mask[:, 1:]
    return out


def jittered(rng, mask):
    """What a carried or drawn mask looks like: a little too large or too small, or with a bite."""
    pick = rng.random()
    if pick < .45:
        return mask
    if pick < .6:
        return grow(mask)
    if pick < .68:
        return grow(grow(mask))
    if pick < .82:
        m = ~grow(~mask)
        return m if m.sum() > .5 * mask.sum() else mask
    ys, xs = np.nonzero(mask)
    k = rng.integers(len(ys))
    r = rng.uniform(.15, .4) * np.sqrt(len(ys))
    yy, xx = np.mgrid[0:mask.shape[0], 0:mask.shape[1]]
    m = mask & (np.hypot(yy - ys[k], xx - xs[k]) > r)
    return m if m.sum() > .5 * mask.sum() else mask


def scene_tiles(folder, rng=None, light=None):
    """Yields (view, identity index, tile u8, pixels) of a rendered scene."""
    ids = json.loads((folder / "identities.json").read_text())["identities"]
    for v, photo in enumerate(sorted((folder / "images").glob("*.png"))):
        rgb = np.asarray(Image.open(photo).convert("RGB"), np.float32) / 255
        if light is not None:
            rgb = np.clip(rgb * light, 0, 1)
        maps = {k: np.asarray(Image.open(folder / f"{k}_ids" / photo.name)).astype(np.int64) for k in ("object", "part")}
        for level, m in maps.items():
            count = np.bincount(m.ravel(), minlength=len(ids) + 1)
            order = np.argsort(m.ravel(), kind="stable")
            starts = np.concatenate([[0], np.cumsum(count)])
            for k, identity in enumerate(ids):
                n = int(count[identity["id"]])
                if identity["level"] != level or n < LEAST_PX[level]:
                    continue
                ys, xs = np.divmod(order[starts[identity["id"]]:starts[identity["id"] + 1]], m.shape[1])
                y0, y1, x0, x1 = max(ys.min() - 2, 0), ys.max() + 3, max(xs.min() - 2, 0), xs.max() + 3
                window = m[y0:y1, x0:x1] == identity["id"]
                if rng is not None:
                    window = jittered(rng, window)
                tile = cut(rgb[y0:y1, x0:x1], window)
                yield v, k, (tile * 255 + .5).astype(np.uint8), n


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("scenes", type=Path)
    ap.add_argument("out", type=Path)
    ap.add_argument("--jitter", action="store_true")
    ap.add_argument("--light", type=float, nargs=3, help="gain of red, green and blue")
    ap.add_argument("--from", dest="first", type=int, default=0)
    ap.add_argument("--to", type=int, default=10 ** 9)
    a = ap.parse_args()
    rows, tiles, specs = [], [], {}
    for spec in sorted(a.scenes.glob("*.json")):
        n, folder = int(spec.stem), spec.with_suffix("")
        if not a.first <= n <= a.to or not (folder / "part_ids").exists() or not (folder / "identities.json").exists():
            continue
        specs[n] = json.loads(spec.read_text())
        names = [o["name"] for o in specs[n]] + [p["name"] for o in specs[n] for p in o["parts"]]
        ids = json.loads((folder / "identities.json").read_text())["identities"]
        assert [i["name"] for i in ids] == names, folder
        rng = np.random.default_rng([n, 5]) if a.jitter else None
        for v, k, tile, px in scene_tiles(folder, rng, a.light):
            rows.append((n, v, k, px))
            tiles.append(tile)
    np.savez(a.out, rows=np.array(rows, np.int64), tiles=np.array(tiles), specs=json.dumps(specs))
    print(f"{len(tiles)} tiles of {len(specs)} scenes")


if __name__ == "__main__":
    main()
