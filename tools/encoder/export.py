"""Writes the trained halves as ONNX, the word list, and what the program's tests hold them to.

    python export.py MODEL.pt HELD.npz --models ../../assets/models --tests ../../tests/data/models

Pictures one at a time; phrases several at once and as long as they are: n and t are free. Operators that small engines have.
"""

import argparse
import json
from pathlib import Path

import numpy as np
import onnx
import torch
from PIL import Image

import data
import evaluate
import model
import texts
import tiles as cutting

GOLDEN = ["red mug", "red button of the blue controller", "blue button of the red controller", "handle of the kettle", "things"]


class Text(torch.nn.Module):
    def __init__(self, inner):
        super().__init__()
        self.inner = inner

    def forward(self, tokens):
        return self.inner(tokens)


def export(net, example, path, name, free=None):
    torch.onnx.export(net, (example,), str(path), input_names=[name], output_names=["embedding"], opset_version=14, dynamo=False,
                      dynamic_axes=free, do_constant_folding=True)
    m = onnx.load(str(path))
    onnx.checker.check_model(m)
    print(path.name, path.stat().st_size, sorted({n.op_type for n in m.graph.node}))


def held_out_sample(held, most=160):
    """Whole objects with all their parts, from many scenes, as rows of the tile file."""
    rng, picked = np.random.default_rng(3), []
    for scene in rng.permutation(len(held.identities)):
        scene = list(held.identities)[scene]
        ids = held.identities[scene]
        view, seen = max(((v, s) for (sc, v), s in held.views.items() if sc == scene), key=lambda vs: len(vs[1]))
        things = [i for i in seen if ids[i].part is None and ids[i].thing["kind"] in texts.things.KINDS]
        full = [i for i in things if sum(ids[j].parent == i for j in seen) >= 3]
        for i in list(rng.permutation(full))[:2]:
            group = [i] + [j for j in seen if ids[j].parent == i]
            if len(picked) + len(group) > most:
                return picked
            picked += [(seen[j], ids[j], len(picked)) for j in group]
    return picked


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("model")
    ap.add_argument("held", nargs="+")
    ap.add_argument("--models", type=Path, required=True)
    ap.add_argument("--tests", type=Path, required=True)
    ap.add_argument("--made", default="")
    ap.add_argument("--most", type=int, help="scenes to measure on")
    a = ap.parse_args()
    a.models.mkdir(parents=True, exist_ok=True)
    a.tests.mkdir(parents=True, exist_ok=True)
    image, text = evaluate.load(a.model)
    export(image, torch.rand(1, 3, cutting.SIDE, cutting.SIDE), a.models / "demo_image.onnx", "tile")
    export(Text(text), torch.tensor([texts.tokens("red button of the blue controller")]), a.models / "demo_text.onnx", "tokens",
           {"tokens": {0: "n", 1: "t"}, "embedding": {0: "n"}})
    held = data.Tiles(a.held)
    measured = evaluate.measure(image, text, held, a.most)
    print(evaluate.summary(measured))
    texts.save_vocabulary(a.models / "demo_vocab.json", version=1, name="demo", dimension=model.DIM, tile_side_px=cutting.SIDE,
                          tokens=texts.TOKENS, temperature=10.0, canonical=texts.CANONICAL, glue=texts.GLUE, made=a.made,
                          held_out_share_and_count=measured)

    sample = held_out_sample(held)
    side, across = 32, 16
    # Half size keeps the file small; the test enlarges it again. Accuracy is measured on the very pixels.
    sheet = np.zeros((-(-len(sample) // across) * side, across * side, 3), np.uint8)
    entries, small = [], []
    for k, (row, who, first) in enumerate(sample):
        t = held.tiles[row].reshape(side, 2, side, 2, 3).mean((1, 3))
        t = (t + .5).astype(np.uint8)
        small.append(t)
        y, x = divmod(k, across)
        sheet[y * side:(y + 1) * side, x * side:(x + 1) * side] = t
        whole = f"{who.thing['color']} {who.thing['kind']}"
        query = whole if who.part is None else f"{texts.part_words(who.part['base'])[0]} of the {whole}"
        entries.append({"query": query, "thing": first if who.part is not None else None})
    Image.fromarray(sheet).save(a.tests / "held_out.png", optimize=True)
    json.dump({"side_px": side, "across": across, "tiles": entries}, open(a.tests / "held_out.json", "w"), indent=0)

    def enlarge(t):
        return np.repeat(np.repeat(t, 2, 0), 2, 1)
    with torch.no_grad():
        golden = {"text": {p: [round(float(v), 7) for v in text(torch.tensor([texts.tokens(p)]))[0]] for p in GOLDEN}, "image": {}}
        for k in (0, 1):
            x = torch.from_numpy(enlarge(small[k])).permute(2, 0, 1)[None].float() / 255
            golden["image"][str(k)] = [round(float(v), 7) for v in image(x)[0]]
    # A region cut by both programs.
    rng = np.random.default_rng(1)
    pixels = rng.integers(0, 256, (23, 31, 3))
    mask = rng.random((23, 31)) < .7
    mask[:3], mask[:, 26:] = False, False
    for side in (16, 64):
        golden[f"cut_{side}"] = [round(float(v), 5) for v in cutting.cut(pixels.astype(np.float32) / 255, mask, side).reshape(-1)[::37]]
    golden["cut_rgb"] = pixels.reshape(-1).tolist()
    golden["cut_mask"] = "".join("#" if m else "." for m in mask.reshape(-1))
    json.dump(golden, open(a.tests / "golden.json", "w"), indent=None)
    for f in sorted(a.tests.iterdir()):
        print(f.name, f.stat().st_size)


if __name__ == "__main__":
    main()
