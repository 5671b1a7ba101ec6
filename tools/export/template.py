"""Architecture -> `NAME.zip`: its graphs without their weights, and which tensor of the official checkpoint each weight is.

    python template.py clip ViT-B-16 --name clip-vit-b16 --out ../../assets/models
    python template.py clip --reduced --random 7 --name reduced --out FOLDER --checkpoint-out FOLDER/reduced.pt

The program fills a template itself (`src/models/template`). Which tensor a weight is, is found by content: the
weights are random here, so no two are alike. Nothing that depends on weights is computed at export: engines do
that when they load a graph.
"""

import argparse
import hashlib
import json
import tempfile
import zipfile
from pathlib import Path

import numpy as np
import onnx
import torch
from onnx import numpy_helper

import graphs

# Bytes that a constant that is no weight may have in a graph: tables of positions, causal masks, resizing.
MOST_CONSTANT = 1 << 21


def content(array):
    """What tells the numbers of an array from others, whatever its shape."""
    return hashlib.sha256(np.ascontiguousarray(array, np.float32).tobytes()).hexdigest()


def load(kind, model, seed, reduced):
    if kind == "clip":
        import export_clip as export
        return export, export.load(model, None, seed, reduced), None if reduced else model
    if kind == "sam2":
        import export_sam2 as export
        import sam2_models
        return export, sam2_models.load(model, None, seed, reduced), model
    import export_sam as export
    import sam_models
    if reduced and model == "vit_h":
        # In two parts, as at full size.
        export.MOST_WEIGHTS = 0
    return export, sam_models.load(model, None, seed, reduced), model


def stripped(path, state):
    """A graph without its weights, and [initializer, tensor] of those."""
    graph, weights = onnx.load(str(path)), []
    known = {content(v): k for k, v in state.items() if v.dtype == np.float32}
    kept = []
    for tensor in graph.graph.initializer:
        array = numpy_helper.to_array(tensor)
        source = known.get(content(array)) if array.dtype == np.float32 else None
        if source is None:
            if array.nbytes > MOST_CONSTANT:
                raise SystemExit(f"{path.name}: no tensor of the checkpoint is '{tensor.name}' {list(array.shape)}")
            print(f"{path.name}: keeps '{tensor.name}' {array.dtype} {list(array.shape)}")
            kept.append(tensor)
        else:
            weights.append([tensor.name, source, list(array.shape)])
    del graph.graph.initializer[:]
    graph.graph.initializer.extend(kept)
    return graph.SerializeToString(), weights


def learned(value, state):
    """The tensor whose numbers a field of the description repeats."""
    if isinstance(value, list) and value and all(isinstance(v, float) for v in value):
        return next((k for k, v in state.items() if v.size == len(value) and content(v) == content(np.array(value))), None)
    return None


def write(export, model, architecture, name, out):
    state = {k: v.detach().numpy() for k, v in model.state_dict().items()}
    contents = [content(v) for v in state.values() if v.dtype == np.float32]
    if len(set(contents)) != len(contents):
        raise SystemExit("two tensors of the checkpoint are alike; weights would not be told apart")
    with tempfile.TemporaryDirectory() as folder:
        folder = Path(folder)
        export.write(model, folder, name, architecture)
        about = json.loads((folder / f"{name}.json").read_text())
        for field in ("source", "logit_scale", "logit_bias"):
            about.pop(field, None)
        values = {k: source for k, v in about.items() if (source := learned(v, state))}
        for field in values:
            del about[field]
        weights, files = {}, {}
        for role, graph in about["graphs"].items():
            for field in ("bytes", "sha256"):
                del graph[field]
            files[graph["file"]], weights[role] = stripped(folder / graph["file"], state)
        used = {source for rows in weights.values() for _, source, _ in rows} | set(values.values())
        tensors = {k: list(v.shape) for k, v in state.items() if k in used}
        template = {"description": about, "weights": weights, "values": values, "tensors": tensors, "unused": sorted(set(state) - used)}
        files["template.json"] = json.dumps(template, separators=(",", ":")).encode()
    out.mkdir(parents=True, exist_ok=True)
    path = out / f"{name}.zip"
    with zipfile.ZipFile(path, "w", zipfile.ZIP_DEFLATED, compresslevel=9) as archive:
        for file, data in sorted(files.items()):
            entry = zipfile.ZipInfo(file, (1980, 1, 1, 0, 0, 0))
            entry.compress_type, entry.external_attr = zipfile.ZIP_DEFLATED, 0o644 << 16
            archive.writestr(entry, data)
    print(f"{path.name}: {path.stat().st_size:,} bytes, {len(tensors)} tensors; not used: {template['unused']}")


def main():
    ap = argparse.ArgumentParser(description=__doc__, formatter_class=argparse.RawDescriptionHelpFormatter)
    ap.add_argument("kind", choices=["clip", "sam", "sam2"])
    ap.add_argument("model", nargs="?", help="name of the architecture, as the exports take it")
    ap.add_argument("--random", type=int, default=1, metavar="SEED")
    ap.add_argument("--reduced", action="store_true", help="a tiny architecture, for tests")
    ap.add_argument("--name", required=True)
    ap.add_argument("--out", type=Path, required=True)
    ap.add_argument("--checkpoint-out", type=Path, help="also the random weights, as the official code stores them")
    a = ap.parse_args()
    graphs.FOLD = False
    export, model, architecture = load(a.kind, a.model or {"clip": "ViT-B-16", "sam": "vit_b", "sam2": "sam2.1-tiny"}[a.kind], a.random, a.reduced)
    write(export, model, architecture, a.name, a.out)
    if a.checkpoint_out:
        state = model.state_dict()
        torch.save({"model": state} if a.kind == "sam2" else state, a.checkpoint_out)


if __name__ == "__main__":
    main()
